"""Average goal networks: `python -m grounding.training.network_average --out DIR DIR=SHARE DIR=SHARE`.

The average of a network and the one that it was trained from reads unseen texts better than either (docs/training.md).
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from safetensors.numpy import load_file

from grounding.atomic_files import write_all_whole
from grounding.goal_network.writer import base_arrays, base_of
from grounding.packed_weights import packed_bytes, unpacked


def average(shares: Mapping[Path, float], out: Path) -> None:
    """Write the weighted average of goal networks of one form, with the config of the first.

    Args:
        shares: folder of each network -> its share.
        out: folder for `model.safetensors` and `config.json`.

    Raises:
        ValueError: for shares that are not positive, or networks of different forms.
        GoalNetworkError: for a network whose base is another parser than the shipped one.
    """
    if not shares or min(shares.values()) <= 0.0:
        raise ValueError(f"the shares must be positive, not {', '.join(map(str, shares.values()))}")
    configs = [json.loads((folder / "config.json").read_text(encoding="utf-8")) for folder in shares]
    states = [
        unpacked(load_file(folder / "model.safetensors"), base_of(config))
        for folder, config in zip(shares, configs, strict=True)
    ]  # fmt: skip
    forms = {(tuple(config["keywords"]), frozenset(state)) for config, state in zip(configs, states, strict=True)}
    if len(forms) > 1:
        raise ValueError("the networks are of different forms")
    weights = np.array(list(shares.values())) / sum(shares.values())
    mean = {
        name: np.sum(
            [weight * state[name].astype(np.float32) for weight, state in zip(weights, states, strict=True)], axis=0
        ).astype(np.float32)
        for name in states[0]
    }
    config = (json.dumps(configs[0], indent=1) + "\n").encode()
    write_all_whole(out, {"model.safetensors": packed_bytes(mean, base_arrays()), "config.json": config})


def main() -> None:
    """Average networks; see the module."""
    parser = argparse.ArgumentParser(description="Average goal networks.")
    parser.add_argument("--out", required=True, type=Path, metavar="DIR", help="folder to write")
    parser.add_argument("networks", nargs="+", metavar="DIR=SHARE", help="folder of a network and its share")
    given = parser.parse_args()
    pairs = [each.rpartition("=") for each in given.networks]
    try:
        average({Path(folder): float(share) for folder, _, share in pairs}, given.out)
    except ValueError as error:
        parser.error(str(error))


if __name__ == "__main__":
    main()
