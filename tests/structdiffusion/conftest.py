"""What several tests of the core need: a small library of training objects, and demonstrations of them."""

import numpy as np
import pytest
import torch

from grounding.corpus.grammar import legal_specs
from grounding.spec import SHAPES
from structdiffusion.data import demonstrations
from structdiffusion.footprints import turned
from structdiffusion.models.encoders import SENTENCE_WIDTH
from structdiffusion.objects.procedural import procedural_objects
from structdiffusion.structures import STRUCTURES
from structdiffusion.structures.bodies import PlacedBody
from structdiffusion.word_tokens import word_ids
from tests.structdiffusion.structures.handmade import carriers

torch.set_num_threads(1)


@pytest.fixture(scope="session")
def library():
    """Three objects of each procedural kind."""
    return procedural_objects(51, seed=7)


@pytest.fixture(scope="module")
def one_cache(tmp_path_factory):
    """A cache that a module's tests share with nobody else."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CACHE_HOME", str(tmp_path_factory.mktemp("cache")))
        yield


@pytest.fixture
def built():
    """A function that makes the finished structure of a layout: what would stand there if all went to plan."""

    def bodies(items, layout):
        placed = []
        outlines = [turned(it.footprint, yaw) + at[:2] for it, yaw, at in zip(items, layout.turns, layout.positions)]
        tops = [at[2] + item.height for item, at in zip(items, layout.positions)]
        for i, (item, turn, at) in enumerate(zip(items, layout.turns, layout.positions)):
            outline = outlines[i]
            stacks = STRUCTURES[layout.spec.shape].stacks
            carrier = carriers(i, outlines, layout.positions[:, 2], tops) if stacks else ()
            named, top, yaw = (f"{item.category} {i + 1}", item.category), at[2] + item.height, item.front_yaw + turn
            placed.append(PlacedBody(*named, outline, at[:2], at[2], top, yaw, carrier))
        return placed

    return bodies


@pytest.fixture(scope="session")
def data_folder(library, tmp_path_factory):
    """A folder of 24 demonstrations in two shards; the "embeddings" of its language are the word ids."""
    folder = tmp_path_factory.mktemp("demonstrations")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CACHE_HOME", str(tmp_path_factory.mktemp("cache")))
        patch.setattr(demonstrations, "SHARD_SCENES", 12)
        patch.setattr(demonstrations, "PROVEN", 0)
        list(demonstrations.generate(library, folder, 24, seed=10))
    words = np.array([word_ids(spec) for spec in legal_specs((*SHAPES, None)) for _ in range(2)], dtype=np.int8)
    embeddings = np.zeros((len(words), SENTENCE_WIDTH), dtype=np.float16)
    embeddings[:, : words.shape[1]] = words
    embeddings[:, -1] = 1.0  # never all zeros, which would mean "no sentence"
    np.savez(folder / "language.npz", embeddings=embeddings, words=words)
    return folder
