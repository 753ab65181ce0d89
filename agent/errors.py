"""Define every error that a command can raise, and its exit code."""

from __future__ import annotations

import os
import sys
import traceback
from pathlib import Path

DONE = 0
DEFECT = 1  # of the program itself
USAGE = 2
NOT_BUILDABLE = 3
NO_VALID_GOAL = 4
EXECUTION_FAILED = 5
BAD_INPUT = 6
NOT_VERIFIED = 7
PARTLY_DONE = 8
EXECUTED = 9  # by an arm, and not verified
ROBOT_REFUSED = 10
INTERRUPTED = 130
ENDED_FROM_OUTSIDE = (INTERRUPTED, 143, 129)  # by Ctrl-C, SIGTERM, or SIGHUP: 128 and the number of the signal


class AgentError(Exception):
    """An error of the tool itself; the message is one sentence that names the value and the legal ones."""

    exit_code = USAGE


class UsageError(AgentError):
    """A command was called with values that do not go together."""


class NotBuildable(AgentError):
    """The instruction cannot be built with the objects at hand."""

    exit_code = NOT_BUILDABLE


class NoValidGoal(AgentError):
    """No proposed arrangement is valid."""

    exit_code = NO_VALID_GOAL


class ExecutionFailed(AgentError):
    """The arm could not build the structure, or it does not stand as asked."""

    exit_code = EXECUTION_FAILED


class PartlyDone(AgentError):
    """What stands was built with some of the objects that were asked for, because the others could not take part."""

    exit_code = PARTLY_DONE


class ExecutedUnverified(AgentError):
    """An arm carried out every motion, and nobody has looked whether anything stands."""

    exit_code = EXECUTED


class RobotRefused(AgentError):
    """Nothing was moved: an arm cannot be reached, is not as planned, or the motion was not approved."""

    exit_code = ROBOT_REFUSED


class RobotStopped(ExecutionFailed):
    """An arm was stopped on the way; nothing moves again without a new approval."""


class BadInput(AgentError):
    """A file or folder that was given cannot be used."""

    exit_code = BAD_INPUT


class NotWritten(UsageError):
    """An output file could not be written, for example because the disk is full; what was there before is whole."""

    exit_code = BAD_INPUT


class NotVerified(AgentError):
    """A model is not what its card says, or does not work."""

    exit_code = NOT_VERIFIED


# Where each error of the other packages is defined. They are looked up among the modules already loaded: an error of
# a module that was never imported cannot have been raised, and importing one here would make every failure slow.
_EXIT_CODE_OF = {
    ("builtins", "OSError"): BAD_INPUT,
    ("builtins", "FloatingPointError"): BAD_INPUT,
    ("grounding.figures.figure", "FigureError"): BAD_INPUT,
    ("grounding.spec", "SpecError"): NOT_BUILDABLE,
    ("grounding.viewpoint", "ViewpointError"): USAGE,
    ("grounding.parsers.llm_reply", "LLMError"): BAD_INPUT,
    ("grounding.benchmark", "BenchmarkError"): BAD_INPUT,
    ("grounding.parsers.embedding", "ParserWeightsError"): BAD_INPUT,
    ("grounding.resolve.errors", "ResolveError"): NOT_BUILDABLE,
    ("grounding.parsers.sentence_encoder", "EncoderError"): BAD_INPUT,
    ("structdiffusion.data.scene_sampling", "SceneError"): NOT_BUILDABLE,
    ("structdiffusion.structures.structure", "LayoutError"): NOT_BUILDABLE,
    ("structdiffusion.simulation.visible_points", "ObservationError"): NOT_BUILDABLE,
    ("structdiffusion.word_tokens", "UnknownWordError"): NOT_BUILDABLE,
    ("structdiffusion.objects.model", "ObjectError"): BAD_INPUT,
    ("structdiffusion.models.checkpoint", "CheckpointError"): BAD_INPUT,
    ("structdiffusion.data.npz_files", "DataFolderError"): BAD_INPUT,
    ("structdiffusion.benchmark.released_network", "ReleasedNetworkError"): BAD_INPUT,
    ("structdiffusion.parallel", "WorkerError"): DEFECT,
}


def exit_code_of(error: BaseException) -> int | None:
    """Return the exit code for `error`, or `None` for an unknown error, which is a defect."""
    if isinstance(error, AgentError):
        return error.exit_code
    if isinstance(error, KeyboardInterrupt):
        return INTERRUPTED
    for (module, name), code in _EXIT_CODE_OF.items():
        kind = getattr(sys.modules.get(module), name, None)
        if kind is not None and isinstance(error, kind):
            return code
    return None


def one_sentence(error: BaseException) -> str:
    """Return the error's message on one line, with the names of drawings alone; for an error of the operating system,
    without its number.
    """
    from grounding.figures.drawings import without_drawings

    if isinstance(error, OSError) and error.strerror:
        reason = f"{error.strerror[:1].lower()}{error.strerror[1:]}"
        return f"{str(error.filename)!r}: {reason}" if error.filename else reason
    return without_drawings(" ".join(str(error).split())) or type(error).__name__


def is_defect(error: Exception) -> bool:
    """Return whether an error is one of the program itself: it cannot be mended by other input or more memory."""
    return exit_code_of(error) in (None, DEFECT) and not isinstance(error, MemoryError | ImportError)


def defect_sentence(error: BaseException) -> str:
    """Return a sentence for an error of the program itself: its kind, and the innermost place in our packages."""
    root = Path(__file__).parents[1]
    ours = tuple(str(root / package) + os.sep for package in ("agent", "grounding", "structdiffusion"))
    places = [
        f", at {Path(frame.filename).relative_to(root).as_posix()} line {frame.lineno}"
        for frame in traceback.extract_tb(error.__traceback__)
        if frame.filename.startswith(ours)
    ]
    return f"a defect of structagent, {type(error).__name__}: {one_sentence(error)}{places[-1] if places else ''}"
