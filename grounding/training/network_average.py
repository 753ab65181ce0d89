"""Average goal networks: `python -m grounding.training.network_average DIR DIR ... --out DIR --difference-to embedding`.

Networks that were trained further from one ancestor, on other tasks or in another order, make fewer mistakes together in
one than each alone (Wortsman et al., "Model soups", 2022).
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from grounding.goal_network.decoder import GoalDecoder
from grounding.goal_network.writer import NetworkWriter
from grounding.parsers.sentence_encoder import SentenceEncoder
from grounding.training.goal_network import GoalNetwork
from grounding.training.goal_reader import BITS, save


def average(folders: Sequence[Path], encoder: SentenceEncoder) -> GoalNetwork:
    """Return the network whose weights are the means of those of some networks.

    Args:
        folders: of the networks.
        encoder: the sentence encoder.

    Raises:
        GoalNetworkError: for weights that cannot be used.
    """
    states = [NetworkWriter.from_pretrained(encoder, folder).decoder.state for folder in folders]
    mean = {name: np.mean([state[name] for state in states], axis=0, dtype=np.float32) for name in states[0]}
    return GoalNetwork.of(GoalDecoder(mean))


def main() -> None:
    """Average networks and write the result; its steps are those of the first one."""
    parser = argparse.ArgumentParser(description="Average the weights of goal networks.")
    parser.add_argument("folders", nargs="+", type=Path, metavar="DIR", help="folders of the networks")
    parser.add_argument("--out", required=True, type=Path, metavar="DIR", help="folder for the average")
    parser.add_argument("--difference-to", choices=sorted(BITS), help="store the difference to a shipped network only")
    given = parser.parse_args()
    encoder = SentenceEncoder()
    steps = json.loads((given.folders[0] / "config.json").read_text(encoding="utf-8"))["steps"]
    save(average(given.folders, encoder), encoder, given.out, steps, given.difference_to)


if __name__ == "__main__":
    main()
