"""The memory that this process has taken at most.

Not `ru_maxrss`: a process that was forked begins with its parent's, so that the test process's own size would count.
"""

from pathlib import Path

_STATUS, _CLEAR = Path("/proc/self/status"), Path("/proc/self/clear_refs")


def forget_peak() -> None:
    """Lets the peak begin anew, from what is taken now."""
    _CLEAR.write_text("5")


def peak_megabytes() -> float:
    """The most memory (resident, MB) since this process began, or since `forget_peak`."""
    line = next(line for line in _STATUS.read_text().splitlines() if line.startswith("VmHWM:"))
    return int(line.split()[1]) / 1024


def resident_megabytes(process: int) -> float:
    """The memory (resident, MB) of another process and of all that it has started."""
    children = Path(f"/proc/{process}/task/{process}/children").read_text().split()
    status = Path(f"/proc/{process}/status").read_text()
    line = next(line for line in status.splitlines() if line.startswith("VmRSS:"))
    return int(line.split()[1]) / 1024 + sum(map(resident_megabytes, map(int, children)))
