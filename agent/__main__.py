"""`python -m agent`: the same as the command `structagent`."""

from agent.cli import main

main()
