"""Cache what runs load: many instructions in one process load each network and each library once."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from pathlib import Path
from threading import RLock
from typing import TYPE_CHECKING

from agent.pipeline.instruction_parser import ReadingOptions, make_interpreter
from agent.recordings.recording import RecordedOptions

if TYPE_CHECKING:
    from agent.model_cards.provenance import Provenance
    from agent.scenes.sources import SceneSource
    from grounding.interpreter import Interpreter
    from grounding.parsers.sentence_encoder import SentenceEncoder
    from structdiffusion.planners.factory import Planner
    from structdiffusion.planners.goal_planner import GoalPlanner


class ResourceCache:
    """Loads on demand, and keeps what cannot change; a run ends the same with and without it. Threads may share it."""

    def __init__(self) -> None:
        self._lock = RLock()
        self._interpreters: dict[ReadingOptions, Interpreter] = {}
        self._planners: dict[tuple[str, Path | None, bool], Planner] = {}
        self._provenance: dict[tuple[str, Path | None], Mapping[str, Provenance]] = {}
        self._libraries: dict[str, SceneSource] = {}

    @cached_property
    def encoder(self) -> SentenceEncoder:
        """Return the sentence encoder, loaded on first use.

        Raises:
            EncoderError: if it cannot be loaded.
        """
        from grounding.parsers.sentence_encoder import SentenceEncoder

        return SentenceEncoder()

    def interpreter(self, options: ReadingOptions) -> Interpreter:
        """Return the interpreter for the options; one that had to fall back is not kept: the next run tries again."""
        with self._lock:
            interpreter = self._interpreters.get(options)
            if interpreter is None or interpreter.fallback:
                interpreter = self._interpreters[options] = make_interpreter(options, self.encoder)
            return interpreter

    def planner(self, model: str, weights: Path | None, allow_unverified: bool = False) -> Planner:
        """Return a planner, as `agent.pipeline.candidates.checked_planner` does."""
        from agent.model_cards.provenance import provenance_of
        from agent.pipeline.candidates import checked_planner

        key = (model, weights, allow_unverified)
        with self._lock:
            if key not in self._planners:
                self._planners[key] = checked_planner(model, weights, allow_unverified)
                self._provenance[model, weights] = provenance_of(model, weights)
            return self._planners[key]

    def goal_planner(self, model: str, weights: Path | None, allow_unverified: bool = False) -> GoalPlanner:
        """Return the planner of goals of several parts that composes the proposals of a planner."""
        from structdiffusion.planners.goal_planner import GoalPlanner

        return GoalPlanner(self.planner(model, weights, allow_unverified))

    def provenance(self, model: str, weights: Path | None) -> Mapping[str, Provenance]:
        """Return what is known of the files of a planner's networks, by network; the planner must have been loaded
        before."""
        return self._provenance[model, weights]

    def preload(
        self, reading: ReadingOptions, model: str, weights: Path | None, allow_unverified: bool = False
    ) -> None:
        """Load what these options will need, and try the parser once, whose first answer takes longer.

        Raises: as the parts do.
        """
        with self._lock:  # whoever needs them meanwhile waits, and does not load them twice
            self.interpreter(reading).parse("a circle")
            self.planner(model, weights, allow_unverified)

    def source(self, scene: str, objects: str, recorded: RecordedOptions = RecordedOptions()) -> SceneSource:
        """Return a scene source, as `agent.scenes.sources.scene_source`; files are read again, because they can be
        edited."""
        from agent.scenes.sources import SIMULATED, scene_source

        if scene != SIMULATED or recorded.given:
            return scene_source(scene, objects, recorded)
        with self._lock:
            if objects not in self._libraries:
                self._libraries[objects] = scene_source(scene, objects)
            return self._libraries[objects]
