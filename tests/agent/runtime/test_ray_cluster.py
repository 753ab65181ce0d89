"""Connections to clusters; what runs there is tested with those who use them."""

import pytest

from agent.errors import UsageError
from agent.runtime.ray_cluster import ray_cluster


def test_more_workers_than_cores_would_wait_for_ever(monkeypatch):
    """A cluster of two cores, as Ray tells of it; nothing is started."""
    ray, told = pytest.importorskip("ray"), []
    monkeypatch.setattr(ray, "init", lambda **options: told.append(options["address"]))
    monkeypatch.setattr(ray, "cluster_resources", lambda: {"CPU": 2.0, "memory": 1e9})
    monkeypatch.setattr(ray, "shutdown", lambda: told.append("parted"))
    with pytest.raises(UsageError, match="--workers cannot be 3: the cluster at auto has 2 cores; legal: 1 to 2"):
        with ray_cluster("auto", 3):
            pass
    assert told == ["auto", "parted"]
    for asked, given in ((None, 2), (1, 1), (2, 2)):
        with ray_cluster("auto", asked) as count:
            assert count == given
