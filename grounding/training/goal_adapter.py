"""Train the adapter with which the local language model writes goals of several parts (`grounding.llm_goals`).

It starts from the adapter of the five slots. Low-rank weights of the upper layers are trained further, which costs two
thirds of a step of all layers; the prompt is read by the bare model. A text's loss is that of the line's tokens. Most
texts are the labelled instructions of `language/goal_lines.tsv`, the others are drawn; labelled instructions that the
goal network is never trained on are not trained on here either, and the loss on some of them is reported.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

import numpy as np
import torch
from torch import nn
from torch.nn import functional

from grounding.llm_goals.lines import Said, pieces_of
from grounding.llm_goals.local import GOAL_ADAPTER, PROMPT
from grounding.parsers.llm_local import ADAPTER, INSTRUCTION
from grounding.parsers.llm_reply import ANSWERS
from grounding.training.adapter_sentences import adapter_sentences, mixed_sentences
from grounding.training.goal_sentences import GoalSentence
from grounding.training.llm_adapter import AdapterTraining, Trainer
from prompts import load_prompt

BATCH, BUCKET = 16, 16
FROZEN_LAYERS = 10
MOST_TOKENS = 100  # of an instruction with its line: longer ones are not trained
HELD_OUT = 4  # batches of labelled instructions on which the loss is reported


@dataclass(frozen=True)
class GoalTraining(AdapterTraining):
    """How to train the goal adapter.

    Attributes:
        out, steps, start, rate, seed, threads: as for the adapter of the five slots, from which it starts by default.
        frozen: how many of the lowest layers keep their weights.
    """

    out: Path = GOAL_ADAPTER
    start: Path | None = ADAPTER
    frozen: int = FROZEN_LAYERS


def train(options: GoalTraining, report: Callable[[str], None] = lambda line: None) -> None:
    """Train and write the adapter; it is saved after every fifty steps.

    Raises:
        LLMError: for a language model or an adapter that cannot be loaded.
    """
    torch.set_num_threads(options.threads)
    trainer = GoalTrainer(options.seed)
    if options.start is not None:
        trainer.start_from(options.start)
    trainer.freeze(options.frozen)
    weights = [weight for weight in trainer.weights() if weight.requires_grad]
    optimiser = torch.optim.AdamW(weights, weight_decay=0.01, betas=(0.9, 0.98))
    schedule = torch.optim.lr_scheduler.OneCycleLR(
        optimiser, options.rate, total_steps=options.steps + 1, pct_start=0.05, cycle_momentum=False
    )
    started, recent = time.perf_counter(), []
    unseen = trainer.held_out_batches()
    for step, batch in zip(range(1, options.steps + 1), trainer.batches(options.seed), strict=False):
        loss = trainer.line_loss(batch)
        optimiser.zero_grad()
        loss.backward()
        nn.utils.clip_grad_norm_(weights, 1.0)
        optimiser.step()
        schedule.step()
        recent.append(loss.item())
        if step % 10 == 0:
            report(
                f"step {step} of {options.steps}, loss {np.mean(recent[-20:]):.4f}, "
                f"{time.perf_counter() - started:.0f} s"
            )
        if step % 50 == 0 or step == options.steps:
            about = {"steps": step, "of": options.steps, "seed": options.seed}
            trainer.save(options.out, dict.fromkeys(ANSWERS, 1.0), 0.0, about)
            with torch.no_grad():
                held = np.mean([trainer.line_loss(each).item() for each in unseen])
            report(f"step {step} of {options.steps}, loss on unseen instructions {held:.4f}")


class GoalTrainer(Trainer):
    """The model with trainable low-rank weights, and the encoded prompt of goals that precedes its input."""

    def freeze(self, layers: int) -> None:
        """Keep the weights of the lowest layers."""
        for name, added in self.added.items():
            if int(name.split(".layers.")[1].split(".")[0]) < layers:
                added.requires_grad_(False)

    def batches(self, seed: int) -> Iterator[list[tuple[list[int], int]]]:
        """Draw batches of (tokens, number of tokens of the instruction), of like length."""
        rng = np.random.default_rng(seed)
        entries = self._short(mixed_sentences(rng))
        while True:
            chunk = sorted(islice(entries, BATCH * BUCKET), key=lambda entry: len(entry[0]))
            for k in rng.permutation(BUCKET):
                yield chunk[k * BATCH : (k + 1) * BATCH]

    def held_out_batches(self) -> list[list[tuple[list[int], int]]]:
        """Return batches of labelled instructions that are never trained on."""
        rows = adapter_sentences(seen=False)
        entries = list(self._short(rows[:: max(1, len(rows) // (BATCH * HELD_OUT))]))
        return [entries[k : k + BATCH] for k in range(0, len(entries), BATCH)]

    def _short(self, sentences: Iterable[GoalSentence]) -> Iterator[tuple[list[int], int]]:
        """Return the tokens of those sentences that are not too long."""
        return (entry for entry in map(self.tokens, sentences) if len(entry[0]) <= MOST_TOKENS)

    def tokens(self, sentence: GoalSentence) -> tuple[list[int], int]:
        """Return the tokens of an instruction and its line, and how many are the instruction's."""
        said = Said.of(sentence.text, sentence.lengths, sentence.counts)
        before = self.model.tokens(INSTRUCTION.format(text=said.text))
        line = [token for piece in pieces_of(sentence.line, said) for token in self.model.tokens(piece)]
        return before + line, len(before)

    def line_loss(self, batch: Sequence[tuple[list[int], int]]) -> torch.Tensor:
        """Compute the mean cross-entropy of the tokens of the lines."""
        seen, behind = self.prompts[0]
        longest = max(len(ids) for ids, _ in batch)
        ids = torch.zeros(len(batch), longest, dtype=torch.long)
        counted = torch.zeros(len(batch), longest, dtype=torch.bool)
        for i, (tokens, first) in enumerate(batch):
            ids[i, : len(tokens)] = torch.tensor(tokens)
            counted[i, first - 1 : len(tokens) - 1] = True  # the places that say the next token of the line
        visible = torch.ones(longest, longest, dtype=torch.bool).tril()
        self.prefix.seen = seen
        hidden = torch.zeros(visible.shape, dtype=self.network.dtype).masked_fill(~visible, -1e9)
        self.prefix.hidden = hidden[None, None].expand(len(batch), 1, longest, longest)
        positions = torch.arange(longest).expand(len(batch), longest) + behind
        states = self.network.base_model(input_ids=ids, position_ids=positions, use_cache=False).last_hidden_state
        logits = states[counted] @ self.network.get_output_embeddings().weight.T
        return functional.cross_entropy(logits.float(), ids.roll(-1, dims=1)[counted])

    def _prompt_texts(self) -> Iterator[str]:
        yield load_prompt(PROMPT)
