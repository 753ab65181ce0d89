"""Look at a recorded table, carry an instruction out without the arm, and listen to what happens.

python docs/examples/run_recording.py [SCENE] [--instruction "put everything in a line"] [--model diffusion] [--seed 0]

SCENE is "example" (the recording that comes along), a scene file (.yaml), or a recording (.bag, .mcap, .ply, ...).
"""

import argparse

import structagent
from agent import events


def listen(event: object) -> None:
    """Print what happens, in the order in which it happens."""
    match event:
        case events.Parsed():
            print(f"understood: {event.spec}")
        case events.Perceived():
            print(f"seen: {', '.join(one.name for one in event.objects)}")
        case events.Noted():
            print(f"note: {event.message}")
        case events.Chosen():
            for goal in event.goals:
                x, y, _ = goal["position"]
                print(f"{goal['name']} goes to x {x:.2f}, y {y:.2f}")
        case events.Checked():
            print(f"tried in physics on {event.on}: {event.detail}")


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("scene", nargs="?", default="example")
    options.add_argument("--instruction", default="put everything in a small circle")
    options.add_argument("--model", default="diffusion", help="the planner")
    options.add_argument("--seed", type=int, default=0)
    given = options.parse_args()

    try:
        scene = structagent.load_scene(given.scene, seed=given.seed)
        for name, cloud in zip(scene.names, scene.clouds, strict=True):
            x, y, z = cloud.max(axis=0) - cloud.min(axis=0)
            print(f"{name}: {len(cloud)} points, {100 * x:.0f} by {100 * y:.0f} by {100 * z:.0f} cm")
        result = structagent.run(
            given.instruction, scene=given.scene, model=given.model, seed=given.seed, execute=False, on_event=listen
        )
    except structagent.StructagentError as error:
        raise SystemExit(f"{error} (exit code {error.exit_code})") from None
    print("it stands" if result.success else f"it does not stand: {result.message}")
    raise SystemExit(result.exit_code)


if __name__ == "__main__":
    main()
