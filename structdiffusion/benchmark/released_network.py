"""Time the released StructDiffusion network beside ours, as `structagent benchmark --reference` does.

The network comes from a checkout of the authors' repository (github.com/StructDiffusion/StructDiffusion), which is
imported and run as it is. It gets the clouds of the same scene, and as in the released sampler every step encodes all
clouds of all samples again. Its weights are not in the repository; the seconds do not depend on them, so that they stay
as they were drawn.
"""

from __future__ import annotations

import importlib
import statistics
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor

from structdiffusion.benchmark.growth import resampled
from structdiffusion.benchmark.latency import spec_of
from structdiffusion.observation import Scene, StructureGoal
from structdiffusion.planners.diffusion import DiffusionPlanner
from structdiffusion.planners.samples import encode_scene

SAMPLES = 10
RELEASED = "StructDiffusion, as released"
_MODEL, _SCHEDULE = "StructDiffusion.models.models", "StructDiffusion.diffusion.noise_schedule"
# What the released configs/conditional_pose_diffusion.yaml sets beside the defaults of the class, and its sizes: most
# objects, points of a cloud, and tokens of a sentence.
_SETTINGS = {"encoder_hidden_dim": 512, "encoder_dropout": 0.0, "ignore_rgb": True}
OBJECTS, _POINTS, _TOKENS = 7, 1024, 5
_WORDS = 100  # rows of the embedding of words; looking one up takes as long among any number


class ReleasedNetworkError(ValueError):
    """Raised if a folder is no checkout of the released network, or the network cannot be run here."""


@dataclass(frozen=True)
class SamplingTime:
    """The time that a network takes to sample arrangements of one scene.

    Attributes:
        model: the planner's name, or `RELEASED`.
        structure: the requested shape.
        objects, samples, denoising_steps: how many.
        threads: of PyTorch.
        runs: the number of measurements.
        seconds_per_step: the median of a denoising step of all samples.
        seconds_per_candidate: of a whole sample: all steps, and what happens once per scene, divided by the samples.
    """

    model: str
    structure: str
    objects: int
    samples: int
    denoising_steps: int
    threads: int
    runs: int
    seconds_per_step: float
    seconds_per_candidate: float

    def to_dict(self) -> dict[str, Any]:
        """Return the values for JSON."""
        return asdict(self)


class ReleasedNetwork:
    """The released pose network, with weights as they were drawn.

    Attributes:
        steps: its denoising steps.

    Args:
        checkout: the folder of the repository.

    Raises:
        ReleasedNetworkError: if the network is not there, or a package that it imports is not installed.
    """

    def __init__(self, checkout: Path) -> None:
        source = checkout / "src"
        if not (source / Path(*_MODEL.split("."))).with_suffix(".py").is_file():
            raise ReleasedNetworkError(
                f"--reference takes a checkout of the released StructDiffusion, but {str(checkout)!r} has no file "
                f"src/{_MODEL.replace('.', '/')}.py"
            )
        with _importable(source):
            try:
                network = importlib.import_module(_MODEL).TransformerDiffusionModel
                schedule = importlib.import_module(_SCHEDULE).NoiseSchedule
                with torch.random.fork_rng(devices=[]):
                    torch.manual_seed(0)
                    self._network = network(_WORDS, **_SETTINGS).eval()
                self._schedule = schedule()
            except ModuleNotFoundError as error:
                raise ReleasedNetworkError(
                    f"the released network in {str(checkout)!r} needs {error.name!r}, which is not installed"
                ) from error
            except (ImportError, AttributeError, TypeError) as error:
                raise ReleasedNetworkError(f"{str(checkout)!r} does not hold the released network: {error}") from error
        self.steps = int(self._schedule.timesteps)

    @torch.no_grad()
    def denoise(self, clouds: Tensor, state: Tensor, step: int, generator: torch.Generator) -> Tensor:
        """Do one denoising step of K samples, as the released sampler does.

        Args:
            clouds: (N, P, 3) world frame, metres.
            state: (K, 1 + N, 9) the noisy poses of the frame and the objects.
            step: from `steps` - 1 down to 0.
            generator: draws the noise.

        Returns:
            (K, 1 + N, 9).
        """
        samples, objects = len(state), len(clouds)
        kinds = torch.tensor([0] * _TOKENS + [2] + [3] * objects)
        places = torch.tensor([*range(_TOKENS), 0, *range(objects)])
        absent = torch.zeros(samples, len(kinds), dtype=torch.long)
        noise = self._network(
            torch.full((samples,), step), clouds.expand(samples, -1, -1, -1),
            torch.ones(samples, _TOKENS, dtype=torch.long), state, kinds.expand(samples, -1),
            places.expand(samples, -1), absent,
        )  # fmt: skip
        schedule = self._schedule
        share = schedule.betas[step] / schedule.sqrt_one_minus_alphas_cumprod[step]
        mean = schedule.sqrt_recip_alphas[step] * (state - share * noise)
        if step == 0:
            return mean
        return mean + schedule.posterior_variance[step].sqrt() * torch.randn(state.shape, generator=generator)


@contextmanager
def _importable(source: Path) -> Iterator[None]:
    """Let the package in a folder be imported, and forget its modules afterwards: another checkout has other ones."""
    sys.path.insert(0, str(source.resolve()))
    try:
        yield
    finally:
        sys.path.remove(str(source.resolve()))
        for name in [name for name in sys.modules if name.split(".")[0] == "StructDiffusion"]:
            del sys.modules[name]


def measure_sampling(
    released: ReleasedNetwork, planner: DiffusionPlanner, model: str, shape: str, scene: Scene, runs: int
) -> list[SamplingTime]:
    """Measure how long the released network and ours take to sample `SAMPLES` arrangements of a scene.

    Of the released network single steps are measured: a whole sample takes minutes, and all steps take as long.

    Args:
        released: the released network.
        planner: ours.
        model: its name.
        shape: the requested structure.
        scene: with at most `OBJECTS` objects.
        runs: measurements of each, after one that warms up.

    Raises:
        ReleasedNetworkError: if the scene has more objects than the released network can take, or it fails.
    """
    count = len(scene.objects)
    if count > OBJECTS:
        raise ReleasedNetworkError(f"the released network takes at most {OBJECTS} objects, not {count}")
    theirs = statistics.median(_released_steps(released, scene, runs))
    whole, step = (statistics.median(seconds) for seconds in zip(*_own_samples(planner, shape, scene, runs)))

    def row(name: str, steps: int, seconds_per_step: float, seconds: float) -> SamplingTime:
        threads = torch.get_num_threads()
        return SamplingTime(name, shape, count, SAMPLES, steps, threads, runs, seconds_per_step, seconds / SAMPLES)

    own_steps = len(planner.scheduler.timesteps)
    return [row(RELEASED, released.steps, theirs, theirs * released.steps), row(model, own_steps, step, whole)]


def _released_steps(released: ReleasedNetwork, scene: Scene, runs: int) -> list[float]:
    """Return the seconds of each of the first denoising steps but one, which warms up."""
    clouds = torch.from_numpy(np.stack([cloud.points for cloud in resampled(scene, _POINTS).objects]))
    generator = torch.Generator().manual_seed(0)
    state = torch.randn(SAMPLES, 1 + len(clouds), 9, generator=generator)
    seconds = []
    for number in range(runs + 1):
        started = time.perf_counter()
        try:
            state = released.denoise(clouds, state, max(0, released.steps - 1 - number), generator)
        except (RuntimeError, TypeError, IndexError) as error:
            raise ReleasedNetworkError(f"the released network cannot be run here: {error}") from error
        seconds.append(time.perf_counter() - started)
    return seconds[1:]


@torch.no_grad()
def _own_samples(planner: DiffusionPlanner, shape: str, scene: Scene, runs: int) -> Iterator[tuple[float, float]]:
    """Yield the seconds of each sampling, with the clouds' encoding, and of one of its steps; the first warms up."""
    goal = StructureGoal(spec_of(shape), "a sentence", np.full(384, 384**-0.5, dtype=np.float32))
    for number in range(runs + 1):
        generator = torch.Generator().manual_seed(number)
        started = time.perf_counter()
        seen = encode_scene(scene, goal, planner.model, planner.sentence, generator)
        encoded = time.perf_counter()
        planner.sample(seen, goal, SAMPLES, generator)
        ended = time.perf_counter()
        if number:
            yield ended - started, (ended - encoded) / len(planner.scheduler.timesteps)
