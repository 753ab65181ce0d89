"""`structagent train parser` and `structagent train llm`: the trainers of the two parsers, with checked options."""

from __future__ import annotations

from pathlib import Path

from agent.errors import UsageError

PARSER_SENTENCES = 144_000  # about 35 minutes on one core
LLM_STEPS, LLM_LEARNING_RATE = 900, 1.5e-3  # about an hour on one core


def train_embedding_parser(out: Path, sentences: int, start: Path | None, rate: float, seed: int, threads: int) -> None:
    """Train the slot reader of the embedding parser and write it to `out`.

    Args:
        out: the folder that gets `config.json` and `model.safetensors`.
        sentences: how many training sentences are drawn; each is read once.
        start: a folder of weights to start from; `None` starts from the layers of the sentence encoder.
        rate: the factor on the learning rates.
        seed: of initial weights, dropout and sentences.
        threads: of torch.

    Raises:
        UsageError: for a folder to start from that does not exist.
        ParserWeightsError: for weights that cannot be read.
    """
    if start is not None and not start.is_dir():
        raise UsageError(f"--start must be a folder of weights, and there is no folder {str(start)!r}")
    from grounding.training.embedding_parser import main

    arguments = ["--out", str(out), "--sentences", str(sentences), "--rate", str(rate)]
    arguments += ["--seed", str(seed), "--threads", str(threads)]
    main(arguments + (["--start", str(start)] if start is not None else []))


def train_llm_adapter(out: Path, steps: int, start: Path | None, rate: float, seed: int, threads: int) -> None:
    """Train the adapter of the local language model and write it to `out`.

    Args:
        out: the file that gets the adapter, in safetensors format.
        steps: optimiser steps, each on a batch of sentences.
        start: an adapter to start from; `None` starts from an adapter that changes nothing.
        rate: the peak learning rate.
        seed: of initial weights and sentences.
        threads: of torch.

    Raises:
        UsageError: for an adapter to start from that does not exist.
        LLMError: when the language model is not installed, or the adapter does not fit it.
    """
    if start is not None and not start.is_file():
        raise UsageError(f"--start must be an adapter file, and there is no file {str(start)!r}")
    from grounding.training.llm_adapter import main

    arguments = ["--out", str(out), "--steps", str(steps), "--rate", str(rate)]
    arguments += ["--seed", str(seed), "--threads", str(threads)]
    main(arguments + (["--start", str(start)] if start is not None else []))
