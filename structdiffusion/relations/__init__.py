"""The relations of the evaluation protocol, part two.

`Relation` (in `relation.py`) is the protocol that every relation implements, and no other module branches on a
relation's name. To add a relation, add its name in `grounding.goals.parts`, its class here, and a test.
"""

from __future__ import annotations

from collections.abc import Mapping

from structdiffusion.relations.between import Between
from structdiffusion.relations.carried import In, On
from structdiffusion.relations.directional import Directional
from structdiffusion.relations.moves import Moved, Swapped
from structdiffusion.relations.next_to import NextTo
from structdiffusion.relations.relation import Relation
from structdiffusion.relations.table_place import At

# In the order of `grounding.goals.parts.RELATIONS`.
RELATIONS: Mapping[str, Relation] = {
    relation.name: relation
    for relation in (
        Directional("left of", (0.0, 1.0)),
        Directional("right of", (0.0, -1.0)),
        Directional("in front of", (-1.0, 0.0)),
        Directional("behind", (1.0, 0.0)),
        NextTo(),
        Between(),
        On(),
        In(),
        At(),
        Moved(),
        Swapped(),
    )
}
