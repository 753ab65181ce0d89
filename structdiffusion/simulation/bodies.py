"""PyBullet bodies of the simulated world: the table and the objects on it, with their contact properties."""

from __future__ import annotations

import pybullet

from structdiffusion.geometry import quaternion_from_matrix
from structdiffusion.objects.model import ObjectModel
from structdiffusion.objects.rigid_body import shape_file
from structdiffusion.observation import Table

TABLE_THICKNESS = 0.04
# PyBullet rounds convex parts outward by this much; its default of 1 mm would spoil millimetre checks.
MARGIN = 0.0002
# Enough that cans stop rolling, too little to hold anything up; nothing bounces.
CONTACT = {"rollingFriction": 0.0005, "spinningFriction": 0.001, "restitution": 0.0}


def add_table(client: int, table: Table) -> int:
    """Add the slab whose top is `table` (z = 0) to a PyBullet client; return its body id."""
    here = {"physicsClientId": client}
    half = ((table.x_max - table.x_min) / 2, (table.y_max - table.y_min) / 2, TABLE_THICKNESS / 2)
    center = ((table.x_min + table.x_max) / 2, (table.y_min + table.y_max) / 2, -TABLE_THICKNESS / 2)
    shape = pybullet.createCollisionShape(pybullet.GEOM_BOX, halfExtents=half, **here)
    wood = (0.80, 0.71, 0.60, 1.0)
    visual = pybullet.createVisualShape(pybullet.GEOM_BOX, halfExtents=half, rgbaColor=wood, **here)
    body = pybullet.createMultiBody(0.0, shape, visual, center, **here)
    # With 1 here the friction between an object and the table is the object's own coefficient.
    pybullet.changeDynamics(body, -1, lateralFriction=1.0, **CONTACT, **here)
    return body


def add_object(client: int, model: ObjectModel) -> int:
    """Add an object to a PyBullet client, its inertial frame at the world's origin; return its body id."""
    here = {"physicsClientId": client}
    mass = model.mass_properties
    frame = mass.object_from_inertial
    solid, surface = str(shape_file(model.solid)), str(shape_file(model.surface))
    shape = pybullet.createCollisionShape(pybullet.GEOM_MESH, fileName=solid, **here)
    look = {"rgbaColor": (*model.color, 1.0), "specularColor": (0.1, 0.1, 0.1)}
    visual = pybullet.createVisualShape(pybullet.GEOM_MESH, fileName=surface, **look, **here)
    body = pybullet.createMultiBody(
        model.mass,
        shape,
        visual,
        baseInertialFramePosition=frame[:3, 3].tolist(),
        baseInertialFrameOrientation=quaternion_from_matrix(frame).tolist(),
        **here,
    )
    pybullet.changeDynamics(
        body,
        -1,
        lateralFriction=model.friction,
        collisionMargin=MARGIN,
        localInertiaDiagonal=mass.inertia.tolist(),
        **CONTACT,
        **here,
    )
    return body
