"""Define the one exception of the public interface, and convert the errors of the packages below to it."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager

from agent.errors import DEFECT, USAGE, defect_sentence, exit_code_of, one_sentence

# Messages of the packages below name flags of `structagent run`: here they are parameters. Flags of other commands,
# which stand in messages as whole commands, stay.
_PHRASES = (
    (re.compile(r"--call '([^'=]+)=([^'=]+)'"), r"nouns={'\1': '\2'}"),
    (re.compile(r"--topic (\w+)=TOPIC"), r"topics={'\1': TOPIC}"),
    (re.compile(r"--camera-pose( X,Y,Z,ROLL,PITCH,YAW)?"), "world_from_camera"),
    (re.compile(r"--call\b"), "nouns"),
    (re.compile(r"--topic\b"), "topics"),
    (re.compile(r"--allow-unverified\b"), "allow_unverified=True"),
    (re.compile(r"--(at|model|objects|scene|seed|weights)\b"), r"\1"),
)


class StructagentError(ValueError):
    """An input that cannot be used, or an instruction that cannot be carried out, in one sentence.

    Attributes:
        exit_code: as the command line ends with: 2 a wrong argument, 3 an instruction that cannot be built with these
            objects, 4 no valid arrangement, 6 clouds or files that cannot be used, 7 a checkpoint that is not what its
            card says.
    """

    def __init__(self, message: str, exit_code: int = USAGE) -> None:
        super().__init__(message)
        self.exit_code = exit_code


@contextmanager
def public_errors() -> Iterator[None]:
    """Raise known errors of the packages below as `StructagentError`; a defect keeps its type and its traceback."""
    try:
        yield
    except StructagentError:
        raise
    except Exception as error:
        code = exit_code_of(error)
        if code is None or code == DEFECT:
            error.add_note(defect_sentence(error))
            raise
        raise StructagentError(in_python(one_sentence(error)), code) from None


def in_python(message: str) -> str:
    """Write flags of `structagent run` in a message as parameters: "--allow-unverified" as "allow_unverified=True"."""
    for flag, parameter in _PHRASES:
        message = flag.sub(parameter, message)
    return message
