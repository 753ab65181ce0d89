"""Connect to a Ray cluster: one that is started here, the one of this machine, or any at an address."""

from __future__ import annotations

import os
import re
import socket
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from agent.errors import UsageError, one_sentence

RAY_HERE, RAY_FOUND = "local", "auto"
_ADDRESS = re.compile(r"(ray://)?(?P<host>[^\s/:]+|\[[^\s/]+\]):(?P<port>\d{1,5})")
_KNOCK_SECONDS = 5.0


@contextmanager
def ray_cluster(address: str, workers: int | None) -> Iterator[int]:
    """Connect to a cluster for the duration of the context, which yields the number of workers to start there.

    Args:
        address: HOST:PORT or ray://HOST:PORT; "auto" for the cluster that this machine is part of, and
            "local" for one that is started here and ends with this process.
        workers: the number of workers; `None` for one per core of the cluster.

    Raises:
        UsageError: if Ray is not installed, no cluster answers at the address, or it has fewer cores than workers.
    """
    # It asks nobody before it reports its use to its makers.
    os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")
    try:
        import ray
    except ImportError as error:
        raise UsageError("--ray needs Ray, and it is not installed; pip install 'structagent[ray]' does it") from error
    own: dict[str, Any] = {"logging_level": "ERROR"}
    if address == RAY_HERE:
        own |= {"num_cpus": workers, "include_dashboard": False}
    _knock(address)
    try:
        ray.init(address=address, log_to_driver=False, **own)
    except (ConnectionError, RuntimeError, ValueError) as error:
        raise UsageError(f"--ray cannot be {address!r}: {one_sentence(error)}") from error
    try:
        cores = max(1, int(ray.cluster_resources().get("CPU", 1)))
        if workers is not None and workers > cores:  # the last ones would wait for a core for ever, and we for them
            raise UsageError(
                f"--workers cannot be {workers}: the cluster at {address} has {cores} cores; legal: 1 to {cores}"
            )
        yield workers or cores
    finally:
        ray.shutdown()


def _knock(address: str) -> None:
    """Check that a server listens at the address of a cluster, because Ray itself would try for many minutes.

    Raises:
        UsageError: if none does, or the address is not valid.
    """
    if address in (RAY_HERE, RAY_FOUND):
        return
    place = _ADDRESS.fullmatch(address)
    if place is None:
        legal = f"{RAY_HERE}, {RAY_FOUND} (the cluster of this machine), HOST:PORT, ray://HOST:PORT"
        raise UsageError(f"--ray cannot be {address!r}; legal: {legal}")
    try:
        socket.create_connection((place["host"].strip("[]"), int(place["port"])), _KNOCK_SECONDS).close()
    except (OSError, OverflowError) as error:
        raise UsageError(f"--ray cannot be {address!r}: no server answers there ({one_sentence(error)})") from error
