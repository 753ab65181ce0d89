"""Describe events in words and numbers, shared by the terminal and the page."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from agent.rendering.text import duration, number, place, slot_label
from structdiffusion.evaluation_protocol import INTERSECTION, RELEASE_HEIGHT


def describe_row(one: Mapping[str, Any]) -> tuple[str, str, str]:
    """Describe an observed object: its name, its place, and whether it takes part.

    Args:
        one: a `SeenObject` in its JSON form.
    """
    return describe_object(one), place(one["position"]), "" if one["takes_part"] else "stays where it is"


def describe_object(one: Mapping[str, Any]) -> str:
    """Return the name of an object that was seen, with its description or its colour: "object 3, red, tall".

    What the picture takes it for follows its name, as in "object 3 (mug, 0.93), red": everything else calls it by that.
    """
    display_name, color = one.get("display_name") or "", one.get("color_name") or ""
    if one.get("confidence") is not None:
        return ", ".join((f"{one['name']} ({one['category']}, {one['confidence']:.2f})", *display_name.split(", ")[1:]))
    if display_name.startswith(f"{one['name']},"):
        return display_name
    noun, _, number = one["name"].rpartition(" ")
    if noun == "object" and display_name.partition(",")[0].endswith(f" {number}"):  # named by the user
        return display_name
    return f"{one['name']}, {color}" if color and color not in one["name"].split() else one["name"]


# What is done about what was noticed, by `Noticed.action`.
_ANSWERS = {
    "go on": "the build goes on",
    "place again": "it is placed again",
    "take down": "what stands on it is taken down first",
    "set aside": "it is set aside first",
    "lay out anew": "what is left is laid out anew",
    "leave out": "it is left out",
    "end": "the build ends here",
}


def arm_sentence(payload: Mapping[str, Any], names: Sequence[str]) -> str:
    """Describe an event of the arm in one sentence.

    Args:
        payload: the event's JSON form.
        names: of the objects that take part, in the order of the scene.
    """
    match payload["kind"]:
        case "planned":
            moves = list(zip(payload["order"], payload["grasps"], strict=True))
            order = ", then ".join(
                f"{names[index]} ({grasp}{', set aside' if index in payload['order'][step:] else ''})"
                for step, (index, grasp) in enumerate(moves, start=1)
            )
            return f"planned candidate {payload['arrangement'] + 1} in {duration(payload['seconds'])}: {order}"
        case "plan_failed":
            about = f" for {payload['name']}" if payload["object"] is not None else ""
            return f"no plan for candidate {payload['arrangement'] + 1}{about}: {payload['reason']}"
        case "picked":
            again = f", attempt {payload['attempt']}" if payload["attempt"] > 1 else ""
            how = f"grasp: {payload['grasp']}{again}"
            return f"picked {payload['name']} ({how}): {payload['fingers']} fingers touch it"
        case "pick_failed":
            attempt = f"grasp: {payload['grasp']}, attempt {payload['attempt']}"
            return f"could not pick {payload['name']} ({attempt}): {payload['reason']}"
        case "placed":
            return f"{_placed(payload)}, {duration(payload['seconds'])}"
        case "standing_changed" if payload["stands"]:
            return f"{payload['name']} stands as placed again, since {payload['during']}"
        case "standing_changed":
            return f"{payload['name']} no longer stands: it {payload['trouble']} since {payload['during']}"
        case "noticed":
            answer = _ANSWERS.get(payload["action"], payload["action"])
            return f"noticed: {payload['name']} {payload['detail']}; {answer}"
        case "set_aside" if payload["trouble"]:
            return f"could not set {payload['name']} aside, which was {payload['detail']}: {payload['trouble']}"
        case "set_aside":
            return f"set {payload['name']} aside, which was {payload['detail']}"
        case "place_failed":
            return f"could not place {payload['name']}: {payload['reason']}"
        case "stopped":
            held, hand = f"the {payload['name']}", "with nothing in the hand"
            if payload["object"] is not None:
                hand = f"and set {held} down" if payload["set_down"] else f"with {held} in the hand"
            return f"stopped {hand}; the arm {'has folded' if payload['folded'] else 'stays where it is'}"
        case "disturbed":
            return f"disturbed on purpose ({payload['disturbance']}): {payload['name']} {payload['detail']}"
        case kind:
            return kind.replace("_", " ")


def _placed(payload: Mapping[str, Any]) -> str:
    """Describe a placement: how near to the goal, or why the object does not stand, and why it was moved again."""
    again = f", which {payload['again']}" if payload["again"] else ""
    if payload["aside"]:
        fell = f", where it {payload['trouble']}" if payload["trouble"] else ""
        return f"moved {payload['name']}{again} out of the way{fell}"
    if payload["trouble"]:
        return f"released {payload['name']}{again}, but it does not stand: it {payload['trouble']}"
    off = f"{number(100 * payload['position_error_m'])} cm and {number(math.degrees(payload['angle_error_rad']))} deg"
    return f"placed {payload['name']}{again}: {off} from its goal"


def verdict_title(payload: Mapping[str, Any]) -> str:
    """Return the title of an event "checked" in its JSON form."""
    return f"Checked on {payload.get('on', 'the true objects')}" if payload["how"] == "arm" else "Tried without the arm"


TRIED = "tried without the arm; the table is unchanged"


def verdict_sentence(payload: Mapping[str, Any]) -> str:
    """Return the result of an event "checked" in its JSON form, with the number of objects if some were left out."""
    if not payload["success"]:
        return f"{payload['failure_class']}: {payload['detail']}"
    count, left_out = payload["count"], payload["left_out"]
    built = payload["how"] == "arm"
    if left_out:
        missing = f"{', '.join(left_out)} {'is' if len(left_out) == 1 else 'are'} left out"
        asked = f"{count} of {count + len(left_out)} objects stand as asked ({missing})"
    else:
        asked = "It stands as asked" if built else "The goal holds as asked"
    return f"{asked}." if built else f"{asked} when released without the arm; the table is unchanged."


def trial_note(payload: Mapping[str, Any]) -> str:
    """Say what a trial without the arm shows and what not, for an event "checked"; empty for what the arm built."""
    if payload["how"] == "arm":
        return ""
    bodies = payload.get("on", "the true objects")
    note = (
        f"The trial lets {bodies} go {100 * RELEASE_HEIGHT:g} cm above their goals in physics, one after another; "
        "whether the arm can reach and grasp them is not tried."
    )
    if payload["failure_class"] == INTERSECTION:
        note += (
            " The goal itself may not reach into anything here, by the protocol; the arm lets go at the same height, "
            "and may build it nonetheless."
        )
    return note


def check_sentence(check: Mapping[str, Any]) -> str:
    """Describe a check's measured value and limit, as in "farthest from its goal (m): 0.012 (at most 0.04)"."""
    return f"{check['name']}: {number(check['measured'], 3)} ({check['limit']})"


def parse_notes(payload: Mapping[str, Any]) -> list[str]:
    """List the remarks on an event "parsed" in its JSON form besides the slots, a sentence each."""
    notes = []
    if payload["viewpoint"] != "robot":
        notes.append(f"spoken from the {payload['viewpoint']} side of the table, turned to the robot's")
    if payload["fallback"]:
        notes.append(payload["fallback"])
    for slot, value in payload["dropped"].items():
        notes.append(f"left out, because it does not go with the rest: {slot_label(slot)} {value}")
    if not payload.get("parts"):  # the parts name their objects themselves
        notes.append(
            f"with the objects named: {', '.join(payload['named'])}" if payload["named"] else "with every object there"
        )
    return notes


def part_lines(payload: Mapping[str, Any]) -> list[str]:
    """List the parts of the goal in an event "parsed" in its JSON form, numbered; nothing for one plain structure."""
    return [f"{number}. {part}" for number, part in enumerate(payload.get("parts") or (), start=1)]


def describe_goal_row(goal: Mapping[str, Any]) -> tuple[str, ...]:
    """Describe where an object goes: its name, what happens to it, where, and which parts of a goal place it.

    Args:
        goal: an entry of `Chosen.goals` in its JSON form.
    """
    how = "stays at" if goal.get("stays") else "is set aside to" if goal.get("aside") else "goes to"
    parts = goal.get("parts") or ()
    words = f"part{'s' * (len(parts) > 1)} {', '.join(map(str, parts))}" if parts else ""
    return goal["name"], how, place(goal["position"]), words


def remark_sentence(payload: Mapping[str, Any]) -> str:
    """Describe an event "asked", "answered", "noted", "commanded", "interjected",
    "forked" or "restored" in a sentence.
    """
    match payload["kind"]:
        case "asked":
            options = ", ".join(f"{number}) {option}" for number, option in enumerate(payload["options"], start=1))
            asked = payload["question"].rpartition("\n")[2]  # lines before show what it is about
            return f"{asked} {options}".rstrip()
        case "answered":
            return payload["answer"]
        case "commanded":
            return f"> {payload['line']}"
        case "interjected":
            placed = payload["placed"]
            when = f"after {placed} placement{'s' * (placed != 1)}"
            return f"> {payload['line']} ({when}): {payload['message'] or payload['outcome']}"
        case "forked":
            return f"branch {payload['branch']} begins after turn {payload['turn']}"
        case "restored":
            back = ", ".join(payload["moved"])
            return f"{payload['how']}: " + (f"put back {back}" if back else "nothing had to be put back")
        case _:
            return payload["message"]


# What a low factor of a candidate's score says, after `structdiffusion.postprocessing.ranking` and
# `structdiffusion.planners.diffusion`.
_SHORTCOMING = {
    "structure": "it looks less like what was asked for",
    "outcome": "it is less likely to stand as asked",
    "collision": "objects come too close to each other",
    "bounds": "it reaches beyond the table's edge",
    "checks": "it meets the requested measures less closely",
    "support": "the stack would stand less firmly",
    "free of distractors": "it comes too close to what has to stay",
}
_AS_GOOD, _ALMOST_AS_GOOD = 0.995, 0.95  # of the best's score


def shortcoming(scores: Mapping[str, float | None], best: Mapping[str, float | None]) -> str:
    """Say why a candidate ranks below the best: the factor of its score that costs it most, in words and numbers.

    Args:
        scores: of the candidate: "total" is the product of the others.
        best: of the best candidate.
    """
    total, most = scores.get("total") or 0.0, best.get("total") or 0.0
    if not most:  # so little that it was rounded away
        return "almost zero, like the best"
    if total >= _AS_GOOD * most:
        return "as good as the best"
    shares = {name: (scores.get(name) or 0.0) / value for name, value in best.items() if name != "total" and value}
    if not shares:
        return f"total {number(total, 2)} against {number(most, 2)}"
    worst = min(shares, key=lambda name: shares[name])
    words = _SHORTCOMING.get(worst, f"its {worst} is lower")
    almost = "almost as good, but " if total >= _ALMOST_AS_GOOD * most else ""
    return f"{almost}{words} ({worst} {number(scores.get(worst), 3)}, the best has {number(best[worst], 3)})"
