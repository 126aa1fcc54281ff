# SPDX-License-Identifier: MIT
"""One thread for each pair, so that workers do not fight and seconds can be compared."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager

_VARIABLES = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMEXPR_NUM_THREADS")


@contextmanager
def one_thread() -> Iterator[None]:
    """Limit numeric libraries to one thread within the block: loaded ones by threadpoolctl, later ones by
    their variables."""
    from threadpoolctl import threadpool_limits

    before = {name: os.environ.get(name) for name in _VARIABLES}
    os.environ.update(dict.fromkeys(_VARIABLES, "1"))
    torch_before = _limit_torch(1)
    try:
        with threadpool_limits(1):
            yield
    finally:
        _limit_torch(torch_before)
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value


def _limit_torch(n: int | None) -> int | None:
    # Imported by a stage, or not at all: torch takes a second and a half to load.
    torch = sys.modules.get("torch")
    if torch is None or n is None:
        return None
    before: int = torch.get_num_threads()
    torch.set_num_threads(n)
    return before
