"""The denoiser: a transformer over language, structure-frame and object tokens (paper section IV.B).

The state that is diffused has one row of nine numbers for the structure frame and one for each
object: a position, scaled to unit variance, and two vectors that give a rotation by Gram-Schmidt.
The structure frame is in the world. An object's position is where the mean of its observed points
goes, in the structure frame; its rotation is how it turns from how it was observed, in the world,
so that "leave it as it is" is the identity for every heading.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import torch
from torch import Tensor, nn

from structdiffusion.geometry import rotation_from_6d, rotation_to_6d
from structdiffusion.models.checkpoint import Checkpointed
from structdiffusion.models.encoders import (
    OUTLINE_FEATURES,
    SENTENCE_WIDTH,
    VOCABULARY,
    PointEncoder,
    TimeEmbedding,
    outline_features,
)
from structdiffusion.nouns import BASES, CUTLERY, DRINKWARE

POSE = 9  # 3 + 6 numbers a pose
WORD_TOKENS = 5


@dataclass(frozen=True)
class DiffusionConfig:
    """Sizes of the network and scales of its data.

    Attributes:
        width: of a token.
        layers, heads, feed_forward: of the transformer.
        points: how many points of a cloud are encoded.
        point_width: of a point's features.
        max_objects: how many objects the position embedding knows.
        steps: T of the noise schedule.
        prediction_type: what the network predicts (see `NoiseScheduler`).
        nouns: the nouns that have an embedding of their own; every other is unknown.
        frame_center, frame_scale: m; the structure frame's position is (p - center) / scale.
        object_center, object_scale: m; likewise for an object's position in the structure frame.
    """

    width: int = 128
    layers: int = 4
    heads: int = 4
    feed_forward: int = 384
    points: int = 128
    point_width: int = 48
    max_objects: int = 12
    steps: int = 200
    prediction_type: str = "v"
    nouns: tuple[str, ...] = BASES + CUTLERY + DRINKWARE
    frame_center: tuple[float, float, float] = (0.45, 0.0, 0.0)
    frame_scale: tuple[float, float, float] = (0.09, 0.19, 0.05)
    object_center: tuple[float, float, float] = (-0.015, 0.0, 0.06)
    object_scale: tuple[float, float, float] = (0.065, 0.10, 0.05)


@dataclass(frozen=True)
class Condition:
    """What the denoiser is told once per scene; encoded once, used at every step.

    Attributes:
        objects: (B, N, W_o) object encodings.
        language: (B, 5, W_l) language encodings.
        language_mask: (B, 5) bool, which of them are there.
        spoken: (B,) bool, whether the language is one sentence rather than word tokens.
        present: (B, N) bool, which objects are there.
    """

    objects: Tensor
    language: Tensor
    language_mask: Tensor
    spoken: Tensor
    present: Tensor

    def repeat(self, count: int) -> Condition:
        """Each scene `count` times in a row: (B * count, ...)."""
        return Condition(*(value.repeat_interleave(count, dim=0) for value in self.__dict__.values()))


class PoseDiffusion(Checkpointed):
    """Predicts the noise (or velocity) of a noisy arrangement. One network for both kinds of language.

    Language is either up to five word tokens or one sentence embedding. Objects carry, besides their
    cloud, their noun where the scene knows it and the table setting has a place for it: a fork is hard
    to tell from a spoon by a hundred noisy points. The paper has no such input; noun 0 is "unknown".
    """

    kind = "diffusion"
    Config = DiffusionConfig

    def __init__(self, config: DiffusionConfig = DiffusionConfig()) -> None:
        super().__init__()
        self.config = config
        width = config.width
        object_width, language_width, pose_width, place_width, kind_width, time_width = 96, 96, 48, 24, 8, 32
        self.language_width = language_width
        self.point_encoder = PointEncoder(3, config.point_width, config.point_width)
        self.outline = nn.Sequential(nn.Linear(OUTLINE_FEATURES, 64), nn.GELU(), nn.Linear(64, 64))
        self.noun = nn.Embedding(1 + len(config.nouns), 32)
        self.merge_object = nn.Sequential(nn.GELU(), nn.Linear(config.point_width + 64 + 32, object_width))
        self.word = nn.Embedding(VOCABULARY, language_width)
        self.sentence = nn.Linear(SENTENCE_WIDTH, language_width)
        self.pose = nn.Sequential(nn.Linear(POSE, 128), nn.GELU(), nn.Linear(128, pose_width))
        self.frame_query = nn.Parameter(0.02 * torch.randn(object_width))
        self.slot = nn.Embedding(WORD_TOKENS, place_width)
        # One for the frame and one for each place, for every number of objects: how far round a ring the
        # third place is depends on how many there are.
        self.place = nn.Embedding((config.max_objects + 1) ** 2, place_width)
        self.modality = nn.Embedding(4, kind_width)  # word, sentence, structure frame, object
        # The paper's concatenation at the feature dimension (section IV.B), brought to one width.
        self.join_language = nn.Linear(language_width + place_width + kind_width + time_width, width)
        self.join_object = nn.Linear(object_width + pose_width + place_width + kind_width + time_width, width)
        self.time = TimeEmbedding(time_width)
        layer = nn.TransformerEncoderLayer(
            width, config.heads, config.feed_forward, dropout=0.0, activation="relu", batch_first=True, norm_first=True
        )
        self.transformer = nn.TransformerEncoder(layer, config.layers, enable_nested_tensor=False)
        self.head = nn.Sequential(nn.LayerNorm(width), nn.Linear(width, POSE))

    def noun_ids(self, categories: Sequence[str]) -> list[int]:
        """The noun id of each category; 0 for one that the network does not know."""
        return [self.config.nouns.index(c) + 1 if c in self.config.nouns else 0 for c in categories]

    def condition(
        self,
        clouds: Tensor,
        present: Tensor,
        nouns: Tensor,
        *,
        words: Tensor | None = None,
        sentence: Tensor | None = None,
    ) -> Condition:
        """Encode a batch of scenes.

        Args:
            clouds: (B, N, P, 3) world frame, metres; P >= `config.points`, of which the first are encoded
                point by point, and all give the outline.
            present: (B, N) bool.
            nouns: (B, N) noun ids (see `noun_ids`).
            words: (B, 5) word ids, 0 where unspecified; or
            sentence: (B, 384) embeddings. Where both are given, a row of zeros means "use the words".
        """
        batch, count = present.shape
        outline = outline_features(clouds)  # (B, N, 21)
        mean = outline[..., :3]
        centred = (clouds[:, :, : self.config.points] - mean[..., None, :]) / 0.05  # 5 cm: an object's half size
        points = centred.new_zeros(batch, count, self.config.point_width)
        points[present] = self.point_encoder(centred[present])
        scaled = torch.cat(((mean - mean.new_tensor((0.45, 0.0, 0.05))) / 0.15, outline[..., 3:] / 0.05), dim=-1)
        objects = self.merge_object(torch.cat((points, self.outline(scaled), self.noun(nouns)), dim=-1))

        device = clouds.device
        language = torch.zeros(batch, WORD_TOKENS, self.language_width, device=device)
        mask = torch.zeros(batch, WORD_TOKENS, dtype=torch.bool, device=device)
        given = torch.zeros(batch, dtype=torch.bool, device=device)
        if words is not None:
            language, mask = self.word(words), words > 0
        if sentence is not None:
            given = sentence.abs().sum(dim=-1) > 0  # (B,)
            spoken = torch.zeros_like(language)
            spoken[:, 0] = self.sentence(sentence)
            language = torch.where(given[:, None, None], spoken, language)
            first = torch.arange(WORD_TOKENS, device=device) == 0
            mask = torch.where(given[:, None], first, mask)
        return Condition(objects, language, mask, given, present)

    def forward(self, state: Tensor, timesteps: Tensor, condition: Condition) -> Tensor:
        """The prediction (B, 1 + N, 9) for a noisy state (B, 1 + N, 9) at steps (B,)."""
        batch, count = condition.present.shape
        device = state.device
        time = self.time(timesteps)[:, None, :]  # (B, 1, W_t)
        words, sentence, frame, thing = self.modality.weight
        spoken = torch.where(condition.spoken[:, None], sentence, words)[:, None]  # (B, 1, W_k)
        slots = self.slot.weight.expand(batch, -1, -1)
        language = self.join_language(
            torch.cat((condition.language, slots, *_spread((spoken, time), batch, WORD_TOKENS)), dim=-1)
        )
        numbers = torch.arange(1 + count, device=device) + condition.present.sum(1, keepdim=True) * (
            self.config.max_objects + 1
        )  # (B, 1 + N)
        kind = torch.cat((frame[None], thing.expand(count, -1)))  # (1 + N, W_k)
        things = torch.cat((self.frame_query.expand(batch, 1, -1), condition.objects), dim=1)
        things = self.join_object(
            torch.cat((things, self.pose(state), self.place(numbers), *_spread((kind, time), batch, 1 + count)), dim=-1)
        )
        tokens = torch.cat((language, things), dim=1)  # (B, 5 + 1 + N, W)
        there = torch.cat(
            (condition.language_mask, torch.ones(batch, 1, dtype=torch.bool, device=device), condition.present), dim=1
        )
        encoded = self.transformer(tokens, src_key_padding_mask=~there)
        return self.head(encoded[:, WORD_TOKENS:]).float()

    def encode_state(self, world_from_structure: Tensor, position: Tensor, turn: Tensor) -> Tensor:
        """The clean state (B, 1 + N, 9).

        Args:
            world_from_structure: (B, 4, 4).
            position: (B, N, 3) where the mean of each object's points goes, world frame, metres.
            turn: (B, N, 3, 3) how each object turns from how it was observed, world frame.
        """
        rotation, origin = world_from_structure[:, :3, :3], world_from_structure[:, :3, 3]
        local = torch.einsum("bji,bnj->bni", rotation, position - origin[:, None])
        like = position
        frame = (origin - like.new_tensor(self.config.frame_center)) / like.new_tensor(self.config.frame_scale)
        local = (local - like.new_tensor(self.config.object_center)) / like.new_tensor(self.config.object_scale)
        return torch.cat(
            (
                torch.cat((frame, rotation_to_6d(rotation)), dim=-1)[:, None],
                torch.cat((local, rotation_to_6d(turn)), dim=-1),
            ),
            dim=1,
        )

    def decode_state(self, state: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """The inverse of `encode_state`: world_from_structure (B, 4, 4), position (B, N, 3), turn (B, N, 3, 3)."""
        like = state
        rotation = rotation_from_6d(state[:, 0, 3:])
        origin = state[:, 0, :3] * like.new_tensor(self.config.frame_scale) + like.new_tensor(self.config.frame_center)
        frame = torch.eye(4, device=state.device, dtype=state.dtype).repeat(len(state), 1, 1)
        frame[:, :3, :3], frame[:, :3, 3] = rotation, origin
        local = state[:, 1:, :3] * like.new_tensor(self.config.object_scale) + like.new_tensor(self.config.object_center)
        position = torch.einsum("bij,bnj->bni", rotation, local) + origin[:, None]
        return frame, position, rotation_from_6d(state[:, 1:, 3:])

    @classmethod
    def fake_input(cls, batch: int, objects: int, generator: torch.Generator) -> dict[str, Tensor]:
        """A random observation of the right shapes and ranges, for tests and benchmarks."""
        present = torch.ones(batch, objects, dtype=torch.bool)
        present[1:, -1] = False
        return {
            "clouds": 0.05 * torch.randn(batch, objects, 256, 3, generator=generator)
            + torch.tensor((0.45, 0.0, 0.05)),
            "present": present,
            "nouns": torch.zeros(batch, objects, dtype=torch.long),
            "words": torch.randint(0, 4, (batch, WORD_TOKENS), generator=generator),
        }


def _spread(values: Sequence[Tensor], batch: int, length: int) -> list[Tensor]:
    """Each value, (B or 1, L or 1, W) or (L, W), as (B, L, W)."""
    return [value.expand(batch, length, value.shape[-1]) for value in values]
