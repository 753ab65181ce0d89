"""Train the goal network (`structagent train goals`): about an hour on one core.

Most instructions are the labelled ones of `language/goal_lines.tsv`, varied at every use, or two of them joined
(`grounding.training.joined_instructions`); the others are drawn by `grounding.training.goal_sentences`. On request a
share of the tasks are corrections of goals, labelled (`language/goal_corrections.tsv`) or drawn. Every twelfth labelled
text, chosen by its checksum, is never trained on: the loss on these is reported, and confidences are chosen on them.
"""

from __future__ import annotations

import json
import time
import zlib
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from safetensors.numpy import save as save_arrays
from torch import nn

from grounding.atomic_files import write_all_whole
from grounding.goal_network.vocabulary import KEYWORDS, NO_GOAL
from grounding.goal_network.weight_differences import packed_bytes
from grounding.goal_network.writer import ENCODER_LAYER, MOST_SAID, NetworkWriter, base_arrays, base_record
from grounding.goal_reading.tokens import words_of
from grounding.parsers.embedding import WEIGHTS as PARSER_WEIGHTS
from grounding.parsers.sentence_encoder import SentenceEncoder
from grounding.training.goal_corrections import DrawnCorrections, GoalCorrection, corrected, goal_corrections
from grounding.training.goal_lines import GoalLine, LabelError, LabelledGoal, goal_lines, labelled
from grounding.training.goal_network import UPPER, GoalBatch, GoalNetwork
from grounding.training.goal_sentences import GoalSentences
from grounding.training.goal_variation import varied
from grounding.training.joined_instructions import JoinedInstructions
from grounding.training.transferred_corrections import TransferredCorrections

BATCH, BUCKET = 64, 10
STEPS = 4000
LEARNING_RATE = 6e-4
UPPER_RATE = 0.2  # of the layers that know English already
DRAWN = 0.3  # share of the sentences that are drawn
JOINED = 0.3  # share of the others that are joined from two labelled ones
DRAWN_CORRECTIONS, TRANSFERRED = 0.15, 0.35  # shares of the corrections that are drawn, and said about other goals
# Of the labelled texts half are drawn evenly, and half in proportion to the loss with which training begins: what the
# network to start from knows need only be kept. A higher loss does not count more: the label may be at fault.
EVENLY, MOST_LOSS = 0.5, 2.0
WARM_UP = 200
REPORTED = 200  # steps between two lines of progress
# For each weight of a stored difference: with 8 for the goal network no reading of 801 labelled instructions changes,
# with 4 for corrections the loss on unseen ones does not.
BITS = {"embedding": 8, "goals": 4}
HELD_OUT = 12


@dataclass(frozen=True)
class GoalNetworkTraining:
    """How to train the goal network.

    Attributes:
        out: folder for `model.safetensors` and `config.json`; they are written every three minutes.
        steps: of the optimiser, on 64 instructions each.
        start: folder of a network to train further; `None` starts from the layers of the shipped parser.
        rate: peak learning rate.
        corrections: share of the tasks that are corrections of a goal.
        dropout: of the network's layers.
        seed: of the instructions, the initial weights and dropout.
        threads: of torch; only one repeats exactly.
        difference_to: shipped network from which the stored one differs, a key of `BITS`; `None` stores all weights.
        kept: share of the network to start from in the weights that are written at the end (Wortsman et al., "Robust
            fine-tuning of zero-shot models", 2022); the rest are the trained ones.

    Raises:
        ValueError: for no step, no thread, a rate that is not positive, or a share outside 0 to 1.
    """

    out: Path
    steps: int = STEPS
    start: Path | None = None
    rate: float = LEARNING_RATE
    corrections: float = 0.0
    dropout: float = 0.1
    seed: int = 0
    threads: int = 1
    difference_to: str | None = None
    kept: float = 0.0

    def __post_init__(self) -> None:
        if self.steps < 1 or self.threads < 1 or not self.rate > 0.0:
            given = f"{self.steps}, {self.threads}, {self.rate}"
            raise ValueError(f"steps and threads must be at least 1 and the rate positive, not {given}")
        if not 0.0 <= self.corrections <= 1.0:
            raise ValueError(f"the share of corrections cannot be {self.corrections}; legal values: 0 to 1")
        if not 0.0 <= self.kept <= 1.0:
            raise ValueError(f"the share that is kept cannot be {self.kept}; legal values: 0 to 1")


def held_out(line: GoalLine | GoalCorrection) -> bool:
    """Return whether a text is never trained on."""
    return zlib.crc32(line.text.encode()) % HELD_OUT == 5


def train(options: GoalNetworkTraining, report: Callable[[str], None] = lambda line: None) -> None:
    """Train and write a network.

    Args:
        options: how to train, and where to write.
        report: takes a line of progress after every `REPORTED` steps.

    Raises:
        EncoderError, GoalNetworkError: for an encoder, or weights to start from, that cannot be used.
    """
    torch.set_num_threads(options.threads)
    encoder = SentenceEncoder()
    rng = np.random.default_rng(options.seed)
    texts_rng = np.random.default_rng(rng.integers(2**32))
    unseen = [_tasks(each, seen=False) for each in (goal_lines(), goal_corrections())]
    with torch.random.fork_rng():
        torch.manual_seed(options.seed)  # initial weights and dropout know no generator of their own
        network = _initial(encoder, options)
        texts = _Texts.of(texts_rng, options.corrections > 0.0, network if options.start else None, encoder)
        first = {name: tensor.detach().clone() for name, tensor in network.state_dict().items()}
        optimiser, schedule = _optimiser(network, options)
        started = saved = time.perf_counter()
        recent: list[float] = []
        for step, batch in enumerate(_batches(texts, rng, options.steps, options.corrections), start=1):
            loss = GoalBatch.of(encoder, batch).loss(network.train())
            optimiser.zero_grad()
            loss.backward()
            nn.utils.clip_grad_norm_(network.parameters(), 1.0)
            optimiser.step()
            schedule.step()
            recent.append(loss.item())
            if step % REPORTED == 0 or step == options.steps:
                held = ", ".join(f"{loss_of(network, encoder, rows):.3f}" for rows in unseen)
                losses = f"loss {np.mean(recent[-REPORTED:]):.3f}, held out {held}"
                report(f"step {step} of {options.steps}, {losses}, {time.perf_counter() - started:.0f} s")
            if step == options.steps:
                _blend(network, first, options.kept)
            if time.perf_counter() - saved > 180 or step == options.steps:
                save(network, encoder, options.out, step, options.difference_to)
                saved = time.perf_counter()


def _blend(network: GoalNetwork, first: Mapping[str, torch.Tensor], kept: float) -> None:
    """Replace the weights by an average with the first ones, of which they get a share."""
    state = network.state_dict()
    network.load_state_dict({name: kept * first[name] + (1.0 - kept) * tensor for name, tensor in state.items()})


def save(
    network: GoalNetwork, encoder: SentenceEncoder, out: Path, steps: int, difference_to: str | None = None
) -> None:
    """Write `model.safetensors` and `config.json`: all weights in float16, or what they differ from a shipped network."""
    config = {
        "steps": steps, "encoder_sha256": encoder.checksum, "encoder_layer": ENCODER_LAYER, "keywords": KEYWORDS,
        "taught_words": taught_words(),
    }  # fmt: skip
    state = {name: tensor.detach().numpy() for name, tensor in network.state_dict().items()}
    if difference_to is None:
        weights = save_arrays({name: array.astype(np.float16) for name, array in state.items()})
    else:
        base, config["difference_to"] = base_arrays(difference_to, encoder), base_record(difference_to)
        weights = packed_bytes(state, base, BITS[difference_to])
    write_all_whole(out, {"model.safetensors": weights, "config.json": json.dumps(config, indent=1) + "\n"})


def taught_words() -> list[str]:
    """Return the words of the labelled texts that ask for a goal, without those that stand in a single text."""
    rows = [(line.text, line.label) for line in goal_lines()] + [(row.text, row.after) for row in goal_corrections()]
    texts = [text for text, label in rows if label.strip(" .") not in NO_GOAL]
    count = Counter(word for text in texts for word in set(words_of(text)))
    return sorted(word for word, number in count.items() if number > 1 and word[0].isalpha())


@torch.no_grad()
def losses_of(network: GoalNetwork, encoder: SentenceEncoder, rows: Sequence[LabelledGoal]) -> np.ndarray:
    """Return the mean loss of each instruction: (rows,) float32."""
    network.eval()
    found = np.zeros(len(rows), dtype=np.float32)
    order = np.argsort([len(row.words) for row in rows])  # texts of like length go together
    for places in np.array_split(order, max(1, len(rows) // BATCH)):
        if len(places):
            found[places] = GoalBatch.of(encoder, [rows[place] for place in places]).row_losses(network).numpy()
    return found


def loss_of(network: GoalNetwork, encoder: SentenceEncoder, rows: Sequence[LabelledGoal]) -> float:
    """Return the mean loss of instructions; not a number where there are none."""
    return float(losses_of(network, encoder, rows).mean()) if rows else float("nan")


class _Labelled:
    """Labelled texts that are drawn.

    Args:
        tasks: what the network should write.
        losses: (tasks,) with which training begins; `None` where it begins anew.
    """

    def __init__(self, tasks: Sequence[LabelledGoal], losses: np.ndarray | None = None) -> None:
        self.tasks = tasks
        shares = np.full(len(tasks), 1.0 / max(1, len(tasks)))
        if losses is not None and len(tasks):
            capped = np.minimum(losses.astype(np.float64), MOST_LOSS) + 1e-6
            shares = EVENLY * shares + (1.0 - EVENLY) * capped / capped.sum()
        self._up_to = np.cumsum(shares)

    def draw(self, rng: np.random.Generator) -> LabelledGoal:
        """Draw a task."""
        return self.tasks[min(int(np.searchsorted(self._up_to, rng.random())), len(self.tasks) - 1)]


@dataclass(frozen=True)
class _Texts:
    """What is trained on.

    Attributes:
        instructions, corrections: labelled.
        sentences: draws instructions.
        joined: draws instructions that are joined from labelled ones.
        follow_ups: draws corrections.
        transferred: draws labelled corrections, said about other goals.
    """

    instructions: _Labelled
    corrections: _Labelled
    sentences: GoalSentences
    joined: JoinedInstructions
    follow_ups: DrawnCorrections
    transferred: TransferredCorrections

    @classmethod
    def of(
        cls, rng: np.random.Generator, corrections: bool, network: GoalNetwork | None, encoder: SentenceEncoder
    ) -> _Texts:
        lines = [line for line in goal_lines() if not held_out(line)]
        corrected_ones = lines if corrections else []  # their goals are made of labels, which takes a while
        own, tasks = (
            _Labelled(each, None if network is None else losses_of(network, encoder, each))
            for each in (_tasks(goal_lines(), seen=True), _tasks(goal_corrections(), seen=True) if corrections else [])
        )
        labelled_ones = [row for row in goal_corrections() if not held_out(row)]
        transferred = TransferredCorrections(labelled_ones, corrected_ones, rng)
        joined = JoinedInstructions(lines, rng)
        return cls(own, tasks, GoalSentences(rng), joined, DrawnCorrections(corrected_ones, rng), transferred)

    def draw(self, rng: np.random.Generator, corrections: float) -> LabelledGoal:
        """Draw a task, a correction with this probability, and vary it."""
        if rng.random() < corrections:
            task = self.correction(rng)
        elif rng.random() < DRAWN:
            sentence = self.sentences.draw()
            task = labelled(sentence.text, sentence.line)
        elif self.joined.possible and rng.random() < JOINED:
            task = self.joined.draw()
        else:
            task = self.instructions.draw(rng)
        return varied(task, rng)

    def correction(self, rng: np.random.Generator) -> LabelledGoal:
        """Draw a correction."""
        kind = rng.random()
        if kind < DRAWN_CORRECTIONS:
            return self.follow_ups.draw()
        if kind < DRAWN_CORRECTIONS + TRANSFERRED:
            return self.transferred.draw()
        return self.corrections.draw(rng)


def _tasks(texts: Sequence[GoalLine | GoalCorrection], seen: bool) -> list[LabelledGoal]:
    """Return the tasks of labelled texts, without the few labels that the network cannot write."""
    found = []
    for each in texts:
        if held_out(each) == seen:
            continue
        try:
            said = isinstance(each, GoalCorrection)
            task = corrected(each).task if said else labelled(each.text, each.label, scene=each.scene)
        except LabelError:
            continue  # as with more than nine parts
        if len(task.words) <= MOST_SAID:
            found.append(task)
    return found


def _batches(
    texts: _Texts, rng: np.random.Generator, steps: int, corrections: float
) -> Iterator[list[LabelledGoal]]:
    """Draw batches of texts of like length."""
    left: list[list[LabelledGoal]] = []
    for _ in range(steps):
        if not left:
            drawn = [texts.draw(rng, corrections) for _ in range(BATCH * BUCKET)]
            drawn.sort(key=lambda row: len(row.words))
            left = [drawn[k : k + BATCH] for k in range(0, len(drawn), BATCH)]
            rng.shuffle(left)
        yield left.pop()


def _initial(encoder: SentenceEncoder, options: GoalNetworkTraining) -> GoalNetwork:
    if options.start is not None:
        return GoalNetwork.of(NetworkWriter.from_pretrained(encoder, options.start).decoder, options.dropout)
    from grounding.parsers.embedding import EmbeddingParser

    network = GoalNetwork(options.dropout)
    parser = EmbeddingParser.from_pretrained(PARSER_WEIGHTS, encoder).reader
    for number, layer in enumerate(network.upper, start=parser.layers - UPPER):
        own = {
            name.split(".", 2)[2]: array for name, array in parser.state.items() if name.startswith(f"layers.{number}.")
        }
        layer.load_state_dict({name: torch.from_numpy(array.copy()) for name, array in own.items()})
    return network


def _optimiser(
    network: GoalNetwork, options: GoalNetworkTraining
) -> tuple[torch.optim.Optimizer, torch.optim.lr_scheduler.LRScheduler]:
    """Return AdamW and its schedule: up for a while, constant for half of the steps, then down to nothing."""
    upper = list(network.upper.parameters())
    others = [weight for name, weight in network.named_parameters() if not name.startswith("upper.")]
    groups = [{"params": upper, "lr": UPPER_RATE * options.rate}, {"params": others, "lr": options.rate}]
    optimiser = torch.optim.AdamW(groups, weight_decay=0.01, betas=(0.9, 0.98))
    steps = options.steps

    def factor(step: int) -> float:
        return min(1.0, (step + 1) / WARM_UP) * min(1.0, max(0.02, 2.0 * (1.0 - step / steps)))

    return optimiser, torch.optim.lr_scheduler.LambdaLR(optimiser, factor)
