"""Propose goal poses for objects that are known as point clouds.

python docs/examples/propose_from_clouds.py ["put the cups in a line"] [--count 64] [--seed 0]
"""

import argparse

import numpy as np
import structagent


def cylinder(x: float, y: float, radius: float, height: float, rng: np.random.Generator) -> np.ndarray:
    """What a camera above sees of a cylinder that stands at (x, y): 500 points (P, 3) of its top and its front,
    metres.
    """
    angle, distance = rng.uniform(0, 2 * np.pi, 300), radius * np.sqrt(rng.uniform(0, 1, 300))
    top = np.column_stack((distance * np.cos(angle), distance * np.sin(angle), np.full(300, height)))
    angle = rng.uniform(np.pi / 2, 3 * np.pi / 2, 200)  # the side toward the robot
    side = np.column_stack((radius * np.cos(angle), radius * np.sin(angle), rng.uniform(0, height, 200)))
    return np.concatenate((top, side)) + (x, y, 0.0)


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("instruction", nargs="?", default="put the cups in a small circle on the left")
    options.add_argument("--count", type=int, default=64, help="how many arrangements are proposed")
    options.add_argument("--seed", type=int, default=0)
    given = options.parse_args()

    rng = np.random.default_rng(0)
    objects = [("cup", 0.30, -0.30, 0.04, 0.09), ("cup", 0.55, -0.15, 0.04, 0.09), ("cup", 0.40, 0.05, 0.04, 0.09),
               ("bowl", 0.60, 0.30, 0.07, 0.05)]  # fmt: skip
    clouds = [cylinder(x, y, radius, height, rng) for _, x, y, radius, height in objects]
    names = [name for name, *_ in objects]

    try:
        proposals = structagent.propose(clouds, given.instruction, names=names, count=given.count, seed=given.seed)
    except structagent.StructagentError as error:
        raise SystemExit(f"{error} (exit code {error.exit_code})") from None

    print(f"understood: {proposals.spec}")
    for note in proposals.notes:
        print(f"note: {note}")
    print(f"{len(proposals)} of {proposals.proposed} proposals are valid; the best scores {proposals.best.score:.2f}")
    before, after = proposals.scene.clouds, proposals.clouds_after()
    for index, name in enumerate(proposals.scene.names):
        (x, y), (u, v) = before[index].mean(axis=0)[:2], after[index].mean(axis=0)[:2]
        goes = f"goes to x {u:.2f}, y {v:.2f}" if index in proposals.moved else "stays"
        print(f"{name:<6} at x {x:.2f}, y {y:.2f} {goes}")


if __name__ == "__main__":
    main()
