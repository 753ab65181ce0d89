"""Load the models of a conversation in the background, while its user reads the table and types."""

from __future__ import annotations

from contextlib import suppress
from threading import Thread

from agent.errors import exit_code_of
from agent.pipeline.resources import ResourceCache
from agent.pipeline.run import RunOptions


class Preloading:
    """A thread that loads what a conversation will need.

    Args:
        cache: the cache to load into.
        options: the options of the conversation.
    """

    def __init__(self, cache: ResourceCache, options: RunOptions) -> None:
        self._thread = Thread(target=_preload, args=(cache, options), daemon=True)

    def start(self) -> None:
        """Begin to load."""
        self._thread.start()

    def join(self) -> None:
        """Wait until everything is loaded, since a process that ends while a library is being loaded crashes."""
        while self._thread.is_alive():
            with suppress(KeyboardInterrupt):  # impatient users press Ctrl-C more than once
                self._thread.join()


def _preload(cache: ResourceCache, options: RunOptions) -> None:
    """Load the models; a known error is ignored here, because it is raised again and shown when they are needed."""
    try:
        cache.preload(options.reading, options.model, options.weights, options.allow_unverified)
    except Exception as error:
        if exit_code_of(error) is None:
            raise
