"""Sizes of structures that can be spread out: extents to lay out, and extents to correct to."""

from __future__ import annotations

import numpy as np

from grounding.spec import StructureSpec

# Extent over tightest extent. Layouts are drawn well inside the bands of the evaluation protocol, so that small errors
# of measurement or placement do not leave them.
_DRAWN = {"small": (1.03, 1.2), "medium": (1.42, 1.68), "large": (1.95, 2.3)}
# Sampled poses are moved no farther than into these. The sides that the camera does not see make outlines too
# narrow rather than too broad: lower margins are wider. Small structures keep a clear gap.
_CORRECTED = {"small": (1.0, 1.2), "medium": (1.45, 1.68), "large": (2.05, np.inf)}


def draw_size_ratio(spec: StructureSpec, rng: np.random.Generator) -> float:
    """Draw extent over tightest extent for the requested size; if it is open, the size is drawn too."""
    return float(rng.uniform(*_DRAWN[spec.size or str(rng.choice(list(_DRAWN)))]))


def clip_to_size(extent: float, tightest: float, size: str | None) -> float:
    """Return the extent (m) nearest to this one that has the requested size; this one if no size was requested."""
    low, high = _CORRECTED[size] if size is not None else (0.0, np.inf)
    return float(np.clip(extent, low * tightest, high * tightest))
