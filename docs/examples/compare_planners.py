"""Measure how often two planners' arrangements stand, on the same simulated scenes.

python docs/examples/compare_planners.py [--models diffusion geometric] [--structures circle line] [--scenes 5]
[--workers 2]
"""

import argparse

import structagent


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--models", nargs="+", default=["diffusion", "geometric"], help="names of planners")
    options.add_argument("--structures", nargs="+", default=["circle", "line"])
    options.add_argument("--scenes", type=int, default=5, help="how many for each structure")
    options.add_argument("--count", type=int, default=64, help="arrangements that a planner proposes for each scene")
    options.add_argument("--workers", type=int, default=0, help="processes; 0 for this one alone")
    options.add_argument("--seed", type=int, default=0)
    given = options.parse_args()

    try:
        report = structagent.evaluate(
            given.models,
            structures=given.structures,
            scenes=given.scenes,
            seed=given.seed,
            count=given.count,
            workers=given.workers,
        )
    except structagent.StructagentError as error:
        raise SystemExit(f"{error} (exit code {error.exit_code})") from None

    print(report)
    for model in given.models:
        failures = {cause: number for cause, number in report.rate(model).failures.items() if number}
        print(f"{model}: {failures or 'no failures'}")
    print(f"the same by the command line: {report.command}")


if __name__ == "__main__":  # worker processes import this file
    main()
