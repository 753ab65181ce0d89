"""List the networks and the planners made of them, without importing any network."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import grounding
import structdiffusion
from agent.errors import BadInput, UsageError
from agent.segmentation_network import WEIGHTS as SEGMENTATION
from grounding.untrusted_files import read_json
from structdiffusion.planners.registry import PLANNERS, networks_of

SHIPPED = Path(structdiffusion.__file__).parent / "weights"
PARSERS = Path(grounding.__file__).parent / "weights"
CONFIG, WEIGHTS = "config.json", "model.safetensors"
# What each family of networks does, in a table's few words; more is in about/FAMILY.md.
FAMILIES: Mapping[str, str] = {
    "diffusion": "proposes arrangements",
    "cvae": "proposes arrangements (baseline)",
    "structformer": "proposes arrangements of one shape (baseline)",
    "structure": "judges whether an arrangement is what was asked for",
    "collision": "judges whether two objects intersect",
    "outcome": "judges whether an arrangement will stand as asked",
    "strokes": "reads the strokes of an example",
    "embedding": "reads instructions",
    "goals": "proposes goals for what is said",
    "verifier": "judges whether a goal holds all that was said",
    "llm": "reads instructions: adapter of a language model",
    "segmentation": "tells objects apart in depth pictures",
}


@dataclass(frozen=True)
class Network:
    """A network whose weights are available.

    Attributes:
        name: the name that commands take.
        family: one of `FAMILIES`.
        folder: the folder of its files.
        files: their names; the last has the weights.
        card: the file name of its card, without the suffix.
    """

    name: str
    family: str
    folder: Path
    files: tuple[str, ...] = (CONFIG, WEIGHTS)
    card: str = "card"

    @property
    def facts_path(self) -> Path:
        """Return the path of the card as JSON, the only place where its facts are stored."""
        return self.folder / f"{self.card}.json"

    @property
    def text_path(self) -> Path:
        """Return the path of the Markdown card, which is generated from the facts."""
        return self.folder / f"{self.card}.md"


def networks(weights: Path | None = None) -> dict[str, Network]:
    """Return the shipped networks, or those in a folder of checkpoints, by name.

    Raises:
        BadInput: if the folder does not exist, has no checkpoint, or has a config of an unknown kind.
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
        found["goals"] = Network("goals", "goals", PARSERS / "goal_network")
        found["verifier"] = Network("verifier", "verifier", PARSERS / "verifier")
        found["llm"] = Network("llm", "llm", PARSERS, ("llm_adapter.safetensors",), "llm_card")
        found["segmentation"] = Network("segmentation", "segmentation", SEGMENTATION)
    return found


def network(name: str, weights: Path | None = None) -> Network:
    """Return the network with this name.

    Raises:
        UsageError: if no network has that name.
        BadInput: as `networks`.
    """
    found = networks(weights)
    if name not in found:
        raise UsageError(f"NAME cannot be {name!r}; networks here: {', '.join(found)}")
    return found[name]


def planners_of(name: str) -> list[str]:
    """List the planners that use a network."""
    return [planner for planner in PLANNERS if name in networks_of(planner)]


def _family(config: Path) -> str:
    try:
        kind = read_json(config)["kind"]
    except (ValueError, KeyError, TypeError) as error:
        raise BadInput(f'{config} is not the config of a network: it needs a JSON object with "kind"') from error
    if not isinstance(kind, str) or kind not in FAMILIES:
        raise BadInput(f"{config} has the kind {kind!r}; legal values: {', '.join(FAMILIES)}")
    return kind
