"""Train the adapter of the local language model (`structagent train llm`): about an hour on one core.

Low-rank weights (Hu et al. 2021) that are in force on the instruction and the questions, while the
few-shot prompt is read by the bare model. Every other batch is read behind a prompt of other, fewer
or reordered examples, so that the prompt can be edited without training anew. Sentences come from
the training language; the temperatures from the development sentences, as the embedding parser's.
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import torch
from safetensors.torch import save
from torch import nn
from torch.nn import functional
from transformers import PreTrainedModel

from grounding.atomic_files import write_whole
from grounding.benchmark import Row, development_rows, score
from grounding.corpus.grammar import all_sentences, split_of
from grounding.corpus.paraphrases import LabelledText, paraphrase
from grounding.corpus.templates import all_frames
from grounding.parsers.llm import MAX_BYTES, PROMPT, LLMParser
from grounding.parsers.llm_local import ADAPTER, Layout, LocalLLM, read_adapter
from grounding.parsers.llm_reply import ANSWERS, BUILD, NONE, quotable
from grounding.spec import SLOTS
from grounding.training.low_rank import SCALE, LowRank, Prefix
from prompts import load_prompt, with_examples

BATCH = 16
# Sentences of like length share a batch, chosen among this many batches: little padding, still mixed.
BUCKET = 8
CORPUS_SHARE, REFUSED_SHARE = 0.06, 0.03
LEARNING_RATE = 1.5e-3
PROMPTS = 9  # other prompts than the full one
MATRICES = ("q_proj", "k_proj", "v_proj", "o_proj", "gate_proj", "up_proj", "down_proj")
UNCOUNTED = -100


@dataclass(frozen=True)
class AdapterTraining:
    """How to train the language model's adapter.

    Attributes:
        out: file for the adapter.
        steps: how many batches of `BATCH` sentences.
        start: file of an adapter to continue from; `None` starts from nothing.
        rate: the highest learning rate.
        seed: of the sentences, the prompts and the initial weights.
        threads: of torch; only one repeats exactly.

    Raises:
        ValueError: for no step, no thread, or a rate that is not positive.
    """

    out: Path = ADAPTER
    steps: int = 900
    start: Path | None = None
    rate: float = LEARNING_RATE
    seed: int = 0
    threads: int = 1

    def __post_init__(self) -> None:
        for name in ("steps", "threads"):
            if getattr(self, name) < 1:
                raise ValueError(f"{name} must be at least 1, not {getattr(self, name)}")
        if not self.rate > 0.0:
            raise ValueError(f"rate must be positive, not {self.rate}")


def train(options: AdapterTraining, report: Callable[[str], None] = lambda line: None) -> dict[str, Any]:
    """Train, calibrate, measure and write the adapter; it is saved after every hundred steps.

    Args:
        options: what to train, and where to write it.
        report: takes a line of progress after every twenty batches.

    Returns:
        The rates on the development sentences: "exact", "slots", "false_fills" and "refusal".

    Raises:
        LLMError: for a language model that cannot be loaded.
    """
    torch.set_num_threads(options.threads)
    trainer = Trainer(options.seed)
    if options.start is not None:
        trainer.start_from(options.start)
    _fit(trainer, options, report)
    rows = development_rows()
    temperatures, build_bias = calibrate(options.out, rows)
    about = {"steps": options.steps, "seed": options.seed}
    trainer.save(options.out, temperatures, build_bias, about)
    found = score(rows, LLMParser(LocalLLM(adapter=options.out)).parse_batch([row.text for row in rows]))
    return {name: found[name] for name in ("exact", "slots", "false_fills", "refusal")}


def _fit(trainer: Trainer, options: AdapterTraining, report: Callable[[str], None]) -> None:
    """Take all training steps, and save an uncalibrated adapter now and then."""
    optimiser = torch.optim.AdamW(trainer.weights(), weight_decay=0.01, betas=(0.9, 0.98))
    schedule = torch.optim.lr_scheduler.OneCycleLR(
        optimiser, options.rate, total_steps=options.steps + 1, pct_start=0.05, cycle_momentum=False
    )
    started, recent = time.perf_counter(), []
    drawn = draw_batches(np.random.default_rng(options.seed))
    for step, batch in zip(range(1, options.steps + 1), drawn, strict=False):
        loss = trainer.loss(batch)
        optimiser.zero_grad()
        loss.backward()
        nn.utils.clip_grad_norm_(trainer.weights(), 1.0)
        optimiser.step()
        schedule.step()
        recent.append(loss.item())
        if step % 20 == 0:
            seconds = time.perf_counter() - started
            report(f"step {step} of {options.steps}, loss {np.mean(recent[-20:]):.3f}, {seconds:.0f} s")
        if step % 100 == 0 or step == options.steps:
            trainer.save(options.out, dict.fromkeys(ANSWERS, 1.0), 0.0, {})


class Trainer:
    """The model with trainable low-rank weights, and the encoded prompts that precede its input."""

    def __init__(self, seed: int) -> None:
        self.rng = np.random.default_rng(seed)
        self.model = LocalLLM(adapter=None)
        self.network: PreTrainedModel = self.model.network
        self.network.requires_grad_(False)
        self.prompts = [self._read(prompt) for prompt in self._prompt_texts()]
        with torch.random.fork_rng():
            torch.manual_seed(seed)
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

    def weights(self) -> list[nn.Parameter]:
        """List all trained weights."""
        return [weight for layer in self.added.values() for weight in (layer.a, layer.b)]

    def loss(self, batch: Sequence[LabelledText]) -> torch.Tensor:
        """Sum the questions' cross-entropies per text; the slots of refused texts do not count."""
        layouts = [self.model.lay_out(quotable(entry.text)) for entry in batch]
        other = self.rng.random() < 0.5
        seen, tokens = self.prompts[self.rng.integers(1, len(self.prompts)) if other else 0]
        hidden = self._pass(layouts, seen, tokens)
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

    def save(
        self, path: Path, temperatures: dict[str, float], build_bias: float, about: dict[str, Any]
    ) -> None:
        """Write the adapter."""
        tensors = {}
        for name, layer in self.added.items():
            tensors[f"{name}.a"] = layer.a.detach().bfloat16().contiguous()
            tensors[f"{name}.b"] = (SCALE * layer.b.detach()).bfloat16().contiguous()
        metadata = {
            "model": self.model.folder.name,
            "temperatures": json.dumps(temperatures),
            "build_bias": str(build_bias),
            "training": json.dumps(about),
        }
        write_whole(path, save(tensors, metadata=metadata))

    def start_from(self, path: Path) -> None:
        """Continue from an adapter."""
        for name, (a, b) in read_adapter(path).matrices.items():
            self.added[name].a.data.copy_(a)
            self.added[name].b.data.copy_(b.float() / SCALE)

    def _pass(self, layouts: Sequence[Layout], seen: object, tokens: int) -> torch.Tensor:
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

    def _read(self, prompt: str) -> tuple[object, int]:
        with torch.no_grad():
            return self.model.run_prompt(prompt)


def draw_sentences(rng: np.random.Generator) -> Iterator[LabelledText]:
    """Draw labelled training sentences without end."""
    grammar = [(text, spec) for text, spec in all_sentences() if split_of(text) == "seen"]
    refused = [frame for frames in all_frames().values() for frame in frames if frame.refuse]
    while True:
        kind = rng.random()
        if kind < CORPUS_SHARE:
            text, spec = grammar[rng.integers(len(grammar))]
            yield LabelledText(text, spec.to_dict())
        elif kind < CORPUS_SHARE + REFUSED_SHARE:
            yield paraphrase(rng, refused[rng.integers(len(refused))])
        else:
            yield paraphrase(rng)


def draw_batches(rng: np.random.Generator) -> Iterator[list[LabelledText]]:
    """Draw batches of sentences of like length without end."""
    sentences = (entry for entry in draw_sentences(rng) if 0 < len(entry.text.encode()) <= MAX_BYTES)
    while True:
        chunk = [next(sentences) for _ in range(BATCH * BUCKET)]
        chunk.sort(key=lambda entry: len(entry.text))
        for k in rng.permutation(BUCKET):
            yield chunk[k * BATCH : (k + 1) * BATCH]


def calibrate(adapter: Path, rows: Sequence[Row]) -> tuple[dict[str, float], float]:
    """Find each question's temperature and the bias of "build" that make the acceptable answers the most likely."""
    model, prompt = LocalLLM(adapter=adapter), load_prompt(PROMPT)
    replies = [model.ask(prompt, quotable(row.text)) for row in rows]

    def cost(question: str, temperature: float, bias: float = 0.0) -> float:
        total = 0.0
        for row, reply in zip(rows, replies, strict=True):
            if question == "request":
                right = [(answer == BUILD) != row.refuse for answer in ANSWERS[question]]
            elif row.refuse:
                continue
            else:
                right = [(None if a == NONE else a) in row.acceptable[question] for a in ANSWERS[question]]
            logits = np.log(np.array(list(reply[question].values())) + 1e-9) / temperature
            logits += bias * np.array([answer == BUILD for answer in ANSWERS[question]])
            total -= float(np.logaddexp.reduce(logits[right]) - np.logaddexp.reduce(logits))
        return total

    grid = np.geomspace(0.25, 8.0, 61).tolist()
    temperatures = {slot: min(grid, key=partial(cost, slot)) for slot in SLOTS}
    pairs = [(t, bias) for t in grid[::2] for bias in np.linspace(-2, 4, 25).tolist()]
    temperatures["request"], bias = min(pairs, key=lambda pair: cost("request", *pair))
    return temperatures, bias


def _answers(entry: LabelledText) -> dict[str, str]:
    """Question -> answer, for the questions that the sentence answers."""
    if entry.refuse is not None:
        return {"request": entry.refuse}
    return {"request": BUILD} | {slot: value or NONE for slot, value in entry.labels.items()}
