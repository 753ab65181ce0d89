"""The five slots of a language model are measured with the paper's prompt alone,
those of the others as whole readings.
"""

from agent.evaluation import slot_reading
from agent.evaluation.parsing import measure_parsing
from agent.evaluation.slot_reading import SlotReader, slot_reader
from agent.pipeline.instruction_parser import ReadingOptions
from grounding.interpreter import Interpreter
from grounding.parse_result import Parse
from grounding.spec import StructureSpec


class Towers:
    """A parser that finds a tower in everything."""

    name = "llm"

    def parse(self, text):
        return self.parse_batch([text])[0]

    def parse_batch(self, texts):
        return [Parse(text, StructureSpec("tower"), self.name, prompt_sha256="12") for text in texts]


def test_a_language_model_is_asked_for_the_slots_alone(monkeypatch, tmp_path):
    def unread(*_, **__):
        raise AssertionError("no goals are asked for")

    monkeypatch.setattr(slot_reading, "make_slot_parser", lambda options: Towers())
    monkeypatch.setattr(Interpreter, "interpret_many", unread)
    data = tmp_path / "rows.jsonl"
    data.write_text('{"text": "stack the cans", "shape": "tower"}\n{"text": "a line", "shape": "line"}\n')
    (found,) = measure_parsing(["llm"], [str(data)], [], None, ReadingOptions())["evaluations"]
    assert (found["parser"], found["exact"]["hits"], found["exact"]["n"]) == ("llm", 1, 2)
    assert found["prompt_sha256"] == "12" and found["objects"]["n"] == 0


def test_the_slots_of_the_default_reader_are_those_of_what_would_be_built():
    assert isinstance(slot_reader(ReadingOptions()), Interpreter)
    (read,) = SlotReader(Towers(), "opposite").interpret_many(["a line"], None)
    assert (read.spec.shape, read.status, read.viewpoint, read.goal.parts) == ("tower", "ok", "opposite", ())
