"""The numbers of the evaluation protocol: what counts as success, each number once, with its unit and its reason.

`docs/protocol.md` explains them. Code that checks, aims at or reports one of these limits takes it from here.
"""

from __future__ import annotations

import math

# --- the physical protocol (`structdiffusion.protocol.physical_stability`) ------------------------

# m: two convex decompositions that overlap by less are in contact. Both engines and decompositions are off by about 1 mm.
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


def max_off_circle(radius: float) -> float:
    """Return how far, metres, a centroid may be from a circle of this radius (m)."""
    return max(MAX_OFF_CIRCLE, MAX_OFF_CIRCLE_SHARE * radius)


def max_uneven(mean_gap: float) -> float:
    """Return how much, metres, the clear gaps of a line may differ from their mean (m)."""
    return max(MAX_UNEVEN_SHARE * mean_gap, MAX_UNEVEN)
