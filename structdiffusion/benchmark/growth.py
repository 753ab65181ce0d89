"""Measure how the seconds and the memory of a decision grow with its sizes, as `structagent benchmark --sweep` does.

Sizes are the candidates, the objects, the points of each cloud, and the instructions that are read in one batch: in
this process, in worker processes, and on a Ray cluster. The exponent of a growth is the slope of CPU seconds over size,
both logarithmic, over the larger half of the sizes.
"""

from __future__ import annotations

import itertools
import json
import math
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np

from grounding.corpus.grammar import sentences
from grounding.goal_network.writer import NetworkWriter
from grounding.interpreter import Interpreter
from grounding.parsers.embedding import EmbeddingParser
from grounding.parsers.sentence_encoder import SentenceEncoder
from grounding.propose.network import NetworkProposer
from grounding.spec import FIRST_SHAPES
from grounding.verify.verifier import Verifier
from structdiffusion.benchmark.latency import loaded, measure, observed_scenes
from structdiffusion.data.scene_sampling import full_spec
from structdiffusion.observation import ObjectCloud, Scene
from structdiffusion.parallel import Lost, check_complete, in_parallel
from structdiffusion.planners.factory import Planner

CANDIDATES, OBJECTS = (1, 4, 16, 64, 256, 1024), (2, 3, 4, 6, 8, 10, 12)
POINTS, INSTRUCTIONS = (64, 256, 1024, 4096, 16384, 65536), (10, 50, 200, 1000, 2000)
USUAL_CANDIDATES, USUAL_OBJECTS = 64, 7
# Instructions that a worker reads at once: of 2,000 every worker gets several portions, and handing one over costs
# little beside reading it.
_PORTION = 50
_ROW = "line"  # the structure whose objects are varied: two make one, and no number is too many
_NOISE = 0.0005  # m, of the points that are drawn where the camera saw fewer
_STATUS, _RESET = Path("/proc/self/status"), Path("/proc/self/clear_refs")


@dataclass(frozen=True)
class Growth:
    """The cost over one size.

    Attributes:
        size: what is varied, such as "candidates".
        held: what is held, in words.
        sizes: ascending.
        seconds: the median of the runs at each size.
        cpu_seconds: the same of CPU seconds.
        megabytes: by how much the memory in use rose at most while it ran; `None` where that cannot be measured.
        exponent: of the CPU seconds over the larger half of the sizes; `None` for fewer than two sizes.
    """

    size: str
    held: str
    sizes: tuple[int, ...]
    seconds: tuple[float, ...]
    cpu_seconds: tuple[float, ...]
    megabytes: tuple[float | None, ...]
    exponent: float | None


def measure_growth(
    model: str,
    runs: int,
    largest: int | None = None,
    weights: Path | None = None,
    processes: int = 2,
    ray_workers: int | None = None,
) -> list[Growth]:
    """Measure all growths.

    Args:
        model: the planner.
        runs: decisions at each size, after one that warms up; a batch of instructions is read once.
        largest: sizes above it are left out; `None` measures all.
        weights: as for `load_planner`.
        processes: the worker processes that read a batch.
        ray_workers: the workers of the Ray cluster that this process is connected to; `None` where there is none.
    """
    planner = loaded(model, weights)

    def kept(sizes: Sequence[int]) -> list[int]:
        return [size for size in sizes if largest is None or size <= largest]

    usual = observed_scenes("circle", min(USUAL_OBJECTS, largest or USUAL_OBJECTS), runs + 1)
    candidates = min(USUAL_CANDIDATES, largest or USUAL_CANDIDATES)
    some = f"a circle of {len(usual[0].objects)} objects"
    texts = different_instructions(max(kept(INSTRUCTIONS), default=0))
    batches = {"one process": read_here(texts), f"{processes} processes": read_by_workers(texts, processes)}
    if ray_workers is not None:
        batches[f"{ray_workers} workers of Ray"] = read_by_workers(texts, ray_workers, ray=True)
    grown = [
        _growth("candidates", some, kept(CANDIDATES), lambda size: _decided(planner, "circle", usual, size)),
        _growth(
            "objects", f"a {_ROW}, {candidates} candidates", kept(OBJECTS),
            lambda size: _decided(planner, _ROW, observed_scenes(_ROW, size, runs + 1), candidates),
        ),
        _growth(
            "points per cloud", f"{some}, {candidates} candidates", kept(POINTS),
            lambda size: _decided(planner, "circle", [resampled(scene, size) for scene in usual], candidates),
        ),
        *(_growth("instructions", f"one batch, {who}", kept(INSTRUCTIONS), cost) for who, cost in batches.items()),
    ]  # fmt: skip
    return [growth for growth in grown if growth.sizes]


Cost = tuple[float, float, "float | None"]


def _growth(size: str, held: str, sizes: Sequence[int], cost: Callable[[int], Cost]) -> Growth:
    seconds, cpu, megabytes = zip(*map(cost, sizes)) if sizes else ((), (), ())
    return Growth(size, held, tuple(sizes), seconds, cpu, megabytes, fitted_exponent(sizes, cpu))


def fitted_exponent(sizes: Sequence[int], costs: Sequence[float]) -> float | None:
    """Return p of the best fit costs ~ sizes**p over the larger half of the sizes, at least two of them."""
    half = max(2, math.ceil(len(sizes) / 2))
    if len(sizes) < 2:
        return None
    return float(np.polyfit(np.log(sizes[-half:]), np.log(costs[-half:]), 1)[0])


def _decided(planner: Planner, shape: str, scenes: Sequence[Scene], candidates: int) -> Cost:
    before = _reset_peak()
    row = measure(planner, shape, scenes, candidates)
    return row["seconds_median"], row["cpu_seconds_median"], _risen(before)


def different_instructions(count: int) -> list[str]:
    """Return so many different instructions of the four first shapes, with every slot."""
    rng = np.random.default_rng(0)
    texts: dict[str, None] = {}
    shapes = itertools.cycle(FIRST_SHAPES)
    while len(texts) < count:
        options = sentences(full_spec(next(shapes), rng))
        texts[options[int(rng.integers(len(options)))]] = None
    return list(texts)


def read_here(texts: Sequence[str]) -> Callable[[int], Cost]:
    """Return what reads the first so many instructions in this process, with a parser that is loaded once before."""
    interpreters: list[Interpreter] = []

    def read(size: int) -> Cost:
        if not interpreters:
            interpreters.append(_interpreter())
        before, started = _reset_peak(), time.perf_counter()
        worked = _read(interpreters[0], texts[:size])
        return time.perf_counter() - started, worked, _risen(before)

    return read


def read_by_workers(texts: Sequence[str], workers: int, ray: bool = False) -> Callable[[int], Cost]:
    """Return what reads the first so many instructions in workers that start with the batch; each loads a parser once.

    The CPU seconds are those of all workers for reading; the seconds include their start. The memory is not measured.
    """

    def read(size: int) -> Cost:
        started = time.perf_counter()
        portions = [texts[first : min(first + _PORTION, size)] for first in range(0, size, _PORTION)]
        worked = list(in_parallel(_read, _interpreter, (), portions, workers, ray=ray))
        check_complete([one for one in worked if isinstance(one, Lost)], len(portions), "portions of instructions")
        return time.perf_counter() - started, sum(worked), None

    return read


def _interpreter() -> Interpreter:
    """Load an interpreter, and let it read once: the first reading takes longer."""
    encoder = SentenceEncoder()
    interpreter = Interpreter(
        lambda: EmbeddingParser.from_pretrained(encoder=encoder), encoder,
        NetworkProposer(lambda: NetworkWriter.from_pretrained(encoder)), lambda: Verifier.from_pretrained(encoder),
    )  # fmt: skip
    interpreter.interpret_many(["put the cups in a circle"])
    return interpreter


def _read(interpreter: Interpreter, texts: Sequence[str]) -> float:
    """Read instructions; return the CPU seconds."""
    worked = time.process_time()
    interpreter.interpret_many(texts)
    return time.process_time() - worked


def resampled(scene: Scene, points: int) -> Scene:
    """Return the scene with so many points in every cloud; where the camera saw fewer, noisy copies of them."""
    rng = np.random.default_rng(0)

    def cloud(seen: ObjectCloud) -> ObjectCloud:
        seen_points, own = len(seen.points), rng.permutation(len(seen.points))
        chosen = seen.points[own[np.arange(points) % seen_points]]
        noise = rng.normal(0.0, _NOISE, chosen.shape) * (np.arange(points) >= seen_points)[:, None]
        return replace(seen, points=(chosen + noise).astype(np.float32), colors=None)

    return replace(scene, objects=tuple(map(cloud, scene.objects)), distractors=tuple(map(cloud, scene.distractors)))


def _reset_peak() -> float | None:
    """Forget the highest memory so far, and return the memory in use, MB; `None` where the system does not tell."""
    try:
        _RESET.write_text("5")
    except OSError:
        return None
    return _memory("VmRSS")


def _risen(before: float | None) -> float | None:
    return None if before is None else round(max(0.0, _memory("VmHWM") - before), 1)


def _memory(key: str) -> float:
    line = next(line for line in _STATUS.read_text().splitlines() if line.startswith(f"{key}:"))
    return int(line.split()[1]) / 1024


def growth_json(grown: Sequence[Growth]) -> str:
    """Return the growths as JSON."""
    return json.dumps([asdict(growth) for growth in grown], indent=1) + "\n"


def plot(grown: Sequence[Growth], path: Path) -> None:
    """Plot seconds and memory over each size, with the fitted exponents, and write the picture.

    Growths of the same size share their panels.
    """
    from matplotlib.figure import Figure

    sizes = list(dict.fromkeys(growth.size for growth in grown))
    figure = Figure(figsize=(3.8 * len(sizes), 5.8), layout="constrained")
    panels = figure.subplots(2, len(sizes), sharex="col", squeeze=False)
    for size, (above, below) in zip(sizes, panels.T, strict=True):
        shared = [growth for growth in grown if growth.size == size]
        for growth in shared:
            slope = "" if growth.exponent is None else f", exponent {growth.exponent:.2f}"
            (line,) = above.loglog(growth.sizes, growth.seconds, "o-", label=f"{growth.held}: seconds")
            color = line.get_color()
            above.loglog(growth.sizes, growth.cpu_seconds, "s--", color=color, label=f"CPU seconds{slope}")
            if None not in growth.megabytes:
                below.semilogx(growth.sizes, growth.megabytes, "o-", color=color)
        above.set_title(size, fontsize=10)
        above.grid(alpha=0.3, which="both")
        above.legend(fontsize=7)
        below.set_xlabel(size)
        below.set_xticks(shared[0].sizes, [str(value) for value in shared[0].sizes], fontsize=7, rotation=45)
        below.minorticks_off()
        below.grid(alpha=0.3)
    panels[0][0].set_ylabel("seconds")
    panels[1][0].set_ylabel("memory, MB more than before")
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=110)
