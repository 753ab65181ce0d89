"""Train models; each command of the group `structagent train` is one model."""

from __future__ import annotations

from dataclasses import replace
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any

import typer

from agent.cli.options import SeedOption
from agent.runtime.output_paths import check_file, check_folder
from agent.training.parsers import (
    CORRECTIONS,
    DROPOUT,
    GOAL_LEARNING_RATE,
    GOAL_STEPS,
    LLM_LEARNING_RATE,
    LLM_STEPS,
    PARSER_SENTENCES,
    VERIFIER_LEARNING_RATE,
    VERIFIER_STEPS,
)
from agent.training.recipes import RECIPES, SEGMENTATION, SEGMENTATION_VIEWS, STROKES, TITLES, Recipe

train_app = typer.Typer(rich_markup_mode=None)

ThreadsOption = Annotated[
    int, typer.Option(metavar="N", min=1, help="Threads of PyTorch; only a run with 1 can be repeated exactly.")
]


RunFolderOption = Annotated[
    Path, typer.Option(metavar="DIR", help="Folder for the checkpoint, the training state, log.csv, training.json.")
]
StepsOption = Annotated[int, typer.Option(metavar="N", min=1, help="Optimiser steps in total, earlier runs included.")]
DeviceOption = Annotated[str, typer.Option(metavar="auto|cpu|cuda", help="Device to train on.")]
RateOption = Annotated[float, typer.Option(metavar="X", min=0.0, help="Peak learning rate.")]


class Precision(StrEnum):
    """The number format of a network's computations during training."""

    float32 = "float32"
    bfloat16 = "bfloat16"


@train_app.callback()
def _train() -> None:
    """Train a pose generator, a discriminator, a network of language or the segmentation network.

    Generators and discriminators are trained on the data of `structagent generate`; the same command resumes a run that
    was stopped. Networks of language are trained on included sentences, the segmentation network on synthetic tables.

    Example: structagent train diffusion --data data/train --out runs/diffusion
    """


def _train_network(
    ctx: typer.Context,
    data: Annotated[Path, typer.Option(metavar="DIR", help="Training data, written by `structagent generate`.")],
    out: RunFolderOption,
    steps: Annotated[
        int | None,
        typer.Option(metavar="N", min=1, help="Optimiser steps in total, earlier runs included; by default as above."),
    ] = None,
    device: DeviceOption = "auto",
    devices: Annotated[
        int,
        typer.Option(
            metavar="N", min=1, help="Number of GPUs, or CPU cores, that train together, each on its own batches."
        ),
    ] = 1,
    precision: Annotated[
        Precision,
        typer.Option(
            metavar="float32|bfloat16",
            help="Precision of the transformer of a pose generator; the weights stay float32.",
        ),
    ] = Precision.float32,
    seed: SeedOption = 0,
    learning_rate: Annotated[
        float | None, typer.Option(metavar="X", min=0.0, help="Peak learning rate; by default as above.")
    ] = None,
    batch: Annotated[
        int | None,
        typer.Option(metavar="N", min=3, help="Scenes, or pairs, per step and device; by default as above."),
    ] = None,
    start: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Checkpoint to start from, which may know fewer shapes; by default none."),
    ] = None,
) -> None:
    check_folder(out)
    from agent.training.train import TrainingRun, train_model

    kind = ctx.command.name
    assert kind is not None
    given: dict[str, Any] = {"steps": steps, "learning_rate": learning_rate, "batch": batch}
    recipe = replace(RECIPES[kind], **{name: value for name, value in given.items() if value is not None})
    train_model(TrainingRun(kind, data, out, recipe, device, devices, precision.value, seed, start))


def _network_help(kind: str) -> str:
    recipe = RECIPES[kind]
    unit = "pairs" if kind == "collision" else "scenes"
    return (
        f"Train {TITLES[kind]}.\n\n"
        f"By default {recipe.steps:,} steps on {recipe.batch} {unit} each, with a peak learning rate of "
        f"{recipe.learning_rate:g}. The same command resumes a run that was stopped.\n\n"
        f"Example: structagent train {kind} --data data/train --out runs/{kind}"
    )


for _kind in RECIPES:
    train_app.command(_kind, help=_network_help(_kind))(_train_network)


@train_app.command("strokes")
def train_strokes(
    out: RunFolderOption,
    steps: StepsOption = STROKES.steps,
    device: DeviceOption = "auto",
    seed: SeedOption = 0,
    learning_rate: RateOption = STROKES.learning_rate,
    batch: Annotated[int, typer.Option(metavar="N", min=3, help="Arrangements per step.")] = STROKES.batch,
    start: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Checkpoint to start from; by default random weights.")
    ] = None,
) -> None:
    """Train the network that reads the strokes of an example.

    Arrangements are drawn while it trains: figures of the library but those of the benchmark, and random strokes. It
    takes about 12 minutes on one core. The same command resumes a run that was stopped.

    Example: structagent train strokes --out runs/strokes
    """
    check_folder(out)
    from agent.training.train import TrainingRun, train_model

    recipe = Recipe(steps, learning_rate, batch)
    train_model(TrainingRun("strokes", None, out, recipe, device, seed=seed, start=start))


@train_app.command("parser")
def train_parser(
    out: Annotated[Path, typer.Option(metavar="DIR", help="Folder for config.json and model.safetensors.")],
    sentences: Annotated[
        int, typer.Option(metavar="N", min=32, help="Number of training sentences; each is read once.")
    ] = PARSER_SENTENCES,
    start: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Weights to start from; by default the layers of the sentence encoder."),
    ] = None,
    rate: Annotated[float, typer.Option(metavar="X", help="Factor on the learning rates.")] = 1.0,
    seed: SeedOption = 0,
    threads: ThreadsOption = 1,
) -> None:
    """Train the embedding parser.

    It takes about 35 minutes on one core. At the end the share of the development sentences that the parser reads
    without a mistake is printed.

    Example: structagent train parser --out runs/parser
    """
    check_folder(out)
    from agent.training.parsers import train_embedding_parser

    train_embedding_parser(out, sentences, start, rate, seed, threads)


@train_app.command("llm")
def train_llm(
    out: Annotated[Path, typer.Option(metavar="FILE", help="File for the adapter, in safetensors format.")],
    steps: Annotated[int, typer.Option(metavar="N", min=1, help="Optimiser steps, each on 16 sentences.")] = LLM_STEPS,
    start: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Adapter to start from; by default one that changes nothing."),
    ] = None,
    learning_rate: Annotated[float, typer.Option(metavar="X", help="Peak learning rate.")] = LLM_LEARNING_RATE,
    seed: SeedOption = 0,
    threads: ThreadsOption = 1,
) -> None:
    """Train the adapter of the local LLM.

    `--parser llm` uses it on the SmolLM2 model on this machine. Training takes about an hour on one core. At the end
    the results on the development sentences are printed as JSON.

    Example: structagent train llm --out runs/llm_adapter.safetensors
    """
    check_file(out)
    from agent.training.parsers import train_llm_adapter

    train_llm_adapter(out, steps, start, learning_rate, seed, threads)


@train_app.command("goals")
def train_goals(
    out: Annotated[Path, typer.Option(metavar="DIR", help="Folder for config.json and model.safetensors.")],
    steps: Annotated[int, typer.Option(metavar="N", min=1, help="Optimiser steps, each on 64 sentences.")] = GOAL_STEPS,
    start: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Network to start from; by default the layers of the embedding parser."),
    ] = None,
    learning_rate: Annotated[float, typer.Option(metavar="X", help="Peak learning rate.")] = GOAL_LEARNING_RATE,
    corrections: Annotated[
        float,
        typer.Option(metavar="SHARE", min=0.0, max=1.0, help="Share of the tasks that are corrections of a goal."),
    ] = CORRECTIONS,
    dropout: Annotated[
        float,
        typer.Option(metavar="SHARE", min=0.0, max=0.9, help="Dropout: share of the values that each step leaves out."),
    ] = DROPOUT,
    seed: SeedOption = 0,
    threads: ThreadsOption = 1,
) -> None:
    """Train the network that reads instructions and corrections.

    It writes the goals that the verifier judges. Training takes about an hour and a half on one core. The weights are
    written every three minutes: `--start` goes on from them. The loss on instructions, and on corrections, that are
    never trained on is printed every two hundred steps.

    Example: structagent train goals --out runs/goal_network

    Example: structagent train goals --start grounding/weights/goal_network --steps 600 --learning-rate 3e-4
    --out runs/further
    """
    check_folder(out)
    from agent.training.parsers import train_goal_network

    train_goal_network(out, steps, start, learning_rate, seed, threads, corrections, dropout)


@train_app.command("verifier")
def train_verifier(
    out: Annotated[
        Path, typer.Option(metavar="DIR", help="Folder for config.json, model.safetensors and proposals.jsonl.")
    ],
    steps: Annotated[
        int, typer.Option(metavar="N", min=1, help="Optimiser steps, each on 48 pairs of goal and text.")
    ] = VERIFIER_STEPS,
    start: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Verifier to start from; by default the goal network's layers.")
    ] = None,
    network: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Goal network that proposes goals; by default the shipped one.")
    ] = None,
    learning_rate: Annotated[float, typer.Option(metavar="X", help="Peak learning rate.")] = VERIFIER_LEARNING_RATE,
    seed: SeedOption = 0,
    threads: ThreadsOption = 1,
) -> None:
    """Train the verifier, which judges proposed goals.

    The goal network proposes goals for all labelled texts, the verifier is trained on them, and the weights of its
    probability are fitted on texts that no network was trained on. The same command goes on where the proposals were
    stopped; the weights are written every hundred steps, and `--start` goes on from them. At the end the log loss on
    texts that were left out is printed.

    Example: structagent train verifier --network runs/goal_network --out runs/verifier
    """
    check_folder(out)
    from agent.training.parsers import train_verifier as train

    train(out, steps, start, learning_rate, seed, threads, network)


@train_app.command("segmentation")
def train_segmentation(
    out: Annotated[
        Path, typer.Option(metavar="DIR", help="Folder for the network, the training state, the log and the views.")
    ],
    steps: StepsOption = SEGMENTATION.steps,
    batch: Annotated[int, typer.Option(metavar="N", min=2, help="Views per step.")] = SEGMENTATION.batch,
    views: Annotated[
        int, typer.Option(metavar="N", min=1, help="Views to draw; each is used several times with variations.")
    ] = SEGMENTATION_VIEWS,
    workers: Annotated[int, typer.Option(metavar="N", min=1, help="Processes that draw views.")] = 1,
    device: DeviceOption = "auto",
    learning_rate: RateOption = SEGMENTATION.learning_rate,
    seed: SeedOption = 0,
    threads: ThreadsOption = 1,
    start: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Network to start from, such as the shipped one; by default random weights."),
    ] = None,
) -> None:
    """Train the network that tells objects apart in depth pictures.

    Views of synthetic tables are drawn by other processes while it trains: an hour and a half on two cores. The same
    command resumes a run that was stopped.

    Example: structagent train segmentation --out runs/segmentation
    """
    check_folder(out)
    from agent.training.segmentation.command import train_segmentation_network

    train_segmentation_network(out, steps, batch, views, workers, device, learning_rate, seed, threads, start)
