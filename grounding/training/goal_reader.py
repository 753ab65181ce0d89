"""Train the goal network (`structagent train goals`): about an hour on one core.

Its tasks are labelled instructions (`language/goal_lines.tsv.xz`), varied at every use or two of them joined, sentences
with five slots, and corrections of goals, labelled (`language/goal_corrections.tsv.xz`) or drawn. Every twelfth
labelled text, chosen by its checksum, is never trained on: the loss on these is reported.
"""

from __future__ import annotations

import json
import time
import zlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch

from grounding.atomic_files import write_all_whole
from grounding.goal_network.beam_search import MOST_SAID
from grounding.goal_network.vocabulary import KEYWORDS
from grounding.goal_network.writer import ENCODER_LAYER, NetworkWriter, base_arrays, base_record
from grounding.packed_weights import packed_bytes
from grounding.parsers.sentence_encoder import SentenceEncoder
from grounding.training.goal_corrections import DrawnCorrections, GoalCorrection, corrected, goal_corrections
from grounding.training.goal_lines import GoalLine, LabelError, LabelledGoal, goal_lines, labelled
from grounding.training.goal_network import GoalBatch, GoalNetwork
from grounding.training.goal_variation import varied
from grounding.training.joined_instructions import JoinedInstructions
from grounding.training.plain_follow_ups import PlainFollowUps
from grounding.training.plain_wishes import PlainWishes
from grounding.training.slot_sentences import SlotSentences
from grounding.training.steps import Report, Training, by_length, one_cycle, silent, split_weights, take_steps

BATCH, BUCKET = 64, 10
STEPS = 4000
LEARNING_RATE = 6e-4
UPPER_RATE = 0.2  # of the layers that know English already
CORRECTIONS = 0.45  # share of the tasks that are corrections
WHOLE_FOLLOW_UPS, PLAIN_FOLLOW_UPS = 0.12, 0.2  # of these, that are drawn: whole instructions, and plain sentences
OF_SLOTS, PLAIN = 0.15, 0.15  # shares of the instructions that are drawn: with five slots, and plain wishes in a scene
JOINED = 0.35  # share of the others that are joined from two
# Of the labelled texts half are drawn evenly, and half in proportion to the loss with which training begins: what the
# network to start from knows need only be kept. A higher loss does not count more: the label may be at fault.
EVENLY, MOST_LOSS = 0.5, 2.0
REPORTED, SAVED = 200, 180.0  # steps between two lines of progress, seconds between two files of weights
HELD_OUT = 12


@dataclass(frozen=True)
class GoalNetworkTraining(Training):
    """How to train the goal network, on batches of `BATCH` tasks; it starts from the layers of the shipped parser.

    Attributes:
        corrections: share of the tasks that are corrections of a goal.
        dropout: of the network's layers.

    Raises:
        ValueError: for a share outside 0 to 1, and as `Training`.
    """

    steps: int = STEPS
    rate: float = LEARNING_RATE
    corrections: float = CORRECTIONS
    dropout: float = 0.15

    def __post_init__(self) -> None:
        super().__post_init__()
        if not 0.0 <= self.corrections <= 1.0:
            raise ValueError(f"the share of corrections cannot be {self.corrections}; legal values: 0 to 1")


def held_out(line: GoalLine | GoalCorrection) -> bool:
    """Return whether a text is never trained on."""
    return zlib.crc32(line.text.encode()) % HELD_OUT == 5


def train(options: GoalNetworkTraining, report: Report = silent) -> None:
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
    unseen = [_tasks(each, seen=False) for each in (goal_lines(), goal_corrections())]
    with torch.random.fork_rng():
        torch.manual_seed(options.seed)  # initial weights and dropout know no generator of their own
        network = _initial(encoder, options)
        draw = _drawer(options, network, encoder, rng)
        drawn = by_length(iter(draw, None), BATCH, BUCKET, lambda task: len(task.words), rng)
        losses = (GoalBatch.of(encoder, batch).loss(network.train()) for batch in drawn)
        layers, others = split_weights(network, "upper.")
        groups = ((layers, UPPER_RATE * options.rate), (others, options.rate))
        saved = time.perf_counter()
        for step in take_steps(
            losses, options.steps, *one_cycle(groups, options.steps), report, REPORTED,
            lambda: ", held out " + ", ".join(f"{loss_of(network, encoder, rows):.3f}" for rows in unseen),
        ):  # fmt: skip
            if time.perf_counter() - saved > SAVED or step == options.steps:
                save(network, encoder, options.out, step)
                saved = time.perf_counter()


def save(network: GoalNetwork, encoder: SentenceEncoder, out: Path, steps: int) -> None:
    """Write `model.safetensors` and `config.json`."""
    config = {
        "steps": steps, "encoder_sha256": encoder.checksum, "encoder_layer": ENCODER_LAYER, "keywords": KEYWORDS,
        "difference_to": base_record(),
    }  # fmt: skip
    state = {name: tensor.detach().numpy() for name, tensor in network.state_dict().items()}
    weights = packed_bytes(state, base_arrays())
    write_all_whole(out, {"model.safetensors": weights, "config.json": json.dumps(config, indent=1) + "\n"})


@torch.no_grad()
def losses_of(network: GoalNetwork, encoder: SentenceEncoder, rows: Sequence[LabelledGoal]) -> np.ndarray:
    """Return the mean loss of each task: (rows,) float32."""
    network.eval()
    found = np.zeros(len(rows), dtype=np.float32)
    order = np.argsort([len(row.words) for row in rows])  # texts of like length go together
    for places in np.array_split(order, max(1, len(rows) // BATCH)):
        if len(places):
            found[places] = GoalBatch.of(encoder, [rows[place] for place in places]).row_losses(network).numpy()
    return found


def loss_of(network: GoalNetwork, encoder: SentenceEncoder, rows: Sequence[LabelledGoal]) -> float:
    """Return the mean loss of tasks; not a number where there are none."""
    return float(losses_of(network, encoder, rows).mean()) if rows else float("nan")


def _drawer(
    options: GoalNetworkTraining, network: GoalNetwork, encoder: SentenceEncoder, rng: np.random.Generator
) -> Callable[[], LabelledGoal]:
    """Return what draws a task and varies it."""
    corrections = options.corrections > 0.0
    tasks = [_tasks(goal_lines(), seen=True), _tasks(goal_corrections(), seen=True) if corrections else []]
    up_to = [_up_to(losses_of(network, encoder, each) if options.start else np.ones(len(each))) for each in tasks]
    lines = [line for line in goal_lines() if not held_out(line)]
    slots, plain, joined = SlotSentences(rng), PlainWishes(rng), JoinedInstructions(lines, rng)
    follow_ups = DrawnCorrections(lines if corrections else [], rng)  # making the goals of their labels takes a while
    plain_follow_ups = PlainFollowUps(follow_ups.goals, rng)

    def of_labelled(kind: int) -> LabelledGoal:
        return tasks[kind][int(np.searchsorted(up_to[kind], rng.random() * up_to[kind][-1]))]

    def draw() -> LabelledGoal:
        if rng.random() < options.corrections:
            if (kind := rng.random()) < WHOLE_FOLLOW_UPS + PLAIN_FOLLOW_UPS:
                return follow_ups.draw() if kind < WHOLE_FOLLOW_UPS else plain_follow_ups.draw()
            return of_labelled(1)
        if (kind := rng.random()) < OF_SLOTS + PLAIN:
            return slots.draw() if kind < OF_SLOTS else plain.draw()
        return joined.draw() if joined.possible and rng.random() < JOINED else of_labelled(0)

    return lambda: varied(draw(), rng)


def _up_to(losses: np.ndarray) -> np.ndarray:
    """Return the sums of the shares of tasks up to each of them: (tasks,) float64."""
    capped = np.minimum(losses.astype(np.float64), MOST_LOSS) + 1e-6
    return np.cumsum(EVENLY / max(1, len(losses)) + (1.0 - EVENLY) * capped / capped.sum())


def _tasks(texts: Sequence[GoalLine | GoalCorrection], seen: bool) -> list[LabelledGoal]:
    """Return the tasks of labelled texts, without the few labels that the network cannot write."""
    found = []
    for each in texts:
        if held_out(each) == seen:
            continue
        try:
            if isinstance(each, GoalCorrection):
                task = corrected(each)
            else:
                task = labelled(each.text, each.label, scene=each.scene)
        except LabelError:
            continue  # as with more than nine parts
        if len(task.words) <= MOST_SAID:
            found.append(task)
    return found


def _initial(encoder: SentenceEncoder, options: GoalNetworkTraining) -> GoalNetwork:
    if options.start is not None:
        return GoalNetwork.of(NetworkWriter.from_pretrained(encoder, options.start).decoder, options.dropout)
    network = GoalNetwork(options.dropout)
    layers = {name: torch.from_numpy(array.astype(np.float32)) for name, array in base_arrays().items()}
    network.load_state_dict({name: layers.get(name, tensor) for name, tensor in network.state_dict().items()})
    return network
