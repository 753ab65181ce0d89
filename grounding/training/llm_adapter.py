"""Train the adapter of the local language model (`structagent train llm`): about an hour on one core.

Low-rank weights (Hu et al. 2021) that are in force on the instruction and the questions, while the
few-shot prompt is read by the bare model. Every other batch is read behind a prompt of other, fewer
or reordered examples, so that the prompt can be edited without training anew. Sentences come from
the training language; the temperatures from the development sentences, as the embedding parser's.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import nn
from torch.nn import functional
from transformers import PreTrainedModel

from grounding.atomic_files import write_whole
from grounding.benchmark import Row, development_rows, score
from grounding.corpus.paraphrases import LabelledText
from grounding.packed_weights import packed_bytes
from grounding.parsers.llm import MAX_BYTES, PROMPT, LLMParser
from grounding.parsers.llm_local import ADAPTER, Layout, LocalLLM, read_adapter
from grounding.parsers.llm_reply import ANSWERS, BUILD, NONE, quotable
from grounding.spec import SLOTS
from grounding.training.low_rank import SCALE, LowRank, Prefix
from grounding.training.slot_texts import TEMPERATURES, draw_sentences, misfit, temperature
from grounding.training.steps import Report, Training, by_length, one_cycle, silent, take_steps
from prompts import load_prompt, with_examples

BATCH, BUCKET = 16, 8
CORPUS_SHARE, REFUSED_SHARE = 0.06, 0.03
LEARNING_RATE = 1.5e-3
PROMPTS = 9  # other prompts than the full one
MATRICES = ("q_proj", "k_proj", "v_proj", "o_proj", "gate_proj", "up_proj", "down_proj")
UNCOUNTED = -100


@dataclass(frozen=True)
class AdapterTraining(Training):
    """How to train the language model's adapter, on batches of `BATCH` sentences; `out` and `start` are files."""

    out: Path = ADAPTER
    steps: int = 900
    rate: float = LEARNING_RATE


def train(options: AdapterTraining, report: Report = silent) -> dict[str, Any]:
    """Train, calibrate, measure and write the adapter; it is saved after every hundred steps.

    Args:
        options: what to train, and where to write it.
        report: takes a line of progress after every twenty batches.

    Returns:
        The rates on the development sentences: "exact", "slots", "false_fills" and "refusal".

    Raises:
        LLMError: for a language model that cannot be loaded.
    """
    trainer = Trainer(options)
    for step in trainer.steps(map(trainer.loss, draw_batches(np.random.default_rng(options.seed))), report, 20):
        if step % 100 == 0 or step == options.steps:
            trainer.save(options.out, dict.fromkeys(ANSWERS, 1.0), 0.0, {})
    rows = development_rows()
    trainer.save(options.out, *calibrate(options.out, rows), {"steps": options.steps, "seed": options.seed})
    found = score(rows, LLMParser(LocalLLM(adapter=options.out)).parse_batch([row.text for row in rows]))
    return {name: found[name] for name in ("exact", "slots", "false_fills", "refusal")}


class Trainer:
    """The model with trainable low-rank weights, and the encoded prompts that precede its input.

    Args:
        options: how to train.
    """

    def __init__(self, options: AdapterTraining) -> None:
        torch.set_num_threads(options.threads)
        self.options, self.rng = options, np.random.default_rng(options.seed)
        self.model = LocalLLM(adapter=None)
        self.network: PreTrainedModel = self.model.network
        self.network.requires_grad_(False)
        with torch.no_grad():
            self.prompts = [self.model.run_prompt(prompt) for prompt in self._prompt_texts()]
        with torch.random.fork_rng():
            torch.manual_seed(options.seed)
            self.added = {
                name: LowRank(layer)
                for name, layer in self.network.named_modules()
                if isinstance(layer, nn.Linear) and name.rpartition(".")[2] in MATRICES
            }
        for name, layer in self.added.items():
            parent, _, child = name.rpartition(".")
            setattr(self.network.get_submodule(parent), child, layer)
        self.prefix = Prefix()
        self.network.config._attn_implementation = Prefix.name
        if options.start is not None:
            for name, (a, b) in read_adapter(options.start).matrices.items():
                self.added[name].a.data.copy_(a)
                self.added[name].b.data.copy_(b / SCALE)

    def steps(self, losses: Iterable[torch.Tensor], report: Report, reported: int) -> Iterator[int]:
        """Take all steps, and yield the number of each after it."""
        weights = [weight for layer in self.added.values() for weight in (layer.a, layer.b) if weight.requires_grad]
        steps = self.options.steps
        return take_steps(losses, steps, *one_cycle([(weights, self.options.rate)], steps), report, reported)

    def loss(self, batch: Sequence[LabelledText]) -> torch.Tensor:
        """Sum the questions' cross-entropies per text; the slots of refused texts do not count."""
        layouts = [self.model.lay_out(quotable(entry.text)) for entry in batch]
        other = self.rng.random() < 0.5
        prompt = self.prompts[self.rng.integers(1, len(self.prompts)) if other else 0]
        hidden = self.hidden_states(layouts, *prompt)
        answers = [_answers(entry) for entry in batch]
        table = self.network.get_output_embeddings().weight
        total = torch.zeros(())
        for question, legal in ANSWERS.items():
            states = torch.stack([hidden[i, layout.last[question]] for i, layout in enumerate(layouts)])
            logits = states.float() @ table[self.model.first[question]].float().T
            right = [legal.index(answer[question]) if question in answer else UNCOUNTED for answer in answers]
            total = total + functional.cross_entropy(
                logits, torch.tensor(right), reduction="sum", ignore_index=UNCOUNTED
            )
        return total / len(batch)

    def save(self, path: Path, temperatures: dict[str, float], build_bias: float, about: dict[str, Any]) -> None:
        """Write the adapter."""
        arrays = {}
        for name, layer in self.added.items():
            arrays[f"{name}.a"] = layer.a.detach().cpu().numpy()
            # Turned, because each of its few rows is then stored with a step of its own.
            arrays[f"{name}.b"] = (SCALE * layer.b.detach()).T.cpu().numpy()
        metadata = {
            "model": self.model.folder.name,
            "temperatures": json.dumps(temperatures),
            "build_bias": str(build_bias),
            "training": json.dumps(about),
        }
        write_whole(path, packed_bytes(arrays, {}, metadata))

    def hidden_states(self, layouts: Sequence[Layout], seen: object, tokens: int) -> torch.Tensor:
        """Return the last hidden states (B, T, width) after a prompt of that many tokens."""
        longest = max(len(layout.ids) for layout in layouts)
        ids = torch.zeros(len(layouts), longest, dtype=torch.long)
        positions = torch.full_like(ids, tokens)
        visible = torch.eye(longest, dtype=torch.bool).repeat(len(layouts), 1, 1)  # padding sees itself
        for i, layout in enumerate(layouts):
            length = len(layout.ids)
            ids[i, :length] = torch.tensor(layout.ids)
            positions[i, :length] = torch.tensor(layout.positions) + tokens
            visible[i, :length, :length] = layout.visible
        self.prefix.seen = seen
        hidden = torch.zeros(visible.shape, dtype=self.network.dtype).masked_fill(~visible, -1e9)
        self.prefix.hidden = hidden[:, None]
        output = self.network.base_model(input_ids=ids, position_ids=positions, use_cache=False)
        return output.last_hidden_state

    def _prompt_texts(self) -> Iterator[str]:
        """Return the prompt, and others with a random choice of its examples in random order."""
        prompt = load_prompt(PROMPT)
        yield prompt
        for _ in range(PROMPTS):
            yield with_examples(prompt, lambda n: self.rng.permutation(n)[: self.rng.integers(4, n + 1)])


def draw_batches(rng: np.random.Generator) -> Iterator[list[LabelledText]]:
    """Draw batches of sentences of like length without end."""
    drawn = draw_sentences(rng, CORPUS_SHARE, REFUSED_SHARE)
    short = (entry for entry in drawn if 0 < len(entry.text.encode()) <= MAX_BYTES)
    return by_length(short, BATCH, BUCKET, lambda entry: len(entry.text), rng)


def calibrate(adapter: Path, rows: Sequence[Row]) -> tuple[dict[str, float], float]:
    """Find each question's temperature and the bias of "build" that make the acceptable answers the most likely."""
    model, prompt = LocalLLM(adapter=adapter), load_prompt(PROMPT)
    replies = [model.ask(prompt, quotable(row.text)) for row in rows]
    asked = [place for place, row in enumerate(rows) if not row.refuse]  # of what is refused no slot is known
    temperatures = {}
    for slot in SLOTS:
        logits = np.log(np.array([[*replies[place][slot].values()] for place in asked]) + 1e-9)
        right = np.array(
            [[(None if answer == NONE else answer) in rows[place].acceptable[slot] for answer in ANSWERS[slot]]
             for place in asked]
        )  # fmt: skip
        temperatures[slot] = temperature(logits, right)
    logits = np.log(np.array([[*reply["request"].values()] for reply in replies]) + 1e-9)
    build = np.array([answer == BUILD for answer in ANSWERS["request"]])
    right = build != np.array([[row.refuse] for row in rows])
    pairs = [(t, bias) for t in TEMPERATURES[::2] for bias in np.linspace(-2, 4, 25).tolist()]
    temperatures["request"], bias = min(pairs, key=lambda pair: misfit(logits / pair[0] + pair[1] * build, right))
    return temperatures, bias


def _answers(entry: LabelledText) -> dict[str, str]:
    """Question -> answer, for the questions that the sentence answers."""
    if entry.refuse is not None:
        return {"request": entry.refuse}
    return {"request": BUILD} | {slot: value or NONE for slot, value in entry.labels.items()}
