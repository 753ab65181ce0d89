"""The network in NumPy computes what PyTorch's layers do, and with the published weights knows photographs."""

from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest
import torch
from PIL import Image
from torch.nn import functional

from agent.perception.nouns.efficientnet_lite import EfficientNetLite
from agent.perception.nouns.recognition import _network, nouns_available
from tests.agent.perception.nouns.network_weights import STAGES, random_tensors


def reference(tensors: dict[str, torch.Tensor], picture: np.ndarray) -> torch.Tensor:
    """The network in PyTorch, as published: no folding, "same" padding as TensorFlow has it."""

    def layer(values, name, norm, stride=1, groups=1, active=True):
        weight = tensors[f"{name}.weight"]
        kernel, side = weight.shape[-1], values.shape[-1]
        total = max((-(-side // stride) - 1) * stride + kernel - side, 0)
        values = functional.pad(values, (total // 2, total - total // 2) * 2)
        values = functional.conv2d(values, weight, stride=stride, groups=groups)
        statistics = (tensors[f"{norm}.{what}"] for what in ("running_mean", "running_var", "weight", "bias"))
        values = functional.batch_norm(values, *statistics, eps=1e-3)
        return functional.relu6(values) if active else values

    values = layer(torch.tensor((picture - 127.0) / 128.0).float().permute(2, 0, 1)[None], "_conv_stem", "_bn0", 2)
    number = 0
    for _, stride, expansion, _, repeats in STAGES:
        for repeat in range(repeats):
            name, before = f"_blocks.{number}.", values
            if expansion > 1:
                values = layer(values, f"{name}_expand_conv", f"{name}_bn0")
            step = stride if repeat == 0 else 1
            values = layer(values, f"{name}_depthwise_conv", f"{name}_bn1", step, values.shape[1])
            values = layer(values, f"{name}_project_conv", f"{name}_bn2", active=False)
            if repeat > 0:
                values = values + before
            number += 1
    values = layer(values, "_conv_head", "_bn1").mean(dim=(2, 3))
    return functional.linear(values, tensors["_fc.weight"], tensors["_fc.bias"])[0]


def test_it_computes_what_the_layers_of_pytorch_compute():
    tensors, picture = random_tensors(), np.random.default_rng(1).uniform(0, 255, (224, 224, 3))
    with torch.inference_mode():
        expected = reference({name: torch.tensor(value) for name, value in tensors.items()}, picture).numpy()
    assert np.ptp(expected) > 1.0
    assert np.abs(EfficientNetLite(tensors).logits(picture) - expected).max() < 1e-4


@pytest.mark.skipif(not nouns_available(), reason="the weights (extra nouns) are not installed")
@pytest.mark.parametrize(("name", "classes"), [("china.jpg", {698, 442}), ("flower.jpg", {985})])
def test_it_knows_what_photographs_show(name, classes):
    folder = Path(find_spec("sklearn").submodule_search_locations[0]) / "datasets" / "images"
    picture = Image.open(folder / name).convert("RGB")
    side = min(picture.size)
    left, top = (picture.width - side) // 2, (picture.height - side) // 2
    square = picture.crop((left, top, left + side, top + side)).resize((224, 224), Image.Resampling.BICUBIC)
    logits = _network().logits(np.asarray(square))
    best = logits.argsort()[::-1][: len(classes)]
    assert set(best.tolist()) == classes  # palace and bell cote; daisy
    share = np.exp(logits - logits.max())
    assert 0.2 < share[best].sum() / share.sum() < 0.9
