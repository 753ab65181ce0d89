"""Import the libraries that worker processes need, once, in the server process from which they fork.

Only libraries: modules of ours import in milliseconds once these are there, and what a test replaces in them stays its
own affair. None of these starts threads when it is imported.
"""

import scipy.optimize
import scipy.spatial  # noqa: F401
import shapely  # noqa: F401
import torch  # noqa: F401
import trimesh  # noqa: F401

from structdiffusion.simulation.pybullet_import import import_pybullet_silently

import_pybullet_silently()
