# SPDX-License-Identifier: MIT
"""Worker processes in a process that was itself forked or started by multiprocessing.

joblib's loky (1.6) keeps its workers for the next call. A forked process would wait for ever for those of its parent,
and one of multiprocessing's waits at its end until its own have been idle for five minutes.
"""

from __future__ import annotations

import multiprocessing
import os
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

_parents: list[Any] = []
_process = _seen = os.getpid()


@contextmanager
def own_workers() -> Iterator[None]:
    """Within the block loky starts workers of this process; where it is a child, they end with the block."""
    global _seen
    from joblib.externals.loky import reusable_executor

    if _seen != os.getpid():
        _seen = os.getpid()
        # Kept, as its end would be told to threads that are not in this process.
        _parents.append(getattr(reusable_executor, "_executor", None))
        reusable_executor._executor = None
    try:
        yield
    finally:
        executor = getattr(reusable_executor, "_executor", None)
        if executor is not None and (_process != os.getpid() or multiprocessing.parent_process()):
            executor.shutdown(wait=True)
