"""`python -m agent`: the same as the command `structagent`."""

import sys

from agent.runtime.stdio import end_when_nobody_reads


def main() -> None:
    """Runs the command line; it ends quietly when nobody reads its output any more, as in `structagent ... | head`."""
    end_when_nobody_reads()
    try:
        _command_line()
    finally:
        for stream in (sys.stdout, sys.stderr):
            stream.flush()  # here, because what goes wrong after this is told as a defect of the interpreter


def _command_line() -> None:
    """Runs the command line; where its own packages are missing or broken, says so, and still knows the doctor."""
    try:
        from agent.cli.app import main as command_line
    except Exception as error:  # a broken package raises anything
        if sys.argv[1:2] == ["doctor"]:
            from agent.diagnostics.doctor import main as examine

            examine()
        reason = " ".join(str(error).split()) or type(error).__name__
        print(f"structagent: cannot start: {reason}; `structagent doctor` names what would mend it", file=sys.stderr)
        sys.exit(6)
    command_line()


if __name__ == "__main__":
    main()
