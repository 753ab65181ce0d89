"""Check, whenever networks are loaded, that they are the ones that their cards describe."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from agent.errors import BadInput, NotVerified
from agent.model_cards.card_text import checked_facts
from agent.model_cards.catalogue import CONFIG, SHIPPED, WEIGHTS, Network
from structdiffusion.planners.registry import networks_of

MATCHES, NO_CARD = "as on its card", "no card"


@dataclass(frozen=True)
class Provenance:
    """The provenance of a checkpoint's files.

    Attributes:
        sha256: file -> checksum.
        card: `MATCHES`, `NO_CARD`, or a sentence that says what is wrong.
    """

    sha256: Mapping[str, str]
    card: str

    @property
    def verified(self) -> bool:
        """Return whether nothing contradicts the card; a network that was just trained has no card and counts as
        verified.
        """
        return self.card in (MATCHES, NO_CARD)


def provenance_of(model: str, weights: Path | None) -> dict[str, Provenance]:
    """Return the provenance of each network of a planner; networks with missing files are left out.

    Args:
        model: the name of the planner.
        weights: the folder of its checkpoints, or `None` for those shipped.
    """
    return provenance(networks_of(model), weights)


def provenance(names: Iterable[str], weights: Path | None) -> dict[str, Provenance]:
    """Return the same as `provenance_of` for networks given by name."""
    folders = {name: (SHIPPED if weights is None else Path(weights)) / name for name in names}
    return {
        name: _provenance(name, folder)
        for name, folder in folders.items()
        if (folder / CONFIG).is_file() and (folder / WEIGHTS).is_file()
    }


def require_cards(found: Mapping[str, Provenance]) -> None:
    """Refuse networks that differ from their cards.

    Raises:
        NotVerified: with the name of the first such network.
    """
    for one in found.values():
        if not one.verified:
            raise NotVerified(
                f"{one.card}; if they are yours, `structagent models card` writes the card anew, and run, chat, "
                "batch and evaluate take --allow-unverified"
            )


def _provenance(name: str, folder: Path) -> Provenance:
    found: dict[str, dict[str, Any]] = {}
    for file in (CONFIG, WEIGHTS):
        content = (folder / file).read_bytes()
        found[file] = {"bytes": len(content), "sha256": hashlib.sha256(content).hexdigest()}
    sums = {file: about["sha256"] for file, about in found.items()}
    network = Network(name, name, folder)
    if not network.facts_path.exists():
        return Provenance(sums, NO_CARD)
    try:
        on_card = checked_facts(network)["files"]
    except (BadInput, OSError) as error:
        return Provenance(sums, f"the card of the weights in {folder} cannot be used: {error}")
    for file, about in found.items():
        if on_card.get(file) != about:
            return Provenance(sums, f"{folder / file} differs from its model card: its SHA-256 is {sums[file][:12]}")
    return Provenance(sums, MATCHES)
