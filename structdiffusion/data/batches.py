"""Make training batches on the fly in torch: partial views of stored scenes, goal poses, language.

The module needs only torch and numpy. A batch needs no file access: memory holds objects as surface points, scenes as
ids and poses, and sentences as embeddings.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from torch import Tensor

from grounding.spec import LEGAL_VALUES, SLOTS
from structdiffusion.data.npz_files import read_arrays
from structdiffusion.rotations import yaw_matrices
from structdiffusion.simulation.partial_views import partial_views
from structdiffusion.structures import STRUCTURES
from structdiffusion.structures.structure import a_structure
from structdiffusion.tableware import noun_ids
from structdiffusion.word_tokens import FIRST_VOCABULARY, WORDS

# Probabilities of keeping all slots, the shape, and each other slot.
_KEEP_ALL, _KEEP_SHAPE, _KEEP_SLOT = 0.35, 0.92, 0.65
_FORGET_NOUNS, _FORGET_NOUN = 0.15, 0.05  # probabilities of unknown nouns: of a whole scene; of one object
# By word id: the number of the value in its slot, from 1; 0 is "open". A mixed radix numbers each combination.
_VALUE_NUMBER = torch.tensor([0, *(LEGAL_VALUES[slot].index(value) + 1 for slot, value in WORDS)])
_SLOT_SIZES = torch.tensor([len(LEGAL_VALUES[slot]) + 1 for slot in SLOTS])
_RADIX = torch.cat((torch.ones(1, dtype=torch.long), _SLOT_SIZES.cumprod(0)[:-1]))
_COMBINATIONS = int(_SLOT_SIZES.prod())


@dataclass(frozen=True)
class Batch:
    """A batch of B scenes with up to N objects each; frames and units as in `observation`.

    Attributes:
        clouds: (B, N, P, 3) partial views before anything moves.
        present: (B, N) bool.
        object_ids: (B, N) ids in the library, 0 where absent.
        words: (B, 5) word ids of the language, 0 where left open.
        sentence: (B, 384) embeddings; rows of zeros where the language is word tokens.
        position: (B, N, 3) goal position of the mean of each cloud.
        turn: (B, N, 3, 3) rotation of each object, world frame.
        world_from_structure: (B, 4, 4).
    """

    clouds: Tensor
    present: Tensor
    object_ids: Tensor
    words: Tensor
    sentence: Tensor
    position: Tensor
    turn: Tensor
    world_from_structure: Tensor


class DemonstrationBatches:
    """Demonstrations of a folder, from which batches are drawn (see `demonstrations.py` for its files).

    Args:
        folder: with `library.npz`, `shard_*.npz` and `language.npz`.
        device: the device of the tensors.
        points: P of the clouds.
        shape: draw only structures of this shape.
        known: draw only scenes that a network with so many word ids, 0 included, can be asked for; `None` for all.

    Raises:
        FileNotFoundError: for a missing file, or if no scene has the shape or is known; the message names the
            command that makes it.
        DataFolderError: for a truncated or damaged file.
    """

    def __init__(
        self,
        folder: str | Path,
        device: torch.device | str = "cpu",
        points: int = 256,
        shape: str | None = None,
        known: int | None = None,
    ) -> None:
        folder = Path(folder)
        shards = sorted(folder.glob("shard_*.npz"))
        for name, there in (
            ("library.npz", (folder / "library.npz").is_file()),
            ("language.npz", (folder / "language.npz").is_file()),
            ("shard_*.npz", bool(shards)),
        ):
            if not there:
                raise FileNotFoundError(f"{folder} has no {name}; make it with `structagent generate --out {folder}`")
        self.device, self.points = torch.device(device), points
        library = read_arrays(folder / "library.npz", "points", "normals", "categories")
        self.surface = torch.from_numpy(library["points"]).float().to(device)  # (M, S, 3)
        self.normals = torch.from_numpy(library["normals"]).float().to(device)
        self.categories = [str(c) for c in library["categories"]]
        loaded = [read_arrays(shard) for shard in shards]
        widths = [shard["goal"].shape[1] for shard in loaded]
        loaded = [widened(shard, max(widths)) for shard in loaded]
        width = torch.from_numpy(np.repeat(widths, [len(shard["goal"]) for shard in loaded]))
        column = {name: torch.from_numpy(np.concatenate([shard[name] for shard in loaded])) for name in loaded[0]}
        wanted = torch.ones(len(width), dtype=torch.bool)
        if shape is not None:
            wanted &= column["words"][:, SLOTS.index("shape")] == WORDS["shape", shape]
        if known is not None:
            wanted &= (column["words"] < known).all(dim=1)
        if not wanted.any():
            made = f"make some with `structagent generate --out {folder}`"
            what = a_structure(shape) if shape is not None else "known to the network"
            raise FileNotFoundError(f"none of the {len(wanted)} scenes in {folder} is {what}; {made}")
        column, width = {name: rows[wanted] for name, rows in column.items()}, width[wanted]
        self.objects = column["objects"].long().to(device)  # (D, W + 2)
        self.initial, self.goal = column["initial"].to(device), column["goal"].to(device)
        self.frame, self.words = column["frame"].to(device), column["words"].long().to(device)
        self.places = self.goal.shape[1]  # W: largest number of objects that take part
        # Rows by width: all scenes of a batch have one width, so that a few crowded scenes do not make all batches
        # wider.
        self.rows = {int(w): torch.nonzero(width == w)[:, 0].to(device) for w in width.unique()}
        self._load_language(folder / "language.npz")

    def __len__(self) -> int:
        return len(self.objects)

    @property
    def vocabulary(self) -> int:
        """Return how many word ids, 0 included, a network needs for these scenes."""
        return max(FIRST_VOCABULARY, int(self.words.max()) + 1)

    def _load_language(self, path: Path) -> None:
        """Load the sentences sorted by what they specify, so that finding one for a spec is a look-up."""
        file = read_arrays(path, "embeddings", "words")
        embeddings, words = torch.from_numpy(file["embeddings"]), torch.from_numpy(file["words"]).long()
        keys = _keys(words)
        order = keys.argsort(stable=True)
        self.embeddings = embeddings[order].to(self.device)  # (L, 384) float16
        self.sentence_count = torch.bincount(keys, minlength=_COMBINATIONS).to(self.device)
        self.sentence_start = self.sentence_count.cumsum(0) - self.sentence_count

    def draw(self, size: int, generator: torch.Generator, sentences: float = 0.5) -> Batch:
        """Draw `size` random scenes; a share `sentences` of them has a sentence, the rest word tokens."""
        pick, places = self._pick(size, generator)
        # N = `places` objects that take part, followed by the distractors.
        slots = [*range(places), *range(self.places, self.objects.shape[1])]
        ids = self.objects[pick][:, slots]  # (B, N + 2)
        there = ids >= 0
        ids = ids.clamp(min=0)
        initial = self.initial[pick][:, slots]  # (B, N + 2, 3)
        rotation = yaw_matrices(initial[..., 2])  # (B, N + 2, 3, 3)
        points = torch.einsum("bnij,bnsj->bnsi", rotation, self.surface[ids])
        points[..., :2] += initial[..., None, :2]
        normals = torch.einsum("bnij,bnsj->bnsi", rotation, self.normals[ids])
        clouds, seen = partial_views(points, normals, there, self.points, generator)
        clouds, ids, there = clouds[:, :places], ids[:, :places], there[:, :places]
        # A fully hidden object cannot take part: the camera of a real scene would not detect it.
        there = there & (seen[:, :places] > 0.02)

        goal, frame = self.goal[pick][:, :places], self.frame[pick]
        turn = yaw_matrices(goal[..., 3])  # (B, N, 3, 3)
        origin = torch.cat((initial[:, :places, :2], torch.zeros_like(goal[..., :1])), dim=-1)
        mean = clouds.mean(dim=2)
        position = torch.einsum("bnij,bnj->bni", turn, mean - origin) + goal[..., :3]
        world_from_structure = torch.eye(4, device=self.device).repeat(size, 1, 1)
        world_from_structure[:, :3, :3] = yaw_matrices(frame[:, 2])
        world_from_structure[:, :2, 3] = frame[:, :2]
        words, sentence = self._speak(self.words[pick], sentences, generator)
        return Batch(clouds, there, ids, words, sentence, position, turn, world_from_structure)

    def _pick(self, size: int, generator: torch.Generator) -> tuple[Tensor, int]:
        """Draw random scenes of one width; return them and the width,
        each width in proportion to its number of scenes.
        """
        if len(self.rows) == 1:
            return torch.randint(len(self), (size,), generator=generator, device=self.device), self.places
        chosen = int(torch.randint(len(self), (1,), generator=generator, device=self.device))
        for width, rows in self.rows.items():  # noqa: B007 - the one at which it stops
            if chosen < len(rows):
                break
            chosen -= len(rows)
        return rows[torch.randint(len(rows), (size,), generator=generator, device=self.device)], width

    def _speak(self, words: Tensor, sentences: float, generator: torch.Generator) -> tuple[Tensor, Tensor]:
        """Leave slots open at random, and express a share of the goals as sentences."""
        chance = torch.rand(words.shape, generator=generator, device=self.device)
        keep = chance < torch.tensor([_KEEP_SHAPE] + [_KEEP_SLOT] * 4, device=self.device)
        whole = torch.rand(len(words), 1, generator=generator, device=self.device) < _KEEP_ALL
        # A ring has an opening only because the words ask for it; without the word it would be an error.
        altered = [WORDS["shape", name] for name, one in STRUCTURES.items() if one.rotation_alters_layout]
        opened = torch.isin(words[:, 0], torch.tensor(altered, device=self.device)) & (words[:, 4] > 0)
        keep = keep | whole
        keep[:, 4] |= opened
        keep[:, 0] |= (words * keep).sum(dim=1) == 0  # at least one slot has to be specified
        words = words * keep
        key = _keys(words)
        count = self.sentence_count[key]
        chosen = torch.rand(len(words), generator=generator, device=self.device) * count
        index = (self.sentence_start[key] + chosen.long()).clamp(max=len(self.embeddings) - 1)
        spoken = torch.rand(len(words), generator=generator, device=self.device) < sentences
        embedding = self.embeddings[index].float() * (spoken & (count > 0))[:, None]
        return words, embedding

    def noun_ids(self, ids: Tensor, nouns: tuple[str, ...], generator: torch.Generator) -> Tensor:
        """Return noun ids (B, N) of objects (B, N), some replaced by "unknown", as in real scenes without nouns."""
        table = torch.tensor(noun_ids(self.categories, nouns), device=self.device)
        return with_forgotten(table[ids], _FORGET_NOUN, _FORGET_NOUNS, generator)


def with_forgotten(nouns: Tensor, one: float, every: float, generator: torch.Generator) -> Tensor:
    """Replace noun ids (B, N) by "unknown": those of single objects, and of whole rows, with these probabilities."""
    forget = torch.rand(nouns.shape, generator=generator, device=generator.device) < one
    forget |= torch.rand(len(nouns), 1, generator=generator, device=generator.device) < every
    return nouns * ~forget.to(nouns.device)


def widened(columns: dict[str, np.ndarray], places: int) -> dict[str, np.ndarray]:
    """Widen the columns of a `DemonstrationSet` to this many objects that take part."""
    have = columns["goal"].shape[1]

    def with_room(column: np.ndarray, empty: int) -> np.ndarray:
        room = np.full((len(column), places - have, *column.shape[2:]), empty, column.dtype)
        return np.concatenate((column[:, :have], room, column[:, have:]), axis=1)

    empties = {"objects": -1, "initial": 0, "goal": 0}
    return {name: with_room(column, empties[name]) if name in empties else column for name, column in columns.items()}


def _keys(words: Tensor) -> Tensor:
    """Return one number for each combination of word ids (..., 5)."""
    return (_VALUE_NUMBER.to(words.device)[words] * _RADIX.to(words.device)).sum(dim=-1)
