# SPDX-License-Identifier: MIT
"""Seconds of each stage, and the highest memory of a run."""

from __future__ import annotations

import os
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

_PROCESS = Path("/proc/self")
# Points of a query that are shared among threads.
_MANY = 4_000


@contextmanager
def stopwatch(seconds: dict[str, float], stage: str) -> Iterator[None]:
    """Add the wall time of the block to `seconds[stage]`."""
    start = time.perf_counter()
    try:
        yield
    finally:
        seconds[stage] = seconds.get(stage, 0.0) + time.perf_counter() - start


def n_threads() -> int:
    """Threads for one KD-tree query: what OMP_NUM_THREADS says, as numpy and OpenMP take it, else -1 for all."""
    said = os.environ.get("OMP_NUM_THREADS", "").partition(",")[0]
    return int(said) if said.isdigit() and int(said) > 0 else -1


def query_threads(n: int) -> int:
    """Threads for a KD-tree query of n points: to start them takes as long as to ask for a thousand points."""
    return n_threads() if n > _MANY else 1


def n_workers() -> int:
    """The same as a number of threads, for libraries to which -1 means nothing."""
    return n_threads() if n_threads() > 0 else os.cpu_count() or 1


@contextmanager
def on_one_core() -> Iterator[None]:
    """Keep this thread, and those that it starts, on one core for the block, where the system can (Linux)."""
    if not hasattr(os, "sched_setaffinity"):
        yield
        return
    cores = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {min(cores)})
    try:
        yield
    finally:
        os.sched_setaffinity(0, cores)


def reset_peak_memory() -> None:
    """Start counting peak memory anew, where the system can (Linux)."""
    try:
        (_PROCESS / "clear_refs").write_text("5")
    except OSError:
        return


def peak_memory_mb() -> float | None:
    """Highest resident memory since `reset_peak_memory` (Linux) or since the process began; None if unknown."""
    try:
        status = (_PROCESS / "status").read_text()
        line = next(row for row in status.splitlines() if row.startswith("VmHWM"))
        return int(line.split()[1]) / 1024.0
    except (OSError, StopIteration):
        return _peak_since_start()


def _peak_since_start() -> float | None:
    try:
        import resource
    except ImportError:  # Windows
        return None
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0
