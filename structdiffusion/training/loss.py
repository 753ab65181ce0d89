"""The interface of a training loss: draw a batch with a generator and return named terms."""

from __future__ import annotations

from collections.abc import Callable

import torch
from torch import Tensor

Loss = Callable[[torch.Generator], dict[str, Tensor]]
