"""The interpreter that users have, with the shipped networks."""

from agent.pipeline.instruction_parser import ReadingOptions, make_interpreter
from grounding.interpreter import Interpreter


def reader(viewpoint: str = "robot") -> Interpreter:
    """Return an interpreter of the shipped networks."""
    return make_interpreter(ReadingOptions(viewpoint=viewpoint))
