"""Train the adapter with which the local language model writes goals of several parts (`grounding.language_model`).

It starts from the adapter of the five slots. Low-rank weights of the upper layers are trained further, which costs two
thirds of a step of all layers; the prompt is read by the bare model. A text's loss is that of the line's tokens. Texts
are the labelled instructions of `language/goal_lines.tsv`, without those that the goal network is never trained on: the
loss on some of these is reported.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import count
from pathlib import Path

import numpy as np
import torch
from torch.nn import functional

from grounding.language_model.goal_lines import pieces_of
from grounding.language_model.local_goals import GOAL_ADAPTER, PROMPT
from grounding.parsers.llm_local import ADAPTER, INSTRUCTION, Layout
from grounding.parsers.llm_reply import ANSWERS
from grounding.training.adapter_sentences import GoalSentence, adapter_sentences
from grounding.training.llm_adapter import AdapterTraining, Trainer
from grounding.training.steps import Report, by_length, silent
from prompts import load_prompt

BATCH, BUCKET = 16, 16
FROZEN_LAYERS = 10
MOST_TOKENS = 100  # of an instruction with its line: longer ones are not trained
HELD_OUT = 4  # batches of labelled instructions on which the loss is reported
_Tokens = tuple[list[int], int]  # of an instruction and its line, and how many are the instruction's


@dataclass(frozen=True)
class GoalTraining(AdapterTraining):
    """How to train the goal adapter: as that of the five slots, from which it starts by default."""

    out: Path = GOAL_ADAPTER
    start: Path | None = ADAPTER


def train(options: GoalTraining, report: Report = silent) -> None:
    """Train and write the adapter; it is saved after every fifty steps.

    Raises:
        LLMError: for a language model or an adapter that cannot be loaded.
    """
    trainer = GoalTrainer(options)
    trainer.freeze(FROZEN_LAYERS)
    unseen = trainer.held_out_batches()
    losses = map(trainer.line_loss, trainer.line_batches(options.seed))
    for step in trainer.steps(losses, report, 10):
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

    def line_batches(self, seed: int) -> Iterator[list[_Tokens]]:
        """Draw batches of texts of like length, each text once in every round."""
        rng, rows = np.random.default_rng(seed), adapter_sentences(seen=True)
        rounds = (rows[k] for _ in count() for k in rng.permutation(len(rows)))
        return by_length(self._short(rounds), BATCH, BUCKET, lambda entry: len(entry[0]), rng)

    def held_out_batches(self) -> list[list[_Tokens]]:
        """Return batches of labelled instructions that are never trained on."""
        rows = adapter_sentences(seen=False)
        entries = list(self._short(rows[:: max(1, len(rows) // (BATCH * HELD_OUT))]))
        return [entries[k : k + BATCH] for k in range(0, len(entries), BATCH)]

    def _short(self, sentences: Iterable[GoalSentence]) -> Iterator[_Tokens]:
        """Return the tokens of those sentences that are not too long."""
        return (entry for entry in map(self.tokens, sentences) if len(entry[0]) <= MOST_TOKENS)

    def tokens(self, sentence: GoalSentence) -> _Tokens:
        """Return the tokens of an instruction and its line, and how many are the instruction's."""
        before = self.model.tokens(INSTRUCTION.format(text=sentence.said.text))
        pieces = pieces_of(sentence.line, sentence.said)
        return before + [token for piece in pieces for token in self.model.tokens(piece)], len(before)

    def line_loss(self, batch: Sequence[_Tokens]) -> torch.Tensor:
        """Compute the mean cross-entropy of the tokens of the lines."""
        earlier = torch.ones(MOST_TOKENS, MOST_TOKENS, dtype=torch.bool).tril()
        layouts = [Layout(ids, list(range(len(ids))), earlier[: len(ids), : len(ids)], {}) for ids, _ in batch]
        hidden = self.hidden_states(layouts, *self.prompts[0])
        # The state of each token, the instruction's last included, says the token after it.
        states = torch.cat([hidden[i, first - 1 : len(ids) - 1] for i, (ids, first) in enumerate(batch)])
        logits = states @ self.network.get_output_embeddings().weight.T
        right = torch.tensor([token for ids, first in batch for token in ids[first:]])
        return functional.cross_entropy(logits.float(), right)

    def _prompt_texts(self) -> Iterator[str]:
        yield load_prompt(PROMPT)
