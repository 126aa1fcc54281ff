# SPDX-License-Identifier: MIT
"""A forked process starts workers of its own: joblib's (1.6) would wait for ever for those of the parent."""

from __future__ import annotations

import os
from typing import Any

_parents: list[Any] = []
_process = os.getpid()


def own_workers_only() -> None:
    """Forget the pool of worker processes that joblib's loky keeps, where this process was forked since."""
    global _process
    if _process == os.getpid():
        return
    _process = os.getpid()
    from joblib.externals.loky import reusable_executor

    # Kept, as its end would be told to threads that are not in this process.
    _parents.append(getattr(reusable_executor, "_executor", None))
    reusable_executor._executor = None
