"""Which networks there are, and which planner is made of which. Imports no network."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import grounding
import structdiffusion
from agent.errors import BadInput, UsageError
from structdiffusion.planners.registry import PLANNERS, networks_of

SHIPPED = Path(structdiffusion.__file__).parent / "weights"
PARSERS = Path(grounding.__file__).parent / "weights"
CONFIG, WEIGHTS = "config.json", "model.safetensors"
# What each family of networks does, in a table's few words; more is in about/FAMILY.md.
FAMILIES: Mapping[str, str] = {
    "diffusion": "imagines arrangements",
    "cvae": "imagines arrangements (baseline)",
    "structformer": "imagines arrangements of one shape (baseline)",
    "structure": "judges whether an arrangement is what was asked for",
    "collision": "judges whether two objects intersect",
    "embedding": "reads instructions",
    "llm": "reads instructions: adapter of a language model",
}


@dataclass(frozen=True)
class Network:
    """A network whose weights are there.

    Attributes:
        name: as commands take it.
        family: one of `FAMILIES`.
        folder: of its files.
        files: their names; the last has the weights.
        card: the name of its card, without its ending.
    """

    name: str
    family: str
    folder: Path
    files: tuple[str, ...] = (CONFIG, WEIGHTS)
    card: str = "card"

    @property
    def facts_path(self) -> Path:
        """The card as JSON: the one place that facts are written in."""
        return self.folder / f"{self.card}.json"

    @property
    def text_path(self) -> Path:
        """The card for people, made of the facts."""
        return self.folder / f"{self.card}.md"


def networks(weights: Path | None = None) -> dict[str, Network]:
    """All networks that come along, or those in a folder of checkpoints, by name.

    Raises:
        BadInput: when there is no such folder, it has no checkpoint, or a config of no known kind.
    """
    if weights is not None and not weights.is_dir():
        raise BadInput(f"there is no folder {weights} with checkpoints")
    folders = sorted(path.parent for path in (weights or SHIPPED).glob(f"*/{CONFIG}"))
    if not folders:
        raise BadInput(f"{weights} has no checkpoints; legal: a folder with NAME/{CONFIG} and NAME/{WEIGHTS}")
    found = {folder.name: Network(folder.name, _family(folder / CONFIG), folder) for folder in folders}
    order = list(FAMILIES)
    found = dict(sorted(found.items(), key=lambda entry: order.index(entry[1].family)))
    if weights is None:
        found["embedding"] = Network("embedding", "embedding", PARSERS, card="embedding_card")
        found["llm"] = Network("llm", "llm", PARSERS, ("llm_adapter.safetensors",), "llm_card")
    return found


def network(name: str, weights: Path | None = None) -> Network:
    """The network of a name.

    Raises:
        UsageError: when there is none of that name.
        BadInput: as `networks`.
    """
    found = networks(weights)
    if name not in found:
        raise UsageError(f"NAME cannot be {name!r}; networks here: {', '.join(found)}")
    return found[name]


def planners_of(name: str) -> list[str]:
    """The planners that a network is part of."""
    return [planner for planner in PLANNERS if name in networks_of(planner)]


def _family(config: Path) -> str:
    try:
        kind = json.loads(config.read_text())["kind"]
    except (ValueError, KeyError, TypeError, RecursionError) as error:
        raise BadInput(f'{config} is no config of a network: it needs a JSON object with "kind"') from error
    if not isinstance(kind, str) or kind not in FAMILIES:
        raise BadInput(f"{config} has the kind {kind!r}; legal values: {', '.join(FAMILIES)}")
    return kind
