"""Text that is not English is refused by name of the problem, and mistyped English is not."""

import json
from pathlib import Path

import pytest

from grounding.foreign_languages import foreign_language
from grounding.parsers.spelling import mend

DATA = Path(__file__).parents[2] / "grounding" / "benchmark_data"
FOREIGN = {
    "German": ["bau einen Turm aus den Dosen", "stelle die Tassen in einen Kreis", "Räum den Tisch auf"],
    "French": ["mets les tasses en cercle", "une tour de boîtes", "range les cubes en ligne"],
    "Spanish": ["pon las tazas en un círculo", "haz una torre con los cubos"],
    "Italian": ["metti le tazze in cerchio", "impila le scatole a sinistra"],
    "Portuguese": ["coloque as xícaras em um círculo"],
    "Dutch": ["zet de kopjes in een kring"],
    "Swedish": ["ställ kopparna i en cirkel"],
    "Polish": ["ułóż puszki w wieżę"],
    "Russian": ["построй башню из банок"],
    "Japanese": ["テーブルをセットして"],
    "Turkish": ["bardakları daire şeklinde diz"],
}


@pytest.mark.parametrize(("language", "text"), [(name, text) for name, texts in FOREIGN.items() for text in texts])
def test_other_languages_are_named(language, text):
    assert foreign_language(text) == language


@pytest.mark.parametrize(
    "text",
    ["circle", "cups circle left", "mugs -> ring", "tacos in a row", "matryoshka dolls line", "a", "3", "?!", ""],
)
def test_short_and_odd_english_passes(text):
    assert foreign_language(text) is None


def test_no_instruction_of_the_benchmark_is_taken_for_another_language(encoder):
    rows = [json.loads(line)["text"] for name in ("free", "development") for line in (DATA / f"{name}.jsonl").open()]
    assert [
        text for text in rows if foreign_language(text, lambda said=text: mend(said, encoder.whole_words).text)
    ] == []


def test_an_interpreter_refuses_them(interpreter):
    first, second, third = interpreter.interpret_many(
        ["stack the cans", "bau einen Turm aus den Dosen", "make a circle"]
    )
    assert (first.spec.shape, third.spec.shape) == ("tower", "circle")
    assert second.status == "refused" and not second.goal.parts
    assert second.message == (
        "'bau einen Turm aus den Dosen' seems to be in German: say it in English, the only language that "
        "structagent understands"
    )
