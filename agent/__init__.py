"""The tool: perceive, imagine, rank, plan, build and report."""
