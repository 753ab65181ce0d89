"""Run the command `structagent` as `python -m agent`."""

import sys

from agent.runtime.interruption import (
    INTERRUPTED,
    handle_interruptions,
    ignore_further_interruptions,
    keep_exit_code,
)

handle_interruptions()  # before anything else is imported


def main() -> None:
    """Run the command line; end quietly when its output is no longer read, as in `structagent ... | head`."""
    try:
        from agent.runtime.stdio import end_when_nobody_reads

        end_when_nobody_reads()
        _command_line()
        keep_exit_code(0)
    except KeyboardInterrupt:  # before the command line could take it
        ignore_further_interruptions()
        print("structagent: interrupted", file=sys.stderr)
        keep_exit_code(INTERRUPTED)
        sys.exit(INTERRUPTED)
    except SystemExit as ended:
        keep_exit_code(ended.code)
        raise
    finally:
        ignore_further_interruptions()
        for stream in (sys.stdout, sys.stderr):
            stream.flush()  # here, because a later failure would be reported as a defect of the interpreter


def _command_line() -> None:
    """Run the command line; if packages are missing or broken, say so, but still run the doctor."""
    try:
        from agent.cli.app import main as command_line
    except Exception as error:  # a broken package raises anything
        if sys.argv[1:2] == ["doctor"]:
            from agent.diagnostics.doctor import main as examine

            examine()
        reason = " ".join(str(error).split()) or type(error).__name__
        print(f"structagent: cannot start: {reason}; `structagent doctor` suggests a repair", file=sys.stderr)
        sys.exit(6)
    command_line()


if __name__ == "__main__":
    main()
