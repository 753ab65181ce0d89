"""Train the parsers: check the options, train, print the progress and the result."""

from __future__ import annotations

import json
import sys
from pathlib import Path

from agent.errors import UsageError

# The defaults of the trainers, repeated here because importing those loads PyTorch.
PARSER_SENTENCES = 144_000
LLM_STEPS, LLM_LEARNING_RATE = 900, 1.5e-3
GOAL_STEPS, GOAL_LEARNING_RATE, CORRECTIONS, DROPOUT = 4000, 6e-4, 0.45, 0.15
VERIFIER_STEPS, VERIFIER_LEARNING_RATE = 1500, 5e-5


def train_embedding_parser(out: Path, sentences: int, start: Path | None, rate: float, seed: int, threads: int) -> None:
    """Train the embedding parser, write it to `out` and print its share of exactly read development sentences.

    Args:
        out: folder for `config.json` and `model.safetensors`.
        sentences: number of training sentences, at least 32; each is read once.
        start: folder of weights to start from; `None` starts from the layers of the sentence encoder.
        rate: factor of the learning rates, above 0.
        seed: of initial weights, dropout and sentences.
        threads: of torch.

    Raises:
        UsageError: for a folder to start from that does not exist, or an illegal rate.
        ParserWeightsError, EncoderError: for weights that cannot be read.
    """
    if start is not None and not start.is_dir():
        raise UsageError(f"--start must be a folder of weights, but there is no folder {str(start)!r}")
    _check_rate("--rate", rate)
    from grounding.training.embedding_parser import BATCH, ParserTraining, train

    config = train(ParserTraining(out, sentences // BATCH, start, rate, seed, threads), _print_progress)
    print(json.dumps(config["development"]["exact"]))


def train_llm_adapter(out: Path, steps: int, start: Path | None, rate: float, seed: int, threads: int) -> None:
    """Train the adapter of the local language model, write it to `out` and print its rates on development sentences.

    Args:
        out: file for the adapter, in safetensors format.
        steps: optimiser steps, each on a batch of sentences.
        start: adapter to start from; `None` starts from one that changes nothing.
        rate: peak learning rate, above 0.
        seed: of initial weights, sentences and prompts.
        threads: of torch.

    Raises:
        UsageError: for an adapter to start from that does not exist, or an illegal rate.
        LLMError: if the language model is not installed, or the adapter does not fit it.
    """
    if start is not None and not start.is_file():
        raise UsageError(f"--start must be an adapter file, but there is no file {str(start)!r}")
    _check_rate("--learning-rate", rate)
    from grounding.training.llm_adapter import AdapterTraining, train

    print(json.dumps(train(AdapterTraining(out, steps, start, rate, seed, threads), _print_progress)))


def train_goal_network(
    out: Path, steps: int, start: Path | None, rate: float, seed: int, threads: int, corrections: float, dropout: float
) -> None:
    """Train the network that reads instructions and corrections, and write it to the folder `out`.

    Args:
        out: folder for `config.json` and `model.safetensors`.
        steps: optimiser steps, each on a batch of tasks.
        start: folder of a network to train further; `None` starts from the layers of the embedding parser.
        rate: peak learning rate, above 0.
        seed: of initial weights and tasks.
        threads: of torch.
        corrections: share of the tasks that are corrections of a goal, 0 to 1.
        dropout: share of the values that are left out in each step, 0 to 1.

    Raises:
        UsageError: for a network to start from that cannot be used, or an illegal rate.
    """
    _check_rate("--learning-rate", rate)
    from grounding.goal_network.writer import GoalNetworkError
    from grounding.training.goal_reader import GoalNetworkTraining, train

    try:
        train(GoalNetworkTraining(out, steps, start, rate, seed, threads, corrections, dropout), _print_progress)
    except GoalNetworkError as error:
        raise UsageError(f"--start: {error}") from error


def train_verifier(
    out: Path, steps: int, start: Path | None, rate: float, seed: int, threads: int, network: Path | None
) -> None:
    """Let the goal network propose goals, train the verifier on them, fit its probability, and print how well it fits.

    Args:
        out: folder for `config.json`, `model.safetensors` and `proposals.jsonl`, which is completed where it is there.
        steps: optimiser steps, each on a batch of pairs.
        start: folder of a verifier to train further; `None` starts from the goal network's layers.
        rate: peak learning rate of the layers, above 0.
        seed: of initial weights and examples.
        threads: of torch.
        network: folder of the goal network that proposes; `None` takes the shipped one.

    Raises:
        UsageError: for a verifier to start from, or a goal network, that does not exist or cannot be used.
    """
    _check_rate("--learning-rate", rate)
    for option, folder in (("--start", start), ("--network", network)):
        if folder is not None and not folder.is_dir():
            raise UsageError(f"{option} must be a folder of weights, but there is no folder {str(folder)!r}")
    from grounding.goal_network.writer import GoalNetworkError
    from grounding.training.calibration import calibrate
    from grounding.training.proposals import write_proposals
    from grounding.training.verifier import VerifierTraining, train

    out.mkdir(parents=True, exist_ok=True)
    proposals = out / "proposals.jsonl"
    try:
        write_proposals(proposals, network, _print_progress)
    except GoalNetworkError as error:
        raise UsageError(f"--network: {error}") from error
    train(VerifierTraining(out, proposals, steps, start, rate, seed, threads), _print_progress)
    print(json.dumps(calibrate(out, network)))


def _check_rate(option: str, rate: float) -> None:
    if not 0.0 < rate < float("inf"):
        raise UsageError(f"{option} cannot be {rate:g}; legal: a number above 0")


def _print_progress(line: str) -> None:
    print(line, file=sys.stderr, flush=True)
