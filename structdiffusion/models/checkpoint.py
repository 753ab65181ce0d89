"""Checkpoints: a folder with `config.json` and `model.safetensors`, the same for every model."""

from __future__ import annotations

import hashlib
import json
import math
from dataclasses import asdict, fields, replace
from pathlib import Path
from typing import Any, Self, TypeVar

import torch
from safetensors import SafetensorError
from safetensors.torch import load_file, save
from torch import Tensor, nn
from torch.overrides import TorchFunctionMode

from grounding.atomic_files import write_all_whole
from grounding.untrusted_files import check_weights, read_json
from structdiffusion.limits import CONFIG_BYTES, CONFIG_LAYERS, CONFIG_NUMBER, PARAMETERS, WEIGHTS_BYTES
from structdiffusion.models.config_values import checked_values
from structdiffusion.word_tokens import FIRST_VOCABULARY

CONFIG_NAME = "config.json"
# Keys that older configs lack, with the value that applies to them: the shapes that every network knows.
ADDED_KEYS: dict[str, Any] = {"vocabulary": FIRST_VOCABULARY}
WEIGHTS_NAME = "model.safetensors"
_WORD_EMBEDDINGS = "word.weight"  # (vocabulary, width)
_NUMBERS = (torch.float16, torch.bfloat16, torch.float32, torch.float64)  # legal types of stored weights


Network = TypeVar("Network", bound="Checkpointed")


class CheckpointError(ValueError):
    """A checkpoint that cannot be used; the message names the file and the problem."""


class Checkpointed(nn.Module):
    """A network whose class has a frozen `Config` dataclass and a `kind`, and whose constructor takes the config.

    Each network can be tested without data: `fake_input(batch, objects, generator)` returns an input, documented with
        its
    keys, types, shapes and frames; `try_out(given, generator)` passes it through the network and returns a tensor of
    the shape `answer_shape(given)`.
    """

    kind: str
    Config: type
    config: Any  # of the type `Config`

    def save_pretrained(self, folder: str | Path) -> None:
        """Write config and weights (half precision) to a folder, which is created."""
        folder = Path(folder)
        config = {"kind": self.kind, **asdict(self.config)}
        weights = {name: tensor.detach().half().contiguous().cpu() for name, tensor in self.state_dict().items()}
        write_all_whole(folder, {CONFIG_NAME: json.dumps(config, indent=2) + "\n", WEIGHTS_NAME: save(weights)})

    @classmethod
    def from_pretrained(cls, folder: str | Path) -> Self:
        """Load the network of a checkpoint folder, on the CPU, ready for inference.

        Raises:
            CheckpointError: for a missing file, another model's config, or weights of a wrong shape or not finite.
        """
        folder = Path(folder)
        for name in (CONFIG_NAME, WEIGHTS_NAME):
            if not (folder / name).is_file():
                raise CheckpointError(f"checkpoint {folder} has no {name}; it needs {CONFIG_NAME} and {WEIGHTS_NAME}")
        try:
            check_weights(folder / WEIGHTS_NAME, WEIGHTS_BYTES)
        except (ValueError, OSError) as error:
            raise CheckpointError(f"{folder / WEIGHTS_NAME} cannot be read: {_shortened(str(error), 160)}") from error
        try:
            values = read_json(folder / CONFIG_NAME, CONFIG_BYTES)
            kind = values.pop("kind", None)
            known = {field.name for field in fields(cls.Config)}
        except (OSError, ValueError, AttributeError, TypeError) as error:
            reason = _shortened(str(getattr(error, "strerror", None) or error), 160)
            raise CheckpointError(f"{folder / CONFIG_NAME} is not a JSON object: {reason}") from error
        if kind != cls.kind:
            raise CheckpointError(f"{folder / CONFIG_NAME} is of kind {kind!r}; expected {cls.kind!r}")
        unknown = sorted(set(values) - known)
        if unknown:
            listed = ", ".join(sorted(known))
            raise CheckpointError(f"{folder / CONFIG_NAME} has the unknown key {unknown[0]!r}; legal: {listed}")
        values = {key: value for key, value in ADDED_KEYS.items() if key in known} | values
        try:
            legal = checked_values(cls.Config, values)
            _check_config_size(cls, folder / CONFIG_NAME, legal)
            model = cls(cls.Config(**legal))
        except CheckpointError:
            raise
        except (TypeError, ValueError, RuntimeError, AssertionError, OverflowError) as error:
            raise CheckpointError(f"{folder / CONFIG_NAME} does not describe a network: {error}") from error
        try:
            weights = load_file(folder / WEIGHTS_NAME)
        except (SafetensorError, OSError) as error:
            raise CheckpointError(f"{folder / WEIGHTS_NAME} cannot be read: {error}") from error
        own = model.state_dict()
        for name, tensor in own.items():
            if name not in weights:
                raise CheckpointError(f"{folder / WEIGHTS_NAME} lacks {name!r}, which its config asks for")
            if weights[name].shape != tensor.shape:
                raise CheckpointError(
                    f"{folder / WEIGHTS_NAME}: {name!r} has shape {tuple(weights[name].shape)}, "
                    f"its config asks for {tuple(tensor.shape)}"
                )
            if weights[name].dtype not in (*_NUMBERS, tensor.dtype):
                kinds = ", ".join(str(kind).removeprefix("torch.") for kind in _NUMBERS)
                kind = str(weights[name].dtype).removeprefix("torch.")
                raise CheckpointError(f"{folder / WEIGHTS_NAME}: {name!r} has the type {kind}; legal: {kinds}")
            weights[name] = weights[name].to(tensor.dtype)  # a large number may become infinite in it
            if not bool(weights[name].isfinite().all()):
                raise CheckpointError(f"{folder / WEIGHTS_NAME}: {name!r} has numbers that are not finite")
        unknown = sorted(weights.keys() - own.keys())
        if unknown:
            raise CheckpointError(f"{folder / WEIGHTS_NAME} has {unknown[0]!r}, which its config does not ask for")
        model.load_state_dict({name: weights[name] for name in own})
        return model.eval()


def grown(kind: type[Network], folder: str | Path, vocabulary: int) -> Network:
    """Load the network of a checkpoint folder for further training, with at least so many word ids.

    Word ids of a smaller vocabulary are the first of a larger one, so that old words keep their embeddings; those of
    new words are random.

    Raises:
        CheckpointError: for a checkpoint that cannot be read.
    """
    trained = kind.from_pretrained(folder)
    known = getattr(trained.config, "vocabulary", vocabulary)
    if known >= vocabulary:
        return trained
    network = kind(replace(trained.config, vocabulary=vocabulary))
    weights = trained.state_dict()
    weights[_WORD_EMBEDDINGS] = torch.cat((weights[_WORD_EMBEDDINGS], network.state_dict()[_WORD_EMBEDDINGS][known:]))
    network.load_state_dict(weights)
    return network


class _WithoutInitialValues(TorchFunctionMode):
    """Leave new tensors unchanged: for initial values on the meta device torch would import its compiler (1 s)."""

    def __torch_function__(self, func: Any, types: Any, args: tuple[Any, ...] = (), kwargs: Any = None) -> Any:
        kwargs = kwargs or {}
        if getattr(func, "__module__", "") == "torch.nn.init":
            return args[0] if args else kwargs["tensor"]
        return func(*args, **kwargs)


def _check_config_size(kind: type[Checkpointed], path: Path, values: dict[str, Any]) -> None:
    """Refuse a config whose network would be too large, before allocating memory for it."""
    for key, value in values.items():
        most = CONFIG_LAYERS if key.endswith("layers") else CONFIG_NUMBER
        for number in value if isinstance(value, tuple) else [value]:
            if isinstance(number, (int, float)) and not -most <= number <= most:
                raise CheckpointError(f"{path} has {key} {_shortened(repr(value))}; a network may have at most {most}")
    try:
        config = kind.Config(**values)  # not below: its arithmetic on the meta device would import torch's compiler
        with torch.device("meta"), _WithoutInitialValues():  # shapes without numbers
            outline = kind(config)
    except Exception as error:
        raise CheckpointError(f"{path} does not describe a network: {_shortened(str(error), 160)}") from error
    if (count := sum(tensor.numel() for tensor in outline.state_dict().values())) > PARAMETERS:
        raise CheckpointError(f"{path} describes a network of {count} numbers; it may have at most {PARAMETERS}")


def _shortened(text: str, most: int = 40) -> str:
    return text if len(text) <= most else f"{text[: most - 3]}..."


def file_facts(folder: str | Path) -> dict[str, dict[str, Any]]:
    """Return the size and checksum of both files of a checkpoint: name -> "bytes" and "sha256"."""
    contents = {name: (Path(folder) / name).read_bytes() for name in (CONFIG_NAME, WEIGHTS_NAME)}
    return {
        name: {"bytes": len(content), "sha256": hashlib.sha256(content).hexdigest()}
        for name, content in contents.items()
    }


def require_sound(values: Tensor, network: str, farthest: float = math.inf) -> None:
    """Refuse network outputs that only untrained or damaged weights, or a wrong config, can produce.

    Args:
        values: the output of the network.
        network: its name.
        farthest: the largest plausible absolute value.

    Raises:
        CheckpointError: for numbers that are not finite, or too large.
    """
    if not bool(values.isfinite().all()) or bool((values.abs() > farthest).any()):
        raise CheckpointError(
            f"the network {network!r} gives numbers that are not finite or far too large: its weights or its "
            "config must be wrong"
        )


def parameter_count(model: nn.Module) -> int:
    """Return the number of trainable parameters of a network."""
    return sum(parameter.numel() for parameter in model.parameters())


def default_device() -> torch.device:
    """Return CUDA if it is available, else the CPU."""
    return torch.device("cuda" if torch.cuda.is_available() else "cpu")
