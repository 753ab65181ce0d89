"""Group the options that several commands share: a command takes each group as one object."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, fields, is_dataclass
from typing import TYPE_CHECKING, Any, get_type_hints

import typer

from agent.cli.config import reading_options
from agent.cli.options import (
    ArmOption,
    AtOption,
    CallOption,
    CameraPoseOption,
    DepthUnitOption,
    Hold,
    HoldOption,
    LLMModelOption,
    LLMUrlOption,
    ModelOption,
    ObjectsOption,
    ParserOption,
    Parsers,
    SceneOption,
    SeedOption,
    TopicOption,
    UnverifiedOption,
    Viewpoint,
    ViewpointOption,
    WeightsOption,
    arm_file,
    recorded_options,
)

if TYPE_CHECKING:
    from agent.pipeline.instruction_parser import ReadingOptions
    from agent.pipeline.run import RunOptions
    from agent.recordings.recording import RecordedOptions


def with_arguments(command: Callable[..., None]) -> Callable[..., None]:
    """Return a command whose parameters that are dataclasses are replaced by options, one for each of their fields.

    Args:
        command: a function with annotations as typer reads them, except for these parameters.
    """
    hints = get_type_hints(command, include_extras=True)
    parameters = inspect.signature(command).parameters

    def called(**given: Any) -> None:
        command(
            **{name: _gathered(hints[name], given) if is_dataclass(hints[name]) else given[name] for name in parameters}
        )

    options = [
        option
        for parameter in parameters.values()
        for option in _options(parameter.replace(annotation=hints[parameter.name]))
    ]
    called.__signature__ = inspect.Signature(options)  # type: ignore[attr-defined]  # typer reads it
    called.__annotations__ = {option.name: option.annotation for option in options}
    called.__name__, called.__module__, called.__doc__ = command.__name__, command.__module__, command.__doc__
    return called


def _options(parameter: inspect.Parameter) -> Iterator[inspect.Parameter]:
    """Yield a parameter of a command, or one for every field of a group."""
    if not is_dataclass(parameter.annotation):
        yield parameter.replace(kind=inspect.Parameter.KEYWORD_ONLY)
        return
    hints = get_type_hints(parameter.annotation, include_extras=True)
    for field in fields(parameter.annotation):
        option = inspect.Parameter(field.name, inspect.Parameter.KEYWORD_ONLY, default=field.default)
        yield from _options(option.replace(annotation=hints[field.name]))


def _gathered(group: Any, given: Mapping[str, Any]) -> Any:
    """Return a group with the given values of its fields."""
    hints = get_type_hints(group)
    inner = {name: _gathered(kind, given) if is_dataclass(kind) else given[name] for name, kind in hints.items()}
    return group(**inner)


@dataclass(frozen=True)
class ReadingArguments:
    """How instructions are read."""

    parser: ParserOption = Parsers.embedding
    viewpoint: ViewpointOption = Viewpoint.robot
    llm_model: LLMModelOption = None
    llm_url: LLMUrlOption = None

    def options(self, ctx: typer.Context) -> ReadingOptions:
        """Return the same for the parsers."""
        return reading_options(ctx, self.parser.value, self.viewpoint.value, self.llm_model, self.llm_url)


@dataclass(frozen=True, kw_only=True)
class RunArguments:
    """What a command needs that plans or builds on one table."""

    scene: SceneOption = "simulated"
    objects: ObjectsOption = "ycb"
    model: ModelOption = "diffusion"
    weights: WeightsOption = None
    seed: SeedOption = 0
    reading: ReadingArguments
    at: AtOption = None
    topic: TopicOption = None
    camera_pose: CameraPoseOption = None
    depth_unit: DepthUnitOption = None
    call: CallOption = None
    allow_unverified: UnverifiedOption = False
    hold: HoldOption = Hold.friction
    arm: ArmOption = None

    def recorded(self) -> RecordedOptions:
        """Return how a recording is taken.

        Raises:
            UsageError: for an illegal value.
        """
        return recorded_options(self.at, self.topic, self.camera_pose, self.call, self.depth_unit)

    def options(self, ctx: typer.Context, **more: Any) -> RunOptions:
        """Return the options of a run.

        Args:
            ctx: the command's context.
            more: other options of it by name.

        Raises:
            UsageError: for an illegal value.
        """
        recorded, reading, arm = self.recorded(), self.reading.options(ctx), arm_file(self.arm)
        from agent.pipeline.run import RunOptions  # takes a second, and a wrong option is told before

        return RunOptions(
            self.scene, self.objects, self.model, self.weights, self.seed, reading=reading, recorded=recorded,
            allow_unverified=self.allow_unverified, hold=self.hold.value, arm=arm, **more,
        )  # fmt: skip
