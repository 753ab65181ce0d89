"""Cache what runs load: many instructions in one process load each network and each library once."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from pathlib import Path
from threading import RLock
from typing import TYPE_CHECKING, Any

from agent.pipeline.instruction_parser import ReadingOptions, make_interpreter
from agent.recordings.recording import RecordedOptions

if TYPE_CHECKING:
    from agent.model_cards.provenance import Provenance
    from agent.runtime.output_ownership import OwnFolder
    from agent.scenes.sources import SceneSource
    from grounding.interpreter import Interpreter
    from grounding.parsers.sentence_encoder import SentenceEncoder
    from structdiffusion.planners.factory import Planner
    from structdiffusion.planners.goal_planner import GoalPlanner


class ResourceCache:
    """Loads on demand, and keeps what cannot change; a run ends the same with and without it. Threads may share it.

    Attributes:
        pictures: where pictures are written that questions about a recording need; `None` for the temporary folder.
    """

    def __init__(self, pictures: OwnFolder | None = None) -> None:
        self.pictures = pictures
        self._lock = RLock()
        self._interpreters: dict[ReadingOptions, Interpreter] = {}
        self._planners: dict[tuple[str, Path | None, bool], Planner] = {}
        self._provenance: dict[tuple[str, Path | None], Mapping[str, Provenance]] = {}
        self._libraries: dict[tuple[str, Path | None], SceneSource] = {}

    @cached_property
    def encoder(self) -> SentenceEncoder:
        """Return the sentence encoder, loaded on first use.

        Raises:
            EncoderError: if it cannot be loaded.
        """
        from grounding.parsers.sentence_encoder import SentenceEncoder

        return SentenceEncoder()

    def interpreter(self, options: ReadingOptions) -> Interpreter:
        """Return the interpreter for the options."""
        with self._lock:
            interpreter = self._interpreters.get(options)
            if interpreter is None:
                if options.parser != "embedding":
                    _use_one_thread()
                interpreter = self._interpreters[options] = make_interpreter(options, self.encoder)
            return interpreter

    def check_planner(self, model: str, weights: Path | None, allow_unverified: bool = False) -> None:
        """Check a planner and keep its provenance, as `agent.pipeline.candidates.check_planner`; do not load it."""
        from agent.pipeline.candidates import check_planner

        with self._lock:
            if (model, weights, allow_unverified) not in self._planners:
                self._provenance[model, weights] = check_planner(model, weights, allow_unverified)

    def planner(self, model: str, weights: Path | None, allow_unverified: bool = False) -> Planner:
        """Return a planner, as `agent.pipeline.candidates.checked_planner` does."""
        key = (model, weights, allow_unverified)
        with self._lock:
            if key not in self._planners:
                self.check_planner(model, weights, allow_unverified)
                from structdiffusion.planners.factory import load_planner

                _use_one_thread()
                self._planners[key] = load_planner(model, weights)
            return self._planners[key]

    def goal_planner(self, model: str, weights: Path | None, allow_unverified: bool = False) -> GoalPlanner:
        """Return the planner of goals of several parts that composes the proposals of a planner."""
        from agent.pipeline.proposing import make_goal
        from structdiffusion.planners.goal_planner import GoalPlanner

        return GoalPlanner(self.planner(model, weights, allow_unverified), lambda spec: make_goal(spec, self.encoder))

    def provenance(self, model: str, weights: Path | None) -> Mapping[str, Provenance]:
        """Return what is known of the files of a planner's networks, by network; the planner must have been checked
        before."""
        return self._provenance[model, weights]

    def preload(
        self, reading: ReadingOptions, model: str, weights: Path | None, allow_unverified: bool = False
    ) -> None:
        """Load what these options will need, and try the parser once, whose first answer takes longer.

        Whoever needs one of them meanwhile waits for it, and for it alone: a sentence is read before the planner is
        there.

        Raises: as the parts do.
        """
        with self._lock:
            self.interpreter(reading).interpret("a circle")
        self.planner(model, weights, allow_unverified)

    def source(
        self, scene: str, objects: str, recorded: RecordedOptions = RecordedOptions(), arm: Path | None = None
    ) -> SceneSource:
        """Return a scene source, as `agent.scenes.sources.scene_source`; files are read again, because they can be
        edited."""
        from agent.scenes.sources import SIMULATED, scene_source

        if scene != SIMULATED or recorded.given:
            source: Any = scene_source(scene, objects, recorded, arm)
            if hasattr(source, "pictures"):
                source.pictures = self.pictures
            return source
        with self._lock:
            if (objects, arm) not in self._libraries:
                self._libraries[objects, arm] = scene_source(scene, objects, arm=arm)
            return self._libraries[objects, arm]


def _use_one_thread() -> None:
    """Let torch compute in one thread: the tensors are too small to share, and threads would wait for each other."""
    import torch

    torch.set_num_threads(1)
