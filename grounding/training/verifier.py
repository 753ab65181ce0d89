"""Train the verifier (`structagent train verifier`): about an hour on one core.

Examples are labelled texts beside goals: the labelled goal, those that the goal network proposes in its place
(`grounding.training.proposals`), and damaged ones. Texts that no goal holds have wrong goals only; where the words that
no goal holds are marked (`language/unheld_words.tsv.xz`), the network learns to find them.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache
from itertools import count
from pathlib import Path

import numpy as np
import torch
from safetensors.numpy import load_file
from torch import nn
from torch.nn.functional import binary_cross_entropy_with_logits, gelu

from grounding.atomic_files import write_all_whole
from grounding.goal_benchmark.rows import goal_scenes
from grounding.goal_network.beam_search import WrittenGoal
from grounding.goal_network.parts import parts_of
from grounding.goal_network.vocabulary import Action
from grounding.goal_network.writer import ENCODER_LAYER, UPPER, NetworkWriter, base_arrays, base_record
from grounding.goals.comparison import compare_goals
from grounding.goals.goal import Goal
from grounding.packed_weights import packed_bytes, unpacked
from grounding.parsers.sentence_encoder import SentenceEncoder
from grounding.propose.proposal import WordedGoal
from grounding.propose.resolution import resolved
from grounding.resolve.tokens import words_of
from grounding.training.damaged_goals import damaged
from grounding.training.goal_lines import labelled_rows
from grounding.training.goal_variation import mirrored_words, renamed_words
from grounding.training.precision import quick_steps
from grounding.training.proposals import ProposedGoals, read_proposals
from grounding.training.slot_network import encoder_layer
from grounding.training.slot_sentences import SlotSentences
from grounding.training.steps import Report, by_length, one_cycle, silent, split_weights, take_steps
from grounding.verify.verifier import HEADS, Pair, pair_of

WIDTH, SHARED = 384, 128
BATCH, BUCKET = 48, 8
STEPS = 1500
LEARNING_RATE, HEAD_FACTOR = 5e-5, 16.0
OF_SLOTS = 0.2  # share of the texts that are drawn sentences for one structure
REPORTED = 100  # steps between two lines of progress
LOST_SHARE, LOST_WEIGHT = 0.3, 5.0  # of the loss of words; of a lost word against a held one, of which there are many
UNKNOWN = -1.0  # of a word of which it is not known whether the goal has lost it


class VerifierNetwork(nn.Module):
    """A network from the lower states of the sentence encoder to judgements; `grounding.verify.verifier.Verifier` runs
    it.

    Args:
        dropout: of its layers.
    """

    def __init__(self, dropout: float = 0.1) -> None:
        super().__init__()
        self.upper = nn.ModuleList(encoder_layer(WIDTH, HEADS, 4 * WIDTH, dropout) for _ in range(UPPER))
        self.shared, self.right, self.lost = nn.Linear(WIDTH, SHARED), nn.Linear(SHARED, 1), nn.Linear(SHARED, 1)
        self.dropout = nn.Dropout(dropout)

    def forward(
        self, states: torch.Tensor, pieces: torch.Tensor, first: torch.Tensor
    ) -> tuple[torch.Tensor, torch.Tensor]:
        """Judge pairs: logits (B,) that the goal is meant, and (B, W) that it has lost a word.

        Args:
            states: (B, T, 384) float32 from the encoder's lower layers.
            pieces: (B, T) bool, false on padding.
            first: (B, W) int64: the first piece of each word.
        """
        for layer in self.upper:
            states = layer(states, src_key_padding_mask=~pieces)
        shared = self.dropout(gelu(self.shared(states)))
        words = shared.gather(1, first[..., None].expand(-1, -1, SHARED))
        return self.right(shared[:, 0])[:, 0], self.lost(words)[..., 0]


@dataclass(frozen=True)
class Example:
    """A pair and how it is to be judged.

    Attributes:
        pair: the words.
        right: whether the goal is what was meant.
        lost: for each word of what was said 1, 0 or `UNKNOWN`.
    """

    pair: Pair
    right: bool
    lost: tuple[float, ...]


@dataclass(frozen=True)
class VerifierTraining:
    """How to train the verifier.

    Attributes:
        out: folder for `model.safetensors` and `config.json`; they are written at every report.
        proposals: file that `grounding.training.proposals` wrote.
        steps: of the optimiser, on 48 pairs each.
        start: folder of a verifier to train further; `None` starts from the goal network's layers.
        rate: peak learning rate of the layers.
        seed: of the examples, the initial weights and dropout.
        threads: of torch; only one repeats exactly.
    """

    out: Path
    proposals: Path
    steps: int = STEPS
    start: Path | None = None
    rate: float = LEARNING_RATE
    seed: int = 0
    threads: int = 1


def train(options: VerifierTraining, report: Report = silent) -> None:
    """Train and write a verifier; the weights of its probability are fitted later
    (`grounding.training.calibration`).
    """
    torch.set_num_threads(options.threads)
    encoder, rng = SentenceEncoder(), np.random.default_rng(options.seed)
    rows = read_proposals(options.proposals)
    seen, unseen = [row for row in rows if not row.held_out], [row for row in rows if row.held_out][:400]
    slots = SlotSentences(rng)
    with torch.random.fork_rng():
        torch.manual_seed(options.seed)
        network = _initial(encoder, options.start)
        batches = (batch for _ in count() for batch in _batches(seen, slots, rng))
        losses = (_loss(network.train(), encoder, batch) for batch in batches)
        layers, heads = split_weights(network, "upper.")
        groups = ((layers, options.rate), (heads, HEAD_FACTOR * options.rate))
        for step in take_steps(
            losses, options.steps, *one_cycle(groups, options.steps), report, REPORTED,
            lambda: f", held out {loss_of(network, encoder, unseen):.3f}",
        ):  # fmt: skip
            if step % REPORTED == 0 or step == options.steps:
                save(network, encoder, options.out, step)


def save(network: VerifierNetwork, encoder: SentenceEncoder, out: Path, steps: int) -> None:
    """Write `model.safetensors` and `config.json`; weights of the probability that are there already stay."""
    base, record = base_arrays(), base_record()
    there = out / "config.json"
    weights = json.loads(there.read_text(encoding="utf-8"))["weights"] if there.is_file() else {}
    config = {"steps": steps, "encoder_sha256": encoder.checksum, "difference_to": record, "weights": weights}
    state = {name: tensor.detach().numpy() for name, tensor in network.state_dict().items()}
    write_all_whole(
        out, {"model.safetensors": packed_bytes(state, base), "config.json": json.dumps(config, indent=1) + "\n"}
    )


def examples_of(row: ProposedGoals, rng: np.random.Generator) -> list[Example]:
    """Draw examples of a text: the labelled goal, a wrong proposal, a damaged goal, the goal so far as it was."""
    count, goal = len(goal_scenes()[row.scene]), row.goal
    wrong = [one for one in row.goals if goal is None or not compare_goals(one, goal, count).exact]
    found = [] if goal is None else [(goal, True)]
    if wrong:
        place = 0 if rng.random() < 0.6 else int(rng.integers(len(wrong)))
        found.append((wrong[place], False))
    if goal is not None and (not wrong or rng.random() < 0.6):
        worse = damaged(goal, count, rng)
        found += [] if worse is None else [(worse, False)]
    if row.before.parts and rng.random() < 0.25 and (goal is None or not compare_goals(row.before, goal, count).exact):
        found.append((row.before, False))
    return [_example(row, one, right) for one, right in found]


def _example(row: ProposedGoals, goal: Goal, right: bool) -> Example:
    pair = pair_of(row.text, goal, goal_scenes()[row.scene], row.before)
    said = words_of(row.text)
    lost = [0.0 if right else UNKNOWN] * len(said)
    if not right and row.text in unheld_words():
        lost = [0.0] * len(said)
        for words in map(words_of, unheld_words()[row.text]):
            for place in range(len(said) - len(words) + 1):
                if said[place : place + len(words)] == words:
                    lost[place : place + len(words)] = [1.0] * len(words)
    return Example(pair, right, tuple(lost[len(said) - (pair.end - pair.first) :]))


@cache
def unheld_words() -> dict[str, tuple[str, ...]]:
    """Load the words that no goal holds of labelled texts: text -> its words."""
    found: dict[str, tuple[str, ...]] = {}
    for text, words in labelled_rows("unheld_words"):
        found[text] = (*found.get(text, ()), words)
    return found


def _slot_examples(slots: SlotSentences, rng: np.random.Generator) -> list[Example]:
    """Draw examples of a sentence for one structure in no known scene: its goal, and a damaged one."""
    task = slots.draw()
    text = " ".join(task.words)
    actions = tuple(Action(kind, places[0]) for kind, places in task.steps[:-1])
    goal = resolved(WordedGoal(1.0, parts_of(WrittenGoal(task.words, actions, 1.0), text).parts), text, None, None).goal
    if goal is None:
        return []
    worse = damaged(goal, 0, rng)
    judged = [(goal, True), *([] if worse is None else [(worse, False)])]
    return [Example(pair_of(text, one, ()), right, (UNKNOWN,) * len(task.words)) for one, right in judged]


def _batches(rows: Sequence[ProposedGoals], slots: SlotSentences, rng: np.random.Generator) -> Iterator[list[Example]]:
    """Draw batches of pairs of like length."""
    drawn = list[Example]()
    while len(drawn) < BATCH * BUCKET:
        plain = rng.random() < OF_SLOTS
        found = _slot_examples(slots, rng) if plain else examples_of(rows[int(rng.integers(len(rows)))], rng)
        drawn += [_varied(one, rng) for one in found]
    return by_length(iter(drawn), BATCH, len(drawn), lambda one: len(one.pair.words), rng)


def _varied(one: Example, rng: np.random.Generator) -> Example:
    """Exchange sides, nouns and colours in the text and the goal alike."""
    words = mirrored_words(one.pair.words, one.pair.first, rng)
    return replace(one, pair=replace(one.pair, words=tuple(renamed_words(words, rng))))


def _loss(network: VerifierNetwork, encoder: SentenceEncoder, batch: Sequence[Example]) -> torch.Tensor:
    said = encoder.word_states([list(one.pair.words) for one in batch], ENCODER_LAYER)
    lost = np.full(said.first.shape, UNKNOWN, dtype=np.float32)
    for row, one in zip(lost, batch, strict=True):
        row[one.pair.first : one.pair.end] = one.lost
    with quick_steps():
        right, words = network(*(torch.from_numpy(array) for array in (said.hidden, said.pieces, said.first)))
    loss = binary_cross_entropy_with_logits(right.float(), torch.tensor([float(one.right) for one in batch]))
    wanted = torch.from_numpy(lost)
    known = wanted != UNKNOWN
    if known.any():
        each = binary_cross_entropy_with_logits(words.float()[known], wanted[known], reduction="none")
        loss = loss + LOST_SHARE * (each * (1.0 + (LOST_WEIGHT - 1.0) * wanted[known])).mean()
    return loss


@torch.no_grad()
def loss_of(network: VerifierNetwork, encoder: SentenceEncoder, rows: Sequence[ProposedGoals]) -> float:
    """Return the mean loss of judging the proposals of texts; not a number where there are none."""
    network.eval()
    pairs = [
        (
            pair_of(row.text, one, there, row.before),
            row.goal is not None and compare_goals(one, row.goal, len(there)).exact,
        )
        for row, there in ((row, goal_scenes()[row.scene]) for row in rows)
        for one in row.goals
    ]
    pairs.sort(key=lambda each: len(each[0].words))
    losses = list[torch.Tensor]()
    for k in range(0, len(pairs), BATCH):
        said = encoder.word_states([list(pair.words) for pair, _ in pairs[k : k + BATCH]], ENCODER_LAYER)
        right, _ = network(*(torch.from_numpy(array) for array in (said.hidden, said.pieces, said.first)))
        wanted = torch.tensor([float(each) for _, each in pairs[k : k + BATCH]])
        losses.append(binary_cross_entropy_with_logits(right, wanted, reduction="none"))
    return float(torch.cat(losses).mean()) if losses else float("nan")


def _initial(encoder: SentenceEncoder, start: Path | None) -> VerifierNetwork:
    network = VerifierNetwork()
    if start is None:
        state = NetworkWriter.from_pretrained(encoder).decoder.state
        state = {name: array for name, array in state.items() if name.startswith("upper.")}
    else:
        state = unpacked(load_file(start / "model.safetensors"), base_arrays())
    tensors = {name: torch.from_numpy(np.array(array, dtype=np.float32)) for name, array in state.items()}
    network.load_state_dict(tensors, strict=start is not None)
    return network
