"""Run the doctor's probes in a separate process; `agent.diagnostics.subprocess_worker` runs this file as a program.

Every probe uses one part of the tool as the tool itself does, and returns what it found or raises an error.
"""

from __future__ import annotations

import importlib
import json
import os
import re
import sys
import time
from collections.abc import Callable
from pathlib import Path

_LIBRARY = re.compile(r"(lib[\w.+-]+\.so[\w.]*): cannot open shared object")
_SENTENCE = "put the cups in a small circle on the left"
_ANSWER_SECONDS = 60.0  # a model that is loaded at its first question takes half a minute


class NotUsable(Exception):
    """A component that is present but does not work; the message gives the reason."""


def _import(name: str) -> str:
    importlib.import_module(name)
    return ""


def _physics(_: str) -> str:
    import pybullet

    urdf = Path(__file__).parents[1] / "arm" / "j2s7s300.urdf"
    client = pybullet.connect(pybullet.DIRECT)
    try:
        arm = pybullet.loadURDF(str(urdf), physicsClientId=client)
        pybullet.stepSimulation(physicsClientId=client)
        joints = pybullet.getNumJoints(arm, physicsClientId=client)
        pybullet.getCameraImage(16, 16, renderer=pybullet.ER_TINY_RENDERER, physicsClientId=client)
    finally:
        pybullet.disconnect(client)
    return f"the arm ({joints} joints) and the camera work without a screen"


def _objects(_: str) -> str:
    from structdiffusion.objects.ycb import ycb_objects

    return f"{len(ycb_objects())} YCB scans"


def _encoder(_: str) -> str:
    from grounding.parsers.sentence_encoder import SHA256, SentenceEncoder

    encoder = SentenceEncoder()
    if encoder.checksum != SHA256:
        raise NotUsable(f"{encoder.folder} has the SHA-256 {encoder.checksum[:12]}, expected {SHA256[:12]}")
    encoder.encode([_SENTENCE])
    return f"SHA-256 {encoder.checksum[:12]}, as it should be"


def _parser(_: str) -> str:
    from grounding.parsers.embedding import WEIGHTS, EmbeddingParser

    parse = EmbeddingParser.from_pretrained().parse(_SENTENCE)
    read = (parse.spec.shape, parse.spec.size, parse.spec.x_position) if parse.spec else None
    if read != ("circle", "small", "left"):
        raise NotUsable(f"the weights in {WEIGHTS} read {_SENTENCE!r} as {read}")
    return f"SHA-256 {_checksum(WEIGHTS / 'model.safetensors')}; reads {_SENTENCE!r}"


def _weights(place: str) -> str:
    import torch

    from structdiffusion.models.collision import CollisionDiscriminator
    from structdiffusion.models.diffusion import PoseDiffusion
    from structdiffusion.models.structure import StructureDiscriminator

    folder = Path(place)
    networks = {kind.kind: kind for kind in (PoseDiffusion, StructureDiscriminator, CollisionDiscriminator)}
    network = networks[folder.name].from_pretrained(folder)
    for name, value in network.state_dict().items():
        if not torch.isfinite(value).all():
            raise NotUsable(f"{folder}: {name!r} has values that are not finite")
    count = sum(parameter.numel() for parameter in network.parameters())
    return f"SHA-256 {_checksum(folder / 'model.safetensors')}; {count:,} parameters fit their config"


def _llm(_: str) -> str:
    from safetensors import safe_open

    from grounding.parsers.llm_local import ADAPTER, read_adapter
    from grounding.parsers.llm_model import DEFAULT_NAME, FILES, cache_folder, checksum, default_gguf

    folder = cache_folder() / f"{DEFAULT_NAME}-{checksum(default_gguf())[:16]}"
    if ADAPTER.is_file() and read_adapter(ADAPTER).model != folder.name:
        raise NotUsable(f"the adapter {ADAPTER} was not trained on {folder.name}")
    if not all((folder / name).is_file() for name in FILES):
        return f"{DEFAULT_NAME} is there; it will be converted at first use (half a minute, 270 MB)"
    for name in FILES[:2]:
        json.loads((folder / name).read_text(encoding="utf-8"))
    with safe_open(folder / "model.safetensors", "pt") as file:
        count = len(list(file.keys()))
    return f"{DEFAULT_NAME}, converted in {folder} ({count} tensors)"


def _keyless_endpoint(address: str) -> str:
    return _endpoint(address, send_key=False)


def _endpoint(address: str, send_key: bool = True) -> str:
    """Ask the language model for the goal of one sentence; `address` is its URL, and its name there after a blank."""
    from grounding.goals.goal import Goal
    from grounding.language_model.goal_model import GoalModel
    from grounding.parsers.llm_endpoint import EndpointLLM
    from grounding.parsers.llm_reply import LLMError

    url, _, name = address.partition(" ")
    try:
        endpoint = EndpointLLM(url, name or "default", answer_seconds=_ANSWER_SECONDS, send_key=send_key)
        model, started = GoalModel(endpoint), time.perf_counter()
        reply = model.read(_SENTENCE, ["cup", "cup 2", "cup 3", "plate"])
    except LLMError as error:
        raise NotUsable(str(error)) from None  # what caused it could hold the key
    seconds = time.perf_counter() - started
    part = {"kind": "structure", "shape": "circle", "size": "small", "x_position": "left", "objects": [0, 1, 2]}
    schema = "with the JSON schema" if model.takes_schema else "without the JSON schema, which it refuses"
    if reply.goal is None or reply.goal.canonical() != Goal.from_dict({"parts": [part]}):
        read = reply.goal or f"{reply.decision}: {reply.question or reply.reason}"
        raise NotUsable(f"{model.identity} answers {schema} in {seconds:.1f} s, but reads {_SENTENCE!r} as '{read}'")
    return f"{model.identity} reads {_SENTENCE!r} {schema} in {seconds:.1f} s"


def _gpu(_: str) -> str:
    import torch

    if torch.cuda.is_available():
        one = torch.ones(64, 64, device="cuda")
        if float((one @ one).sum()) != 64.0**3:
            raise NotUsable(f"{torch.cuda.get_device_name()} miscalculates")
        return f"{torch.cuda.get_device_name()}, CUDA {torch.version.cuda}"
    if Path("/proc/driver/nvidia/version").exists():
        raise NotUsable(f"there is an NVIDIA driver, and torch {torch.__version__} cannot use it")
    return "none; everything works on the processor"


def _checksum(path: Path) -> str:
    from hashlib import file_digest

    with path.open("rb") as file:
        return file_digest(file, "sha256").hexdigest()[:12]


PROBES: dict[str, Callable[[str], str]] = {
    "import": _import,
    "physics": _physics,
    "objects": _objects,
    "encoder": _encoder,
    "parser": _parser,
    "weights": _weights,
    "llm": _llm,
    "endpoint": _endpoint,
    "keyless-endpoint": _keyless_endpoint,
    "gpu": _gpu,
}


def _answer(task: str, poisoned: set[str]) -> dict[str, object]:
    name, _, rest = task.partition(" ")
    try:
        return {"works": True, "said": PROBES[name](rest)}
    except BaseException as error:  # a module may even end the process
        reason = error
        while reason.__cause__ is not None and not isinstance(reason, ImportError):
            reason = reason.__cause__
        library = _LIBRARY.search(str(reason))
        absent = str(reason.name or "").split(".")[0] if isinstance(reason, ModuleNotFoundError) else ""
        said = " ".join(str(error).split())[:300] or type(error).__name__
        if absent in poisoned:
            said = f"{absent}, which it needs, does not work"
        elif not isinstance(error, NotUsable) and type(error).__module__ == "builtins":
            said = f"{type(error).__name__}: {said}"
        return {"works": False, "said": said, "absent": library[1] if library else absent}


def main(poisoned: list[str]) -> None:
    """Answer the tasks on standard input, one per line; the output of libraries goes to standard error."""
    for name in poisoned:
        sys.modules[name] = None  # type: ignore[assignment]  # importing it now fails at once
    answers = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)
    for line in sys.stdin:
        print(json.dumps(_answer(line.rstrip("\n"), set(poisoned))), file=answers, flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
