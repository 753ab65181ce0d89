"""Free memory goes back to the system."""

import numpy as np

from agent.runtime import memory
from tests.memory import forget_peak, peak_megabytes


def test_what_is_free_is_given_back():
    """Many small arrays, of which one in a thousand stays, so that the allocator cannot shrink its heap by itself."""
    memory.give_back()
    forget_peak()
    before = peak_megabytes()
    arrays = [np.ones(2000) for _ in range(8000)]  # 128 MB
    kept = arrays[::1000]
    del arrays
    memory.give_back()
    forget_peak()
    assert peak_megabytes() < before + 40 and len(kept) == 8


def test_another_c_library_is_left_alone(monkeypatch):
    monkeypatch.setattr(memory, "_trim", lambda: None)
    memory.give_back()
