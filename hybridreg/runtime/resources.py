# SPDX-License-Identifier: MIT
"""Seconds of each stage, and the peak memory of a run."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

_PROCESS = Path("/proc/self")


class Clock:
    """Wall time of named phases, seconds. A phase within another counts for itself alone."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}
        self._within = 0.0

    @contextmanager
    def phase(self, name: str) -> Iterator[None]:
        """Add the time of the block, less that of the phases within it, to ``seconds[name]``."""
        outside, self._within = self._within, 0.0
        start = time.perf_counter()
        try:
            yield
        finally:
            spent = time.perf_counter() - start
            self.seconds[name] = self.seconds.get(name, 0.0) + spent - self._within
            self._within = outside + spent


def reset_peak_memory() -> None:
    """Reset the peak memory counter, where the system can (Linux)."""
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
