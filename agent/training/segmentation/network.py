"""Define the segmentation network in torch: a small U-Net that works at half the input's resolution.

It runs in numpy outside training (`agent.segmentation_network.network`); a test holds both together.
"""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import torch
from safetensors import SafetensorError
from safetensors.torch import load_file, save
from torch import nn
from torch.nn import functional

from agent.segmentation_network.features import CHANNELS
from agent.segmentation_network.network import KIND, OUTPUTS
from grounding.atomic_files import write_all_whole
from grounding.untrusted_files import check_weights
from structdiffusion.limits import WEIGHTS_BYTES
from structdiffusion.models.checkpoint import CONFIG_NAME, WEIGHTS_NAME, Checkpointed, CheckpointError


@dataclass(frozen=True)
class SegmentationConfig:
    """The sizes of the network.

    Attributes:
        widths: channels at a half, a quarter, an eighth and a sixteenth of the input's resolution.
    """

    widths: tuple[int, ...] = (48, 96, 144, 192)


class Block(nn.Sequential):
    """A convolution, batch normalisation, and ReLU."""

    def __init__(self, inner: int, outer: int, size: int = 3, stride: int = 1) -> None:
        super().__init__(
            nn.Conv2d(inner, outer, size, stride, size // 2, bias=False), nn.BatchNorm2d(outer), nn.ReLU(inplace=True)
        )


class SegmentationNetwork(Checkpointed):
    """The network: for every pixel a class, a vote for the object's centre, and how sure it is of it."""

    kind = KIND
    Config = SegmentationConfig

    def __init__(self, config: SegmentationConfig) -> None:
        super().__init__()
        self.config = config
        widths = config.widths
        self.down = nn.ModuleList(
            nn.Sequential(Block(inner, outer, stride=stride), Block(outer, outer))
            for inner, outer, stride in zip((4 * CHANNELS, *widths), widths, (1, 2, 2, 2), strict=False)
        )
        self.up = nn.ModuleList(
            nn.Sequential(Block(below + beside, beside, 1), Block(beside, beside))
            for below, beside in zip(widths[:0:-1], widths[-2::-1], strict=True)
        )
        self.head = nn.Conv2d(widths[0], 4 * OUTPUTS, 1)

    def forward(self, maps: torch.Tensor) -> torch.Tensor:
        """Return the outputs (B, OUTPUTS, H, W) of inputs (B, CHANNELS, H, W); H and W are even."""
        levels = []
        state = functional.pixel_unshuffle(maps, 2)
        for block in self.down:
            state = block(state)
            levels.append(state)
        for block, beside in zip(self.up, levels[-2::-1], strict=True):
            larger = functional.interpolate(state, scale_factor=2.0, mode="nearest")
            state = block(torch.cat((larger[..., : beside.shape[2], : beside.shape[3]], beside), dim=1))
        return functional.pixel_shuffle(self.head(state), 2)

    def save_pretrained(self, folder: str | Path) -> None:
        """Write config and weights (half precision) as they are used: normalisation is part of the convolutions."""
        folder = Path(folder)
        weights: dict[str, torch.Tensor] = {}
        for name, module in self.named_modules():
            if isinstance(module, Block):
                weights |= {f"{name}.{key}": value for key, value in _folded(module).items()}
        head: Any = self.head
        weights |= {"head.weight": head.weight.detach(), "head.bias": head.bias.detach()}
        config = json.dumps({"kind": self.kind, **asdict(self.config)}, indent=2) + "\n"
        stored = {name: value.half().contiguous().cpu() for name, value in weights.items()}
        write_all_whole(folder, {CONFIG_NAME: config, WEIGHTS_NAME: save(stored)})

    @torch.no_grad()
    def start_from(self, folder: Path, maps: torch.Tensor) -> None:
        """Take the weights of a network that was written by `save_pretrained`, so that training can go on.

        Normalisation is part of its convolutions. It is taken out again with the statistics of inputs, so that the
        network says of them, while it is trained, what the other one does.

        Args:
            folder: of that network.
            maps: (B, CHANNELS, H, W) inputs as they are trained on.

        Raises:
            CheckpointError: for files that are missing, or are no network of the same sizes.
        """
        try:
            check_weights(folder / WEIGHTS_NAME, WEIGHTS_BYTES)
            state = load_file(folder / WEIGHTS_NAME)
            for name, module in self.named_modules():
                if isinstance(module, Block):
                    convolution, normalisation = _layers(module)
                    convolution.weight.copy_(state[f"{name}.weight"])
                    normalisation.bias.copy_(state[f"{name}.bias"])
            head: Any = self.head
            head.weight.copy_(state["head.weight"])
            head.bias.copy_(state["head.bias"])
        except (OSError, ValueError, SafetensorError, KeyError, RuntimeError) as error:
            raise CheckpointError(f"{str(folder)!r} holds no segmentation network to start from: {error}") from error
        blocks = [module for module in self.modules() if isinstance(module, Block)]
        hooks = [block[1].register_forward_pre_hook(_normalise_alike) for block in blocks]
        self.eval()(maps)
        for hook in hooks:
            hook.remove()


def _normalise_alike(normalisation: Any, given: tuple[torch.Tensor]) -> None:
    """Make a normalisation, whose bias is what it has to add, the identity beside that for what it is given."""
    mean, variance = given[0].mean(dim=(0, 2, 3)), given[0].var(dim=(0, 2, 3))
    normalisation.running_mean.copy_(mean)
    normalisation.running_var.copy_(variance)
    normalisation.weight.copy_(torch.sqrt(variance + normalisation.eps))
    normalisation.bias.add_(mean)


def _layers(block: Block) -> tuple[Any, Any]:
    """Return the convolution and the normalisation of a block, which has a bias and running means."""
    return block[0], block[1]


@torch.no_grad()
def _folded(block: Block) -> dict[str, torch.Tensor]:
    """Return the weight and bias of a convolution that does what the two layers of a block do."""
    convolution, normalisation = _layers(block)
    scale = normalisation.weight / torch.sqrt(normalisation.running_var + normalisation.eps)
    return {
        "weight": convolution.weight * scale[:, None, None, None],
        "bias": normalisation.bias - normalisation.running_mean * scale,
    }
