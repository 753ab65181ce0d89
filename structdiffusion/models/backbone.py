"""Shared base of the generative models: encoders, tokens, and the predicted state (paper section IV).

A state has one row of nine numbers for the structure frame and one for each object: a position, scaled to unit
    variance,
and two vectors that give a rotation by Gram-Schmidt. The structure frame is expressed in the world. An object's
position is the goal of the mean of its observed points, in the structure frame; its rotation is relative to the
observed pose, in the world, so that an unchanged orientation is the identity for every heading.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import torch
from torch import Tensor, nn

from structdiffusion.models.checkpoint import Checkpointed
from structdiffusion.models.encoders import (
    OUTLINE_FEATURES,
    SENTENCE_WIDTH,
    PointEncoder,
    fake_scenes,
    outline_features,
)
from structdiffusion.rotations import rotation_from_6d, rotation_to_6d
from structdiffusion.tableware import NOUNS, noun_ids
from structdiffusion.word_tokens import VOCABULARY, WORD_TOKENS

POSE = 9  # 3 + 6 numbers a pose
OBJECT_WIDTH = 96  # of an object's encoding
_LANGUAGE_WIDTH, _POSE_WIDTH, _PLACE_WIDTH, _KIND_WIDTH = 96, 48, 24, 8


@dataclass(frozen=True)
class BackboneConfig:
    """Sizes of the network and scales of its data.

    Attributes:
        width: width of a token.
        layers, heads, feed_forward: sizes of the transformer.
        points: number of encoded points of a cloud.
        point_width: width of a point's features.
        max_objects: largest number of objects that the position embedding supports.
        nouns: the nouns that have an embedding; every other noun is "unknown".
        frame_center, frame_scale: m; the structure frame's position is (p - center) / scale.
        object_center, object_scale: m; likewise for an object's position in the structure frame.
        vocabulary: the number of known word ids, including 0.
    """

    width: int = 128
    layers: int = 4
    heads: int = 4
    feed_forward: int = 384
    points: int = 128
    point_width: int = 48
    max_objects: int = 12
    nouns: tuple[str, ...] = NOUNS
    frame_center: tuple[float, float, float] = (0.45, 0.0, 0.0)
    frame_scale: tuple[float, float, float] = (0.09, 0.19, 0.05)
    object_center: tuple[float, float, float] = (-0.015, 0.0, 0.06)
    object_scale: tuple[float, float, float] = (0.065, 0.10, 0.05)
    vocabulary: int = VOCABULARY


@dataclass(frozen=True)
class Condition:
    """The conditioning input of a scene: encoded once, used for every sample and at every step.

    Attributes:
        objects: (B, N, W_o) object encodings.
        language: (B, 5, W_l) language encodings.
        language_mask: (B, 5) bool, which of them are present.
        spoken: (B,) bool, whether the language is one sentence rather than word tokens.
        present: (B, N) bool, which objects are present.
    """

    objects: Tensor
    language: Tensor
    language_mask: Tensor
    spoken: Tensor
    present: Tensor

    def repeat(self, count: int) -> Condition:
        """Repeat each scene `count` times in a row: (B * count, ...)."""
        return Condition(*(value.repeat_interleave(count, dim=0) for value in self.__dict__.values()))

    def __getitem__(self, rows: Tensor) -> Condition:
        """Select some of the scenes, or all in another order."""
        return Condition(*(value[rows] for value in self.__dict__.values()))

    @property
    def there(self) -> Tensor:
        """Return which of the language, structure-frame and object tokens are present, (B, 5 + 1 + N) bool."""
        return torch.cat((self.language_mask, torch.ones_like(self.present[:, :1]), self.present), dim=1)


class PoseBackbone(Checkpointed):
    """Encoders of objects and language, and the tokens made from them; each model adds its own transformer.

    Language is either up to five word tokens or one sentence embedding. Besides its cloud, an object has its noun as an
    input, if the scene provides it and the table setting has a place for it: a hundred noisy points hardly distinguish
    a fork from a spoon. The paper has no such input; noun 0 is "unknown".

    Args:
        config: sizes and scales.
        language_extra, object_extra: number of additional inputs of a language token, and of a structure-frame or
            object token, such as the paper's h_time in the diffusion model.
    """

    def __init__(self, config: BackboneConfig, language_extra: int = 0, object_extra: int = 0) -> None:
        super().__init__()
        self.config: Any = config
        width = config.width
        self.point_encoder = PointEncoder(3, config.point_width, config.point_width)
        self.outline = nn.Sequential(nn.Linear(OUTLINE_FEATURES, 64), nn.GELU(), nn.Linear(64, 64))
        self.noun = nn.Embedding(1 + len(config.nouns), 32)
        self.merge_object = nn.Sequential(nn.GELU(), nn.Linear(config.point_width + 64 + 32, OBJECT_WIDTH))
        self.word = nn.Embedding(config.vocabulary, _LANGUAGE_WIDTH)
        self.sentence = nn.Linear(SENTENCE_WIDTH, _LANGUAGE_WIDTH)
        self.pose = nn.Sequential(nn.Linear(POSE, 128), nn.GELU(), nn.Linear(128, _POSE_WIDTH))
        self.frame_query = nn.Parameter(nn.init.normal_(torch.empty(OBJECT_WIDTH), std=0.02))
        self.slot = nn.Embedding(WORD_TOKENS, _PLACE_WIDTH)
        # One embedding for the frame and one for each place, for every number of objects: how far round a ring the
        # third place lies depends on the number of objects.
        self.place = nn.Embedding((config.max_objects + 1) ** 2, _PLACE_WIDTH)
        self.modality = nn.Embedding(4, _KIND_WIDTH)  # word, sentence, structure frame, object
        # The paper's concatenation along the feature dimension (section IV.B), projected to one width.
        self.join_language = nn.Linear(_LANGUAGE_WIDTH + _PLACE_WIDTH + _KIND_WIDTH + language_extra, width)
        self.join_object = nn.Linear(OBJECT_WIDTH + _POSE_WIDTH + _PLACE_WIDTH + _KIND_WIDTH + object_extra, width)
        self.language_extra, self.object_extra = language_extra, object_extra

    def noun_ids(self, categories: Sequence[str]) -> list[int]:
        """Return the noun id of each category; 0 for a category that the network does not know."""
        return noun_ids(categories, self.config.nouns)

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
            clouds: (B, N, P, 3) world frame, metres; P >= `config.points`: the point encoder uses that many first
                points, the outline features use all.
            present: (B, N) bool.
            nouns: (B, N) noun ids (see `noun_ids`).
            words: (B, 5) word ids, 0 where unspecified; or
            sentence: (B, 384) embeddings. If both are given, a row of zeros means "use the words".
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
        language = torch.zeros(batch, WORD_TOKENS, _LANGUAGE_WIDTH, device=device)
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

    def language_tokens(self, condition: Condition, extra: Tensor | None = None) -> Tensor:
        """Return the language tokens (B, 5, W); `extra` is (B, 1 or 5, `language_extra`), zeros if `None`."""
        batch = len(condition.present)
        words, sentence, _, _ = self.modality.weight
        spoken = torch.where(condition.spoken[:, None], sentence, words)[:, None]  # (B, 1, W_k)
        slots = self.slot.weight.expand(batch, -1, -1)
        if extra is None:
            extra = slots.new_zeros(1, 1, self.language_extra)
        return self.join_language(
            torch.cat((condition.language, slots, *_spread((spoken, extra), batch, WORD_TOKENS)), dim=-1)
        )

    def object_tokens(self, condition: Condition, state: Tensor | None = None, extra: Tensor | None = None) -> Tensor:
        """Return the tokens (B, 1 + N, W) of the structure frame and the objects.

        Args:
            condition: the scenes.
            state: (B, 1 + N, 9) a pose for each, or `None` if none is known.
            extra: (B, 1 or 1 + N, `object_extra`); zeros if `None`.
        """
        batch, count = condition.present.shape
        _, _, frame, thing = self.modality.weight
        objects = self.objects(condition)
        numbers = torch.arange(1 + count, device=objects.device) + condition.present.sum(1, keepdim=True) * (
            self.config.max_objects + 1
        )  # (B, 1 + N)
        kind = torch.cat((frame[None], thing.expand(count, -1)))  # (1 + N, W_k)
        pose = objects.new_zeros(1, 1, _POSE_WIDTH) if state is None else self.pose(state)
        if extra is None:
            extra = objects.new_zeros(1, 1, self.object_extra)
        pose, kind, extra = _spread((pose, kind, extra), batch, 1 + count)
        return self.join_object(torch.cat((objects, pose, self.place(numbers), kind, extra), dim=-1))

    def objects(self, condition: Condition) -> Tensor:
        """Return the encodings of the structure frame and each object, without poses: (B, 1 + N, W_o)."""
        return torch.cat((self.frame_query.expand(len(condition.present), 1, -1), condition.objects), dim=1)

    def encode_state(self, world_from_structure: Tensor, position: Tensor, turn: Tensor) -> Tensor:
        """Encode poses as a clean state (B, 1 + N, 9).

        Args:
            world_from_structure: (B, 4, 4).
            position: (B, N, 3) goal of the mean of each object's points, world frame, metres.
            turn: (B, N, 3, 3) rotation of each object relative to its observed pose, world frame.
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
        """Decode a state: world_from_structure (B, 4, 4), position (B, N, 3), turn (B, N, 3, 3); inverts
        `encode_state`.
        """
        like = state
        rotation = rotation_from_6d(state[:, 0, 3:])
        origin = state[:, 0, :3] * like.new_tensor(self.config.frame_scale) + like.new_tensor(self.config.frame_center)
        frame = torch.eye(4, device=state.device, dtype=state.dtype).repeat(len(state), 1, 1)
        frame[:, :3, :3], frame[:, :3, 3] = rotation, origin
        scale, center = like.new_tensor(self.config.object_scale), like.new_tensor(self.config.object_center)
        local = state[:, 1:, :3] * scale + center
        position = torch.einsum("bij,bnj->bni", rotation, local) + origin[:, None]
        return frame, position, rotation_from_6d(state[:, 1:, 3:])

    @classmethod
    def fake_input(cls, batch: int, objects: int, generator: torch.Generator) -> dict[str, Tensor]:
        """Return random scenes as `condition` takes them (see `encoders.fake_scenes`)."""
        return fake_scenes(batch, objects, generator)

    def answer_shape(self, given: Mapping[str, Tensor]) -> tuple[int, ...]:
        """Return the shape of the result of `try_out` for a fake input: the state, (B, 1 + N, 9)."""
        batch, count = given["present"].shape
        return batch, 1 + count, POSE


def encoder_stack(config: BackboneConfig, layers: int | None = None) -> nn.TransformerEncoder:
    """Return the transformer over a sequence of tokens; `layers` replaces the number of layers of the config."""
    sizes = (config.width, config.heads, config.feed_forward)
    layer = nn.TransformerEncoderLayer(*sizes, dropout=0.0, activation="relu", batch_first=True, norm_first=True)
    return nn.TransformerEncoder(layer, layers or config.layers, enable_nested_tensor=False)


def readout(config: BackboneConfig, numbers: int) -> nn.Sequential:
    """Return the layers that map a transformer's output token to `numbers` numbers."""
    return nn.Sequential(nn.LayerNorm(config.width), nn.Linear(config.width, numbers))


def _spread(values: Sequence[Tensor], batch: int, length: int) -> list[Tensor]:
    """Broadcast each value, (B or 1, L or 1, W) or (L, W), to (B, L, W)."""
    return [value.expand(batch, length, value.shape[-1]) for value in values]
