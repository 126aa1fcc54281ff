# SPDX-License-Identifier: MIT
"""How many cores this process may use, by its affinity and its control group."""

from __future__ import annotations

import math
import os
from functools import lru_cache
from pathlib import Path

# Points in a KD-tree query from which it is split among threads.
_MANY = 4_000
_CGROUPS = Path("/sys/fs/cgroup")
_OWN_CGROUPS = Path("/proc/self/cgroup")


def cores() -> int:
    """Cores on which this thread may run (`taskset`, `cpuset`), at most as many as its CPU quota allows."""
    allowed = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return math.ceil(min(allowed, _quota()))


def n_threads() -> int:
    """Threads for one library call: OMP_NUM_THREADS, as numpy and OpenMP read it, but no more than `cores`."""
    said = os.environ.get("OMP_NUM_THREADS", "").partition(",")[0]
    return min(int(said), cores()) if said.isdigit() and int(said) > 0 else cores()


def query_threads(n: int) -> int:
    """Threads for a KD-tree query of n points: starting them takes as long as querying a thousand points."""
    return n_threads() if n > _MANY else 1


@lru_cache(maxsize=1)
def _quota() -> float:
    # It hardly ever changes while a process runs, and every tree query needs it.
    return quota(_OWN_CGROUPS, _CGROUPS)


def quota(own: Path, root: Path) -> float:
    """CPU quota of a process in cores, from its control groups; infinite where there is no limit.

    Parameters
    ----------
    own : the process's `/proc/self/cgroup`
    root : where control groups are mounted; version 1 (`cpu/cpu.cfs_quota_us`) and 2 (`cpu.max`) are read
    """
    try:
        groups = [line.split(":", 2)[1:] for line in own.read_text().splitlines()]
    except (OSError, UnicodeDecodeError):
        return math.inf
    least = math.inf
    for controllers, path in (group for group in groups if len(group) == 2):
        base = root / controllers if controllers else root
        if controllers and "cpu" not in controllers.split(","):
            continue
        # A group's quota applies to all groups below it. In a container the path may be the host's, and not exist.
        folder = base / path.strip("/")
        for place in {folder, *folder.parents}:
            if place == base or base in place.parents:
                least = min(least, _of_folder(place))
    return least


def _of_folder(folder: Path) -> float:
    for names in (("cpu.max",), ("cpu.cfs_quota_us", "cpu.cfs_period_us")):
        try:
            share, period = " ".join((folder / name).read_text() for name in names).split()
            if int(share) > 0 and int(period) > 0:
                return int(share) / int(period)
        except (OSError, ValueError):  # no such file, or "max"
            continue
    return math.inf
