"""The tool: perceive, imagine, rank, plan, build and report."""

__version__ = "0.1.0"
