"""What holds for all tests of a process."""

import gc


def pytest_collection_finish() -> None:
    """Spare the garbage collector the tests and the libraries, which stay until the end."""
    gc.collect()
    gc.freeze()


def pytest_sessionfinish() -> None:
    """Give everything back: libraries that count their objects at the end would report the frozen ones as lost."""
    gc.unfreeze()
