"""Name the families of the benchmark of goals, in the order in which they are reported and their seeds count."""

GOAL_FAMILIES = (
    "two-structures", "structure-and-relation", "relations", "metric", "order", "new-shapes", "edges-and-groups",
    "single-objects",
)  # fmt: skip
# Of the closed loop: their scenes are built while somebody interferes.
LOOP_FAMILIES = ("flat-structure", "tower", "two-parts", "related", "order-or-lengths")
