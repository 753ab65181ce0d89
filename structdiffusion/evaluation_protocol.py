"""The numbers of the evaluation protocol: what counts as success, each number once, with its unit and its reason; and
the names of its failures.

`docs/protocol.md` explains them. Code that checks, aims at or reports one of these limits takes it from here.
"""

from __future__ import annotations

import math

# --- the physical protocol (`structdiffusion.protocol.physical_stability`) ------------------------

# m: two convex decompositions that overlap by less are in contact. Both engines and decompositions are off by about 1
# mm.
MAX_PENETRATION = 0.002
# m above its predicted pose, from where an object is released, as in the paper; it has to come to rest unaided.
RELEASE_HEIGHT = 0.03
# m/s: a fall from the release height ends at 0.77; faster objects were pushed out of others or roll off.
MAX_SPEED = 1.0
# m, in the plane, from an object's predicted place to where it ends: about the radius of a mug.
MAX_DISPLACEMENT = 0.04
# Between an object's final and predicted orientation: less is a lean, more is a fall or an object on a rim.
MAX_TILT_DEGREES = 15.0
MAX_TILT = math.radians(MAX_TILT_DEGREES)
# s that an object may take to come to rest before the next is released: objects released from 3 cm rest within one.
SETTLE_SECONDS = 1.5
# s that the finished structure has to stand, as in the paper.
FINAL_SECONDS = 2.0
# Why a structure fails, in the order of the checks; `structdiffusion.protocol.physical_stability` defines them.
FAILURE_CLASSES = INTERSECTION, ABNORMAL_VELOCITY, NOT_UPRIGHT, SEMANTIC = (
    "intersection",
    "abnormal velocity",
    "not upright",
    "semantic",
)

# --- sizes: extent / tightest extent --------------------------------------------------------------

# m: the clear gap between neighbours in the tightest extent, room for a fingertip.
CLEARANCE = 0.01
# Low and high end of each size. A third more than the tightest looks tight, four fifths more look spread out.
SIZE_BANDS = {"small": (0.0, 1.3), "medium": (1.3, 1.8), "large": (1.8, math.inf)}

# --- positions: thirds of the range in which the structure's centre can lie, low to high ----------

X_POSITION_THIRDS = ("right", "center", "left")  # along y of the world frame, which points to the robot's left
Y_POSITION_THIRDS = ("bottom", "middle", "top")  # along x of the world frame, which points away from the robot

# --- circle ---------------------------------------------------------------------------------------

MIN_CIRCLE_OBJECTS = 3  # two lie on any number of circles
# m, and share of the radius: the larger one is how far a centroid may be off the least-squares circle.
MAX_OFF_CIRCLE, MAX_OFF_CIRCLE_SHARE = 0.02, 0.15
# Largest angular gap over the mean gap of a closed ring: at 2 an object seems to be missing.
MAX_GAP_RATIO = 1.6
# The opening of a ring that faces somewhere, over the mean of its other gaps: clearly open, and still a ring.
OPENING_RATIO = (1.5, 3.0)
# Degrees from the middle of the opening to the heading: half the angle between two rotations.
MAX_OPENING_OFF_DEGREES = 45.0

# --- line -----------------------------------------------------------------------------------------

MIN_LINE_OBJECTS = 2
MAX_OFF_LINE = 0.02  # m from the least-squares line to a centroid
# Share of the mean clear gap, and m: the larger one is how far a clear gap may be off the mean.
MAX_UNEVEN_SHARE, MAX_UNEVEN = 0.5, 0.015
# Degrees between the line and the perpendicular of its heading: half the angle to the nearest diagonal.
MAX_LINE_OFF_DEGREES = 22.5

# --- tower ----------------------------------------------------------------------------------------

MIN_TOWER_OBJECTS = 2

# --- table setting --------------------------------------------------------------------------------

MIN_SETTING_OBJECTS = 2  # the base and something beside it
MAX_CUTLERY_OFF_DEGREES = 15.0  # between the direction of a fork, knife or spoon and away from the diner
MAX_NEIGHBOUR_GAP = 0.08  # m of clear gap to the nearest neighbour: what lies farther off is not part of the setting
MAX_SETTING_OFF_DEGREES = 22.5  # as for a line


# --- further shapes (part two) --------------------------------------------------------------------

MIN_CLUSTER_OBJECTS = 2
MAX_CLUSTER_GAP = 0.04  # m of clear gap by which the objects of a cluster are joined
MAX_CLUSTER_HULL_RATIO = 2.5  # convex hull of the whole over the objects' own area; tightest packings have about 1.6
MIN_RECTANGLE_OBJECTS = 4  # one for each corner
MIN_TRIANGLE_OBJECTS = 3
MAX_OFF_OUTLINE = 0.02  # m from a centroid to the outline of a rectangle or triangle
MAX_OFF_CORNER = 0.03  # m from each corner of a rectangle or triangle to the nearest centroid
MAX_OUTLINE_GAP_RATIO = 1.8  # largest gap along an outline over the mean gap
MAX_SQUARE_SIDES_SHARE = 0.2  # by which the sides of a square may differ
TRIANGLE_ANGLES_DEGREES = (35.0, 90.0)  # smallest and largest inner angle of a triangle
MAX_CORNER_OFF_DEGREES = 30.0  # between a triangle's rotation and the direction of its nearest corner
MIN_ARC_OBJECTS = 3
ARC_DEGREES = (120.0, 240.0)  # what an arc spans: less is a bent line, more an open circle
MAX_ARC_OFF_DEGREES = 45.0  # between the open side of an arc and its rotation
MIN_GRID_OBJECTS = 4
MAX_OFF_LATTICE = 0.02  # m from a centroid to its place of a grid
MAX_UNEVEN_PITCH = 0.015  # m by which the pitches of a grid in one direction may differ
MIN_CROSS_OBJECTS = 5
MAX_CROSS_OFF_DEGREES = 10.0  # of the angle between the lines of a cross from a right angle
MIN_PYRAMID_OBJECTS = 3

# --- figures (part three) -------------------------------------------------------------------------

# Chamfer distance of the built outline and the drawing, over the drawing's largest diameter.
MAX_FIGURE_OFF_SHARE = 0.12
# Standard deviation of the clear gaps along a stroke over their mean.
MAX_GAP_VARIATION = 0.25
MAX_FIGURE_OFF_DEGREES = 22.5  # between a figure's heading and its rotation: half the angle to the nearest diagonal
MAX_COPY_OFF = (
    0.005  # m between an object of an exact copy and its place, once the copy as a whole is laid over the example
)
# Between its long side and that of its place: on a cube of 5 cm, the corners move by less than 5 mm then.
MAX_COPY_TURN_DEGREES = 5.0

# --- further keys of a structure (part two) -------------------------------------------------------

# m (or the cube root of a volume's difference): measures that differ by less may stand in either order
ORDER_TIE = 0.005
# m, and share: the larger one is how far a clear gap may be off the requested
MAX_GAP_OFF, MAX_GAP_OFF_SHARE = 0.01, 0.15
MAX_RADIUS_OFF = 0.015  # m from the requested radius
MAX_LENGTH_OFF = 0.02  # m from the requested length
MAX_AROUND_OFF = 0.03  # m from the centre of a structure to the object that it is laid around
MAX_ALONG_OFF_DEGREES = 10.0  # between a line and the edge that it follows
MAX_ALONG_DISTANCE = 0.15  # m from that edge to each centroid
MIN_GROUP_GAP = 0.06  # m of clear gap between groups

# --- relations (part two) -------------------------------------------------------------------------

MAX_RELATION_OFF_DEGREES = 45.0  # from the named direction to that of the object
MIN_RELATION_GAP, MAX_RELATION_GAP = 0.005, 0.25  # m of clear gap to the reference, where no distance is named
MAX_NEXT_TO_GAP = 0.08  # m of clear gap
BETWEEN_SHARES = (0.3, 0.7)  # of the way from one reference to the other
MAX_OFF_BETWEEN = 0.04  # m from the straight line between the references
MIN_DEPTH_INSIDE = 0.01  # m of an object's bottom below the highest rim of what it is in
MAX_MOVED_OFF = 0.015  # m along and across the way of a move
MAX_SWAPPED_OFF = 0.03  # m from where the other object stood
MAX_UNNAMED_MOVE = 0.01  # m that an object may move that no part of the goal names


def max_off_circle(radius: float) -> float:
    """Return how far, metres, a centroid may be from a circle of this radius (m)."""
    return max(MAX_OFF_CIRCLE, MAX_OFF_CIRCLE_SHARE * radius)


def max_uneven(mean_gap: float) -> float:
    """Return how much, metres, the clear gaps of a line may differ from their mean (m)."""
    return max(MAX_UNEVEN_SHARE * mean_gap, MAX_UNEVEN)


def max_gap_off(wanted: float) -> float:
    """Return how far, metres, a clear gap or a distance may be off the requested one (m)."""
    return max(MAX_GAP_OFF, MAX_GAP_OFF_SHARE * wanted)
