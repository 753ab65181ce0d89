"""Random weights of EfficientNet-Lite0, under the names of the published ones."""

import numpy as np

# Kernel, stride, expansion, channels out, repeats.
STAGES = (
    (3, 1, 1, 16, 1), (3, 2, 6, 24, 2), (5, 2, 6, 40, 2), (3, 2, 6, 80, 3), (5, 1, 6, 112, 3), (5, 2, 6, 192, 4),
    (3, 1, 6, 320, 1),
)  # fmt: skip


def random_tensors(seed: int = 0) -> dict[str, np.ndarray]:
    """Return weights that keep the size of the values from layer to layer."""
    rng = np.random.default_rng(seed)
    tensors: dict[str, np.ndarray] = {}

    def convolution(name: str, norm: str, out: int, into: int, kernel: int) -> None:
        deviation = (2.0 / (into * kernel * kernel)) ** 0.5
        tensors[f"{name}.weight"] = rng.normal(0.0, deviation, (out, into, kernel, kernel)).astype(np.float32)
        ranges = {"weight": (0.7, 1.3), "bias": (-0.2, 0.6), "running_mean": (-0.3, 0.3), "running_var": (0.5, 1.5)}
        for what, (low, high) in ranges.items():
            tensors[f"{norm}.{what}"] = rng.uniform(low, high, out).astype(np.float32)

    convolution("_conv_stem", "_bn0", 32, 3, 3)
    channels, number = 32, 0
    for kernel, _, expansion, out, repeats in STAGES:
        for _ in range(repeats):
            prefix, inner = f"_blocks.{number}.", channels * expansion
            if expansion > 1:
                convolution(f"{prefix}_expand_conv", f"{prefix}_bn0", inner, channels, 1)
            convolution(f"{prefix}_depthwise_conv", f"{prefix}_bn1", inner, 1, kernel)
            convolution(f"{prefix}_project_conv", f"{prefix}_bn2", out, inner, 1)
            channels, number = out, number + 1
    convolution("_conv_head", "_bn1", 1280, channels, 1)
    tensors["_fc.weight"] = rng.normal(0.0, 0.05, (1000, 1280)).astype(np.float32)
    tensors["_fc.bias"] = rng.normal(0.0, 0.1, 1000).astype(np.float32)
    return tensors
