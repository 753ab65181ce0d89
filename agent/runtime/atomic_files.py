"""Replace files completely or not at all: the functions of `grounding.atomic_files`, which every package imports."""

from grounding.atomic_files import OpenFolder, opened, write_all_whole, write_whole

__all__ = ["OpenFolder", "opened", "write_all_whole", "write_whole"]
