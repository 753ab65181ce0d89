"""What training asks of a loss: batches drawn with a generator, to named terms."""

from __future__ import annotations

from collections.abc import Callable

import torch
from torch import Tensor

Loss = Callable[[torch.Generator], dict[str, Tensor]]
