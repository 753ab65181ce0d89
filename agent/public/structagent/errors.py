"""The one exception of the public interface, and how the errors of the packages below become it."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager

from agent.errors import DEFECT, USAGE, exit_code_of, one_sentence

# Messages of the packages below name flags of the command line: here they are parameters.
_CALL = re.compile(r"--call '([^'=]+)=([^'=]+)'")
_FLAG = re.compile(r"--([a-z][a-z-]*[a-z])")
_PARAMETERS = {"camera-pose": "world_from_camera", "call": "nouns", "topic": "topics"}


class StructagentError(ValueError):
    """An input that cannot be used, or a wish that cannot come true, in one sentence.

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
            raise
        raise StructagentError(in_python(one_sentence(error)), code) from None


def in_python(message: str) -> str:
    """The message with flags of the command line as parameters: "--allow-unverified" as "allow_unverified"."""
    message = _CALL.sub(r"nouns={'\1': '\2'}", message)
    return _FLAG.sub(lambda flag: _PARAMETERS.get(flag[1], flag[1].replace("-", "_")), message)
