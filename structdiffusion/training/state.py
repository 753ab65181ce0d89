"""The state of a training run: model, optimiser, averaged weights and step; it is saved and resumed."""

from __future__ import annotations

import io
from pathlib import Path
from pickle import UnpicklingError
from typing import Any

import torch

from grounding.atomic_files import write_whole
from structdiffusion.models.checkpoint import Checkpointed, CheckpointError

STATE_NAME = "training_state.pt"


class TrainingState:
    """A model in training.

    Args:
        model: on its device.
        learning_rate: of the first step.
        weight_decay: of AdamW.

    Attributes:
        step: the number of steps so far, including earlier sessions.
        seconds: that they took.
    """

    def __init__(self, model: Checkpointed, learning_rate: float, weight_decay: float) -> None:
        self.model = model
        self.optimizer = torch.optim.AdamW(model.parameters(), lr=learning_rate, weight_decay=weight_decay, fused=True)
        self.average = {name: tensor.detach().clone() for name, tensor in model.state_dict().items()}
        self.step, self.seconds = 0, 0.0

    @classmethod
    def resumed(
        cls, model: Checkpointed, learning_rate: float, weight_decay: float, folder: Path, device: torch.device
    ) -> TrainingState:
        """Resume the run that was saved in `folder`, or begin a new one.

        Raises:
            CheckpointError: for a state that is torn, or that of another network.
        """
        state = cls(model, learning_rate, weight_decay)
        state._load(folder / STATE_NAME, device)
        return state

    def _load(self, path: Path, device: torch.device) -> None:
        if not path.is_file():
            return
        try:
            state = torch.load(path, map_location=device, weights_only=True)
            self.model.load_state_dict(state["model"])
            self.optimizer.load_state_dict(state["optimizer"])
            self.average, self.step, self.seconds = state["average"], state["step"], state["seconds"]
        except (RuntimeError, ValueError, KeyError, TypeError, EOFError, UnpicklingError) as error:
            why = f"it is torn, or not that of a {self.model.kind} network like this one"
            raise CheckpointError(f"{path} cannot be resumed: {why}; choose another folder") from error

    def optimise(self, loss: torch.Tensor, learning_rate: float, clip: float, average: float) -> None:
        """Take one step down the gradient of a loss.

        Args:
            loss: a scalar.
            learning_rate: of this step.
            clip: largest gradient norm.
            average: decay of the moving average of the weights.
        """
        for group in self.optimizer.param_groups:
            group["lr"] = learning_rate
        self.optimizer.zero_grad(set_to_none=True)
        loss.backward()
        torch.nn.utils.clip_grad_norm_(self.model.parameters(), clip)
        self.optimizer.step()
        self.step += 1
        self._update_average(min(average, (self.step + 1) / (self.step + 10)))  # the first steps are forgotten fast

    @torch.no_grad()
    def _update_average(self, keep: float) -> None:
        for name, tensor in self.model.state_dict().items():
            mean = self.average[name]
            mean.lerp_(tensor, 1 - keep) if tensor.is_floating_point() else mean.copy_(tensor)

    def save(self, folder: Path) -> None:
        """Write the state, after everything that it counts as done: a run that is killed before repeats those steps."""
        state: dict[str, Any] = {
            "model": self.model.state_dict(),
            "optimizer": self.optimizer.state_dict(),
            "average": self.average,
        }
        state |= {"step": self.step, "seconds": self.seconds}
        content = io.BytesIO()
        torch.save(state, content)
        write_whole(folder / STATE_NAME, content.getvalue())

    def save_weights(self, folder: Path) -> None:
        """Write the averaged weights as a checkpoint of the model."""
        trained = {name: tensor.clone() for name, tensor in self.model.state_dict().items()}
        self.model.load_state_dict(self.average)
        self.model.save_pretrained(folder)
        self.model.load_state_dict(trained)
