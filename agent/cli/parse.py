"""Convert instructions to slots, printed as text or as JSON lines: `structagent parse`."""

from __future__ import annotations

import json
import sys
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import TYPE_CHECKING, Annotated, TextIO

import typer

from agent.cli.arguments import ReadingArguments, with_arguments
from agent.cli.options import print_error
from agent.errors import DEFECT, NOT_BUILDABLE, BadInput, UsageError
from agent.rendering.text import number, slot_label
from agent.runtime.stdio import (
    NO_TEXT,
    as_text,
    lines_as_they_come,
    results_stream,
)
from grounding.figures.drawings import without_drawings
from grounding.goals.description import describe_part, describe_parts
from grounding.instruction_files import TABLE, InstructionFileError, looks_like_json, read_entries
from grounding.spec import SLOTS

if TYPE_CHECKING:
    from agent.pipeline.instruction_parser import ReadingOptions
    from grounding.interpretation import Interpretation

# Instructions that are parsed at once: among 128 enough have the same length to share a batch without padding, and they
# take less than a second.
AT_ONCE = 128


@with_arguments
def parse(
    ctx: typer.Context,
    texts: Annotated[
        list[str] | None,
        typer.Argument(metavar="TEXT", help="Instructions; by default the lines of standard input."),
    ] = None,
    *,
    reading: ReadingArguments,
    objects: Annotated[
        str | None,
        typer.Option(metavar="NAMES", help='Names of the objects on the table, such as "mug,bowl,plate,fork".'),
    ] = None,
    json_output: Annotated[bool, typer.Option("--json", help="Print one JSON object per line.")] = False,
) -> None:
    """Parse instructions into the five slots, or the parts of a goal.

    Each slot gets a confidence. An instruction that is unclear gets a question, and one that cannot be built is
    refused.

    Example: structagent parse "build a tower on the right" "stack the cans" --objects "can,can,mug" --json
    """
    if not texts and (sys.stdin is None or sys.stdin.isatty()):
        raise UsageError("parse needs an instruction, as an argument or on standard input, one per line")
    # With JSON every line has its row, even an empty one, so that rows and lines correspond.
    given = [list(map(as_text, texts))] if texts else _only_text(lines_as_they_come(sys.stdin, json_output))
    names = None if objects is None else [name.strip() for name in objects.split(",") if name.strip()]
    if names == []:
        raise UsageError(f'--objects must name objects, such as "mug,bowl,plate", and {objects!r} names none')
    options = reading.options(ctx)
    with results_stream() as results:
        count, refused, defects = parse_instructions(given, options, names, json_output, results, print_error)
    if not count:
        raise UsageError("parse needs an instruction, and standard input had none")
    if refused or defects:
        raise typer.Exit(DEFECT if defects else NOT_BUILDABLE)


def _only_text(batches: Iterator[list[str]]) -> Iterator[list[str]]:
    """Yield the same lines.

    Raises:
        BadInput: if the first ones show that they are no instructions but data.
    """
    unknown = True
    for lines in batches:
        if unknown and (said := [line for line in lines if line.strip()]):
            unknown = False
            if what := _data_in(said):
                legal = "parse takes one instruction per line; `structagent batch` takes JSON and tables"
                raise BadInput(f"standard input {what}; {legal}")
        yield lines


def _data_in(lines: Sequence[str]) -> str:
    """Say which kind of data begins with these lines; "" for instructions."""
    if looks_like_json(lines[0]):
        return "is JSON"
    try:  # a zero byte in a line costs this line
        found = read_entries("\n".join(lines).replace("\0", NO_TEXT).encode("utf-8", "replace"))
    except InstructionFileError as error:
        return str(error).partition(";")[0]
    return "is a table" if found.kind == TABLE else ""


def parse_instructions(
    texts: Iterable[Sequence[str]],
    options: ReadingOptions,
    names: Sequence[str] | None,
    as_json: bool,
    results: TextIO,
    on_problem: Callable[[str], None],
) -> tuple[int, int, int]:
    """Parse instructions and print each result at once; continue after one that is refused, or at which we fail.

    Args:
        texts: the instructions, in groups as they arrive; at most `AT_ONCE` of them are parsed together. None is kept,
            so that memory does not grow with their number.
        options: how to parse them.
        names: of the objects on the table, if they are known.
        as_json: print one JSON object per line.
        results: stream to print to.
        on_problem: takes a sentence for every refused instruction, and one for a fallback to another parser.

    Returns:
        The number of all instructions, of refused ones, and of those at which the program itself failed.
    """
    from agent.pipeline.instruction_parser import make_interpreter
    from agent.pipeline.reading_alone import read_alone

    def row(goal: Interpretation) -> tuple[Interpretation, str]:
        return goal, json.dumps(goal.to_dict(), ensure_ascii=False) if as_json else _as_text(goal, names)

    interpreter, counts, fallback = make_interpreter(options), Counter[str](), ""
    at_once = 1 if options.parser == "llm" else AT_ONCE  # a language model parses one by one, and takes seconds
    for given in texts:
        for start in range(0, len(given), at_once):
            for goal, text in read_alone(interpreter, given[start : start + at_once], names, row):
                if goal.fallback and goal.fallback != fallback:
                    fallback = goal.fallback
                    on_problem(fallback)
                print(text, file=results)
                counts[goal.status] += 1
                if goal.status in ("refused", "defect"):
                    on_problem(goal.message)
            results.flush()
    return counts.total(), counts["refused"], counts["defect"]


def _as_text(goal: Interpretation, names: Sequence[str] | None = None) -> str:
    from grounding.sentences import GOAL  # a command answers --help before numpy is there

    lines = [f"“{goal.parse.text}”"]
    if goal.status == "defect":
        return "\n".join([*lines, "  not read"])
    if goal.status == "refused":
        meant = (describe_parts(one.parts, names) for one in goal.suggestions)
        return "\n".join([*lines, "  refused", *(f"  {'may mean':<11} {one}" for one in meant)])
    if goal.question is not None:
        options = enumerate(goal.question.options, start=1)
        listed = (f"  {f'option {place}':<11} {one}" for place, one in options)
        return "\n".join(
            [*lines, f"  {'question':<11} {goal.message}", *(listed if goal.question.slot == GOAL else ())]
        )
    several = bool(goal.goal.parts) and goal.goal.plain_spec is None
    if several:
        lines += [
            f"  {f'part {number}':<11} {describe_part(part, names)}"
            for number, part in enumerate(goal.goal.parts, start=1)
        ]
    for slot in () if several else SLOTS:
        value = without_drawings(getattr(goal.spec, slot) or "")
        sure = goal.parse.confidence.get(slot)
        words = goal.parse.evidence.get(slot, ())
        note = f"{number(100 * sure, 0)} % sure" if sure is not None else ""
        note += f", by {' '.join(words)!r}" if words else ""
        lines.append(f"  {slot_label(slot):<11} {value or 'left open':<14} {note.removeprefix(', ')}".rstrip())
    lines.append(f"  {'objects':<11} {'everything' if goal.objects is None else ', '.join(goal.objects)}")
    if goal.viewpoint != "robot":
        lines.append(f"  {'viewpoint':<11} {goal.viewpoint}")
    if goal.message:
        lines.append(f"  {'note':<11} {goal.message}")
    return "\n".join(lines)
