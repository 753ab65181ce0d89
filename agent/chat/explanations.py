"""Answer questions about the conversation itself: what was asked for, what is proposed and why, and what was done."""

from __future__ import annotations

from collections.abc import Sequence

from agent.chat.history import TimelineTurn
from agent.chat.knowledge import DECIDE, Knowledge, next_step
from agent.chat.state import Build, Situation, objects_of
from agent.chat.table_facts import join_words, place_in_words, with_article
from agent.rendering.text import number, place
from agent.reporting.event_text import shortcoming
from grounding.dialogue.acts import Act
from grounding.figures.drawings import without_drawings
from grounding.goals.description import describe_part
from grounding.spec import StructureSpec

_OTHERS_SHOWN = 3  # candidates that an explanation compares


def _describe_plain(spec: StructureSpec, objects: Sequence[str]) -> str:
    """Describe a goal, as in "a small circle of cup 1, cup 2 and cup 3 (left)"."""
    values = [value for slot, value in spec.tokens() if slot not in ("shape", "size")]
    shape = " ".join(filter(None, (spec.size, without_drawings(spec.shape or "structure"))))
    return f"a {shape} of {join_words(objects)}" + (f" ({', '.join(values)})" if values else "")


def describe_wish(wish: Build | Situation) -> str:
    """Describe what is wanted or was built: one structure, or the numbered parts; from the speaker's side if known."""
    goal = wish.spoken if isinstance(wish, Situation) else wish.goal
    if (spec := goal.plain_spec) is not None:
        return _describe_plain(spec, objects_of(goal, wish.names))
    lines = [describe_part(part, wish.names) for part in goal.parts]
    return lines[0] if len(lines) == 1 else "; ".join(f"{number}. {line}" for number, line in enumerate(lines, start=1))


def explain_choice(act: Act, known: Knowledge) -> str:
    """Explain why a candidate, by default the chosen one, was preferred to the next ones."""
    proposal = known.situation.proposal
    if proposal is None:
        return f"There is no proposal now, so there is no choice to explain. {next_step(known)}"
    candidates = proposal.proposed.candidates
    rank = int(act.value or proposal.rank)
    if not 1 <= rank <= len(candidates):
        return f"There is no candidate {rank}; there are 1 to {len(candidates)}."
    mine, best = candidates[rank - 1], candidates[0]
    factors = join_words([f"{name} {number(value, 2)}" for name, value in mine.scores.items() if name != "total"])
    which = "the best" if rank == 1 else f"number {rank}"
    total = number(mine.scores.get("total"), 2)
    lines = [f"Candidate {rank} is {which} of {len(candidates)}: its score, {total}, is the product of {factors}."]
    others = [one for one in candidates[: _OTHERS_SHOWN + 1] if one is not mine and one is not best][:_OTHERS_SHOWN]
    if mine is not best:
        lines.append(f"Against the best, candidate 1: {shortcoming(mine.scores, best.scores)}.")
    lines += [f"Candidate {one.rank}: {shortcoming(one.scores, best.scores)}." for one in others]
    return "\n".join((*lines, "/why shows all factors, /choose takes another one."))


def describe_plan(act: Act, known: Knowledge) -> str:
    """Describe what would be built and where each object asked about, by default every one, would go;
    or what is built.
    """
    if known.progress:
        return known.progress
    situation = known.situation
    if known.question is not None or situation.proposal is None or not situation.asked:
        return next_step(known) if known.question is not None else f"Nothing is planned. {next_step(known)}"
    joint = ", " if situation.goal.plain_spec is not None else " for: "
    lines = [f"I propose candidate {situation.proposal.rank}{joint}{describe_wish(situation)}:"]
    about = {fact.name for fact in known.matching(act.about)} if act.kind == "next" and act.about else set()
    for goal in situation.proposal.chosen.goals:
        if not about or goal["name"] in about:
            words = place_in_words(goal["position"], known.seen.table, situation.viewpoint)
            where = place(goal["position"], situation.viewpoint)
            lines.append(f"  {with_article(goal['name'])} goes {words}: {where}")
    return "\n".join((*lines, f"Nothing moves until you agree: {DECIDE}."))


def describe_last_build(act: Act, known: Knowledge) -> str:
    """Describe the last build."""
    if known.progress:
        return known.progress
    builds = known.situation.builds
    if not builds:
        return f"I have built nothing that still stands on the table. {next_step(known)}"
    return describe_build(builds[-1])


def describe_builds(act: Act, known: Knowledge) -> str:
    """Describe every build that was not put back, the first build first."""
    builds = known.situation.builds
    return "\n".join(map(describe_build, builds)) if builds else describe_last_build(act, known)


def describe_remaining(act: Act, known: Knowledge) -> str:
    """Describe what was asked for and is not built yet."""
    if known.progress:
        return known.progress
    situation = known.situation
    if not situation.asked:
        return f"Nothing is left to do: you have not asked for anything yet. {next_step(known)}"
    what = describe_wish(situation)
    if known.question is not None or situation.proposal is not None:
        return f"Still to build: {what}. {next_step(known)}"
    last = situation.builds[-1] if situation.builds else None
    if last is None or last.goal != situation.goal or not last.moved:
        return f"Still to build: {what}. “continue” proposes it again."
    if last.trouble:
        return f"{describe_build(last)} “continue” proposes it again."
    return f"Nothing is left to do: {what} stands as asked. {next_step(known)}"


def describe_build(build: Build) -> str:
    """Describe the outcome of a build in one or two sentences."""
    what = describe_wish(build)
    moved = (
        f"I moved {join_words([with_article(name) for name in build.moved])}" if build.moved else "Nothing was moved"
    )
    if build.trouble:
        return f"I tried to build {what}. {moved}. It is not as asked: {build.trouble}."
    if not build.moved:
        return f"I tried {what} without the arm: it would stand."
    return f"I built {what}, and it stands as asked. {moved}."


def _part_asked_for(number: int, situation: Situation) -> str:
    parts = situation.spoken.parts
    if not 1 <= number <= len(parts):
        return f"There is no part {number}. You asked for {describe_wish(situation)}."
    return f"Part {number}: {describe_part(parts[number - 1], situation.names)}."


def requested(act: Act, known: Knowledge) -> str:
    """Describe the last request."""
    situation = known.situation
    if not situation.asked:
        return f"You have not asked for anything yet. {next_step(known)}"
    if act.value:
        return _part_asked_for(int(act.value), situation)
    said = f"You asked for {describe_wish(situation)}."
    if known.question is not None or situation.proposal is not None:
        return f"{said} {next_step(known)}"
    return f"{said} {describe_build(situation.builds[-1])}" if situation.builds else said


def timeline_row(turn: TimelineTurn, left: Situation, is_present: bool) -> tuple[str, str, str, str]:
    """Describe a turn: its number, what was said, what became of it, and where it belongs.

    Args:
        turn: the turn.
        left: the situation in which it was left.
        is_present: whether it is the present turn.
    """
    states = (
        ("built" if left.built else "proposed" if left.proposal is not None else "not built",) if left.asked else ()
    )
    state = ", ".join((*states, *(("a question is open",) if left.dialogue.question is not None else ())))
    after = "" if turn.after is None else f"after {turn.after}, branch {turn.branch}"
    return f"{'>' if is_present else ' '} {turn.number}", turn.line or "the start", state, after
