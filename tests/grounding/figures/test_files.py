"""A figure's file is read as it was written, and what is wrong in one is said with the file,
the key and what is legal.
"""

import pytest

from grounding.figures.figure import FigureError
from grounding.figures.files import figure_text, read_figure, write_figure
from grounding.figures.names import figure_named, figure_names

HEAD = 'name = "a shape"\nnouns = ["shape"]\nleast = 2\n'
LINE = "strokes = [[[0, 0], [1, 0]]]\n"


@pytest.mark.parametrize("name", figure_names())
def test_what_is_written_is_read_again(name, tmp_path):
    figure, path = figure_named(name), tmp_path / "figure.toml"
    write_figure(figure, path)
    assert read_figure(path) == figure


def test_any_text_can_be_a_name(tmp_path):
    figure = read_figure(_file(tmp_path, HEAD.replace("a shape", r"a \"shape\" \\ \n é") + LINE))
    assert figure.name == 'a "shape" \\ \n é'
    assert read_figure(_file(tmp_path, figure_text(figure))) == figure


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ("name = ", "is not a TOML file"),
        (LINE, "the key 'name' is missing"),
        (HEAD + LINE + "colour = 1\n", "unknown key 'colour'; legal keys: name, nouns"),
        (HEAD, "a figure has one of strokes, pattern, blocks and places"),
        (HEAD + LINE + 'pattern = ["x"]\n', "a figure has one of strokes, pattern, blocks and places"),
        (HEAD + "strokes = [[[0, 0, 1]]]\n", "strokes cannot have the point [0, 0, 1]; legal: pairs of numbers"),
        (HEAD + "strokes = [[[0, nan]]]\n", "strokes cannot have nan; legal: finite numbers"),
        (HEAD + "strokes = [[]]\n", "a stroke cannot be empty"),
        (HEAD + "blocks = [{x = 0, level = 0}, {x = 2, level = 1}]\n", "the block at x 2 of level 1 stands on nothing"),
        (HEAD + "blocks = [{x = 0}]\n", "legal: x, level and width of each block"),
        (HEAD + LINE + 'grows = ["posts"]\n', "grows needs blocks"),
        (HEAD + 'blocks = [{x = 0, level = 0}]\ngrows = ["up"]\n', "grows cannot be 'up'; legal values: posts, rows"),
        (HEAD.replace("2", "0") + LINE, "least cannot be 0; legal: whole numbers from 1"),
        (HEAD + 'pattern = ["x", "x."]\n', "pattern must be rows of one length"),
    ],
)
def test_what_is_wrong_is_said(content, said, tmp_path):
    with pytest.raises(FigureError) as error:
        read_figure(_file(tmp_path, content))
    assert said in str(error.value) and "figure.toml" in str(error.value) and "\n" not in str(error.value)


def test_a_missing_file_is_said(tmp_path):
    with pytest.raises(FigureError, match="cannot be read: No such file"):
        read_figure(tmp_path / "none.toml")


def _file(folder, content):
    path = folder / "figure.toml"
    path.write_text(content, encoding="utf-8")
    return path
