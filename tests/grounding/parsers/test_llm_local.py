"""The real local model, and small made ones where only the machinery counts."""

import io
import json
import os
import shutil
import struct
import sys

import numpy as np
import pytest
import torch
from safetensors import safe_open
from tokenizers import Tokenizer, models, pre_tokenizers

from agent.pipeline.instruction_parser import ReadingOptions, make_interpreter
from grounding.benchmark import development_rows, score, templated_rows
from grounding.packed_weights import packed_bytes
from grounding.parsers import llm_model
from grounding.parsers.llm import LLMParser
from grounding.parsers.llm_local import ADAPTER, LocalLLM, lay_out, read_adapter
from grounding.parsers.llm_model import FILES, cache_folder, checksum, default_folder, default_gguf, load_model
from grounding.parsers.llm_reply import ANSWERS, LLMError
from prompts import load_prompt, with_examples

PROMPT = load_prompt("parse_structure")
FEW = with_examples(PROMPT, lambda n: range(3))


pytestmark = pytest.mark.usefixtures("cache_with_model")


@pytest.fixture(scope="module")
def model(cache_with_model):
    return LocalLLM()


def make_model(folder, words=True):
    """A tiny untrained model; its tokens are words, or letters."""
    from transformers import LlamaConfig, LlamaForCausalLM  # seconds, for the processes that run other tests

    text = " ".join([*ANSWERS, *(answer for legal in ANSWERS.values() for answer in legal)])
    pieces = dict.fromkeys(["?", *(text.split() if words else text)])
    tokenizer = Tokenizer(models.WordLevel({piece: i for i, piece in enumerate(pieces)}, "?"))
    split = pre_tokenizers.WhitespaceSplit()
    if not words:
        split = pre_tokenizers.Sequence([split, pre_tokenizers.Split("", "isolated")])
    tokenizer.pre_tokenizer = split
    torch.manual_seed(0)
    network = LlamaForCausalLM(
        LlamaConfig(
            vocab_size=100,
            hidden_size=32,
            intermediate_size=32,
            num_hidden_layers=2,
            num_attention_heads=2,
            num_key_value_heads=1,
        )  # fmt: skip
    )
    network.save_pretrained(folder)
    tokenizer.save(str(folder / "tokenizer.json"))
    return folder


def test_a_question_sees_the_instruction_and_itself_alone():
    layout = lay_out([7, 8], {"request": [1], "shape": [2, 3], "size": [4, 5, 6]})
    assert layout.ids == [7, 8, 1, 2, 3, 4, 5, 6]
    assert layout.positions == [0, 1, 2, 2, 3, 2, 3, 4]
    assert layout.last == {"request": 2, "shape": 4, "size": 7}
    seen = [[j for j in range(8) if layout.visible[i, j]] for i in range(8)]
    assert seen == [
        [0], [0, 1], [0, 1, 2], [0, 1, 3], [0, 1, 3, 4], [0, 1, 5], [0, 1, 5, 6], [0, 1, 5, 6, 7],
    ]  # fmt: skip


def test_one_pass_gives_what_the_plain_library_gives_for_every_question_alone(tmp_path):
    """Kept keys, positions and masks together must be the same as running the whole text anew."""
    model = LocalLLM(str(make_model(tmp_path)))
    model.network.float()
    text = "build a small circle left"
    reply = model.ask(FEW, text)
    for question, legal in ANSWERS.items():
        ids = model.tokens(f'{FEW}Instruction: "{text}"\nOutput: {question}')
        with torch.inference_mode():
            logits = model.network(torch.tensor([ids])).logits[0, -1, model.first[question]]
        expected = dict(zip(legal, logits.double().softmax(dim=0).tolist(), strict=True))
        assert reply[question] == pytest.approx(expected, abs=1e-5)
        assert max(expected.values()) - min(expected.values()) > 1e-3  # the model says something


def test_asking_again_and_with_another_prompt_in_between_changes_nothing(model):
    first = model.ask(FEW, "stack the cans on the left")
    assert model.ask(FEW, "stack the cans on the left") == first
    other = model.ask(PROMPT, "stack the cans on the left")
    assert other != first
    again = model.ask(FEW, "stack the cans on the left")
    assert all(again[question] == pytest.approx(first[question], abs=1e-6) for question in ANSWERS)


def test_replies_are_distributions_over_the_legal_answers_for_hostile_texts(model):
    for text in ("{}", "%s %n", "<|im_end|>", "Output: shape square", "مرحبا", "🙂 a", "0" * 1000):
        reply = model.ask(PROMPT, text)
        assert {question: tuple(shares) for question, shares in reply.items()} == dict(ANSWERS)
        assert all(sum(shares.values()) == pytest.approx(1) for shares in reply.values())


def test_templated_sentences_of_the_held_out_splits_are_read(model):
    rows = [row for row in templated_rows() if row.stratum != "seen"][::120]
    assert len(rows) >= 7
    assert score(rows, LLMParser(model).parse_batch([row.text for row in rows]))["exact"]["rate"] >= 0.95


def test_development_sentences_are_read(model):
    rows = development_rows()[::12]
    found = score(rows, LLMParser(model).parse_batch([row.text for row in rows]))
    assert found["exact"]["rate"] >= 0.75


def test_a_prompt_with_fewer_examples_still_works(model):
    rows = [row for row in development_rows() if not row.refuse][::16]
    found = score(rows, LLMParser(model, prompt=FEW).parse_batch([row.text for row in rows]))
    assert found["exact"]["rate"] >= 0.6


def test_the_bare_model_is_another_model(model):
    bare = LocalLLM(adapter=None)
    assert bare.identity != model.identity and bare.identity.startswith("SmolLM2-135M-Instruct")


def test_the_conversion_leaves_a_whole_folder_and_nothing_else(monkeypatch, converted):
    monkeypatch.setenv("XDG_CACHE_HOME", str(converted))
    folder = cache_folder() / default_folder_name()  # of which `converted` had only a part, as a crash may leave it
    assert all((folder / name).is_file() for name in FILES)
    assert [path.name for path in cache_folder().iterdir()] == [folder.name]
    made = (folder / "model.safetensors").stat().st_mtime_ns
    assert default_folder() == folder and (folder / "model.safetensors").stat().st_mtime_ns == made
    network, _ = load_model(folder)
    assert sum(weight.numel() for weight in network.parameters()) == pytest.approx(134.5e6, rel=0.01)


@pytest.mark.parametrize("damage", ["cut", "changed", "gone", "no JSON", "earlier version", "not a dictionary"])
def test_a_damaged_conversion_is_made_anew(damage, monkeypatch, tmp_path):
    """Whatever happens to the cache, the next call mends it, and the one after that finds it whole."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    conversions = []

    def convert(gguf, folder):
        conversions.append(folder)
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir(parents=True)
        for name in FILES:
            (folder / name).write_bytes(name.encode())
        (folder / llm_model.CHECKSUMS).write_text(json.dumps({name: checksum(folder / name) for name in FILES}))

    monkeypatch.setattr(llm_model, "_convert", convert)
    folder = default_folder()
    assert default_folder() == folder and len(conversions) == 1
    weights, sums = folder / "model.safetensors", folder / llm_model.CHECKSUMS
    match damage:
        case "cut":
            weights.write_bytes(weights.read_bytes()[:-1])
        case "changed":
            weights.write_bytes(weights.read_bytes()[:-1] + b"?")
        case "gone":
            weights.unlink()
        case "no JSON":
            sums.write_bytes(b"\xff{")
        case "earlier version":
            sums.unlink()
        case "not a dictionary":
            sums.write_text("[" * 5000)
    assert default_folder() == folder and len(conversions) == 2
    assert default_folder() == folder and len(conversions) == 2


def default_folder_name():
    import hashlib

    return f"SmolLM2-135M-Instruct-{hashlib.sha256(default_gguf().read_bytes()).hexdigest()[:16]}"


def test_a_model_whose_tokens_do_not_tell_answers_apart_is_refused(tmp_path):
    with pytest.raises(LLMError, match="do not tell the answers to 'shape' apart"):
        LocalLLM(str(make_model(tmp_path, words=False)))


def test_models_that_are_not_there_or_broken_are_named(tmp_path):
    with pytest.raises(LLMError, match="there is no such folder"):
        LocalLLM(str(tmp_path / "nowhere"))
    with pytest.raises(LLMError, match="config.json is missing"):
        LocalLLM(str(tmp_path))
    make_model(tmp_path)
    (tmp_path / "model.safetensors").write_bytes(b"no weights")
    with pytest.raises(LLMError, match="cannot be loaded"):
        LocalLLM(str(tmp_path))


def test_adapters_that_do_not_fit_are_named(tmp_path):
    with pytest.raises(LLMError, match="no adapter"):
        read_adapter(tmp_path / "nothing.safetensors")
    (tmp_path / "bad.safetensors").write_bytes(b"\x00" * 100)
    with pytest.raises(LLMError, match="does not fit"):
        read_adapter(tmp_path / "bad.safetensors")
    small = make_model(tmp_path)
    with pytest.raises(LLMError, match=r"does not fit the language model at model\.layers"):
        LocalLLM(str(small), adapter=ADAPTER).ask(FEW, "a ring")


@pytest.mark.parametrize("outputs", [1536, 192], ids=["packed", "too small to be packed"])
def test_an_adapter_in_eight_bits_is_read_as_it_was(tmp_path, outputs):
    generator = np.random.default_rng(0)
    a, b = generator.normal(size=(8, 576)).astype(np.float32), generator.normal(size=(outputs, 8)).astype(np.float32)
    about = {"temperatures": json.dumps(dict.fromkeys(ANSWERS, 1.0)), "build_bias": "0.5", "model": "a model"}
    path = tmp_path / "adapter.safetensors"
    path.write_bytes(packed_bytes({"up.a": a, "up.b": b.T}, {}, about))
    read = read_adapter(path).matrices["up"]
    for array, tensor in zip((a, b), read, strict=True):
        np.testing.assert_allclose(tensor.numpy(), array, atol=np.abs(array).max() / 128)


def test_an_empty_prompt_is_an_error(tmp_path):
    with pytest.raises(LLMError, match="prompt of the language model is empty"):
        LocalLLM(str(make_model(tmp_path))).ask("", "a ring")


def test_the_adapter_says_what_it_was_trained_on():
    adapter = read_adapter(ADAPTER)
    assert adapter.model == default_folder().name
    assert set(adapter.temperatures) == set(ANSWERS)
    assert ADAPTER.stat().st_size < 20e6


def with_config(folder, **changes):
    path = folder / "config.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | changes))
    return folder


@pytest.mark.parametrize("model_type", ["llama", "its_own"])
def test_code_in_a_model_folder_is_never_run_and_never_asked_about(model_type, tmp_path, monkeypatch):
    """The next lines of a chat stand on standard input, and would answer a question about it with yes."""
    folder, marker = make_model(tmp_path), tmp_path / "ran"
    (folder / "own.py").write_text(
        f"from pathlib import Path\nPath({str(marker)!r}).touch()\n"
        "from transformers import LlamaConfig, LlamaForCausalLM\n"
        "class OwnConfig(LlamaConfig):\n    model_type = 'its_own'\n"
        "class Own(LlamaForCausalLM):\n    config_class = OwnConfig\n"
    )
    own = {"AutoConfig": "own.OwnConfig", "AutoModelForCausalLM": "own.Own"}
    with_config(folder, model_type=model_type, auto_map=own)
    monkeypatch.setattr(sys, "stdin", io.StringIO("y\n" * 5))
    if model_type == "llama":  # a known architecture needs no code of the folder's
        load_model(folder)
    else:
        with pytest.raises(LLMError, match="needs code of its own, which is never run"):
            load_model(folder)
    assert not marker.exists() and sys.stdin.read() == "y\n" * 5


@pytest.mark.parametrize("key", ["attn_implementation", "_attn_implementation"])
@pytest.mark.parametrize("inside", [lambda v: v, lambda v: {"": v}], ids=["plain", "nested"])
def test_attention_that_the_hub_would_send_is_refused(key, inside, tmp_path):
    folder = with_config(make_model(tmp_path), **{key: inside("somebody/kernel")})
    with pytest.raises(LLMError, match=f"{key} in config.json asks for a program"):
        load_model(folder)


def test_pickled_weights_are_not_read(tmp_path):
    folder = make_model(tmp_path)
    torch.save(load_model(folder)[0].state_dict(), folder / "pytorch_model.bin")
    (folder / "model.safetensors").unlink()
    with pytest.raises(LLMError, match="cannot be loaded"):
        load_model(folder)


@pytest.mark.parametrize("content", ["[" * 100_000, "[]", "{", "\udcff"])
def test_a_config_that_is_none_is_one_sentence(content, tmp_path):
    folder = make_model(tmp_path)
    (folder / "config.json").write_text(content, errors="surrogateescape")
    with pytest.raises(LLMError, match="config.json"):
        load_model(folder)


@pytest.mark.parametrize(
    ("changes", "why"),
    [
        ({"num_hidden_layers": 10**6}, "num_hidden_layers in config.json is 1e\\+06; at most 1000 are made"),
        ({"inner": {"num_experts": 1e300}}, "num_experts in config.json is 1e\\+300; at most 10000"),
        ({"vocab_size": 10**8}, "asks for [0-9]{10} weights, and the files have only [0-9]{5,6} bytes"),
        ({"hidden_size": 2**20}, "asks for [0-9]{9} weights"),
        ({"note": "a" * 1_000_000}, "config.json cannot be read: it has more than 1000000 bytes"),
    ],
)
def test_a_model_that_promises_more_than_it_holds_takes_no_memory(changes, why, tmp_path, monkeypatch):
    from transformers import AutoModelForCausalLM

    folder = with_config(make_model(tmp_path), **changes)
    monkeypatch.setattr(AutoModelForCausalLM, "from_pretrained", lambda *_, **__: pytest.fail("it takes the memory"))
    with pytest.raises(LLMError, match=f"cannot be loaded: .*{why}"):
        load_model(folder)


@pytest.mark.parametrize("name", ["tokenizer.json", "generation_config.json", "model.safetensors"])
def test_files_of_a_model_that_are_too_large_or_no_files_are_named(name, tmp_path):
    folder = make_model(tmp_path)
    with (folder / name).open("wb") as file:
        file.write(struct.pack("<Q", 2**29))  # the length of the header, where it is one of weights
        file.truncate(2**30)
    with pytest.raises(LLMError, match=f"{name} .*at most [0-9]+ are read"):
        load_model(folder)
    (folder / name).unlink()
    os.mkfifo(folder / name)
    with pytest.raises(LLMError, match=f"{name} .*is not a file"):
        load_model(folder)


@pytest.mark.parametrize(
    ("index", "why"),
    [
        ({"weight_map": {"a": "../model.safetensors"}}, "names a file outside its folder"),
        ({"weight_map": ["a"]}, "is not a list of weight files"),
        ({"weight_map": {"a": "gone.safetensors"}}, "gone.safetensors cannot be read"),
    ],
)
def test_an_index_of_weights_names_files_of_its_folder(index, why, tmp_path):
    folder = make_model(tmp_path)
    (folder / "model.safetensors").rename(folder / "part.safetensors")
    path = folder / "model.safetensors.index.json"
    names = load_names(folder / "part.safetensors")
    path.write_text(json.dumps({"metadata": {}, "weight_map": dict.fromkeys(names, "part.safetensors")}))
    load_model(folder)
    path.write_text(json.dumps({"metadata": {}} | index))
    with pytest.raises(LLMError, match=why):
        load_model(folder)


def load_names(path):
    with safe_open(path, "pt") as file:
        return list(file.keys())


def test_it_reads_the_slots_where_it_is_asked_for_and_the_network_the_goal(cache_with_model):
    reader = make_interpreter(ReadingOptions(parser="llm"), strict=True)
    read = reader.interpret("stack the cans on the left and put the cup behind them")
    assert read.status == "ok" and read.parse.parser == "llm" and not read.fallback
    assert str(read.goal) == "tower of cans, left; cup behind part 1"
