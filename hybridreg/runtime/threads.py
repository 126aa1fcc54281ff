# SPDX-License-Identifier: MIT
"""Keep third-party code on the calling thread: on a busy machine, in a forked process, for the same bits everywhere.

Threads of OpenMP, BLAS and torch wait for each other by spinning, many times in one call. Where another process takes
a core away they wait for the scheduler each time: the network of the preset `cross3dreg` took 5 to 8 s on two threads
and 1 s on one (two cores, three other busy processes), at three times the processor time. And OpenMP's threads do not
exist in a forked process, which then waits for them forever.
"""

from __future__ import annotations

import os
import sys
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, contextmanager, suppress
from typing import Any, Literal

from hybridreg.runtime.cores import n_threads

_VARIABLES = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMEXPR_NUM_THREADS")


class Held:
    """A setting of the whole process: changed by the first block that needs it, restored by the last.

    So blocks in several Python threads do not restore each other's values, in whatever order they end.
    """

    def __init__(self, change: Callable[[], Callable[[], Any]]) -> None:
        self._change = change
        self._undo: Callable[[], Any] = lambda: None
        self._inside = 0
        self._mine = threading.local()
        self._lock = threading.Lock()
        if hasattr(os, "register_at_fork"):
            os.register_at_fork(after_in_child=self._after_fork)

    @contextmanager
    def __call__(self) -> Iterator[None]:
        with self._lock:
            if not self._inside:
                self._undo = self._change()
            self._inside += 1
        self._mine.depth = self._depth + 1
        try:
            yield
        finally:
            self._mine.depth -= 1
            with self._lock:
                self._inside -= 1
                if not self._inside:
                    self._undo()

    @property
    def _depth(self) -> int:
        depth: int = getattr(self._mine, "depth", 0)
        return depth

    def _after_fork(self) -> None:
        # The thread that held the lock, and the blocks of all other threads, do not exist in this process.
        self._lock = threading.Lock()
        left, self._inside = self._inside, self._depth
        if left and not self._inside:
            self._undo()


def _limit(kind: Literal["blas", "openmp"]) -> Any:
    from threadpoolctl import ThreadpoolController

    # Selected first: `threadpool_limits(user_api=...)` restores the numbers of the other kind too.
    return ThreadpoolController().select(user_api=kind).limit(limits=1)


def _limit_blas() -> Callable[[], Any]:
    undo: Callable[[], Any] = _limit("blas").restore_original_limits
    return undo


def _limit_torch() -> Callable[[], Any]:
    # torch keeps one number for the process and one for each thread, and changes both at once. A separate thread reads
    # and changes the process's; the caller's is one of OpenMP's.
    import torch

    def swapped(n: int) -> int:
        before: int = torch.get_num_threads()
        torch.set_num_threads(n)
        return before

    with ThreadPoolExecutor(1) as other:
        before = other.submit(swapped, 1).result()

    def undo() -> None:
        with ThreadPoolExecutor(1) as other:
            other.submit(swapped, before).result()

    return undo


def _limit_environment() -> Callable[[], Any]:
    before = {name: os.environ.get(name) for name in _VARIABLES}
    os.environ.update(dict.fromkeys(_VARIABLES, "1"))

    def undo() -> None:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value

    return undo


# Matrix products of the whole process on one thread for the block. Those of a registration are small: a second thread
# spent as much time waiting as the first spent on them, and brought nothing.
one_blas = Held(_limit_blas)
_one_torch, _one_said = Held(_limit_torch), Held(_limit_environment)


@contextmanager
def single() -> Iterator[None]:
    """One thread for the libraries that are loaded, within the block; afterwards the previous numbers are restored.

    OpenMP counts threads for each Python thread, BLAS and torch for the whole process. A library that is imported
    within the block is not limited: import it before.
    """
    with ExitStack() as held:
        held.enter_context(_limit("openmp"))
        held.enter_context(one_blas())
        if "torch" in sys.modules:  # it takes a second and a half to load
            held.enter_context(_one_torch())
            # A thread takes over the process's number when it first asks: now, while that is one.
            sys.modules["torch"].get_num_threads()
        yield


@contextmanager
def one_thread() -> Iterator[None]:
    """`single`, also for libraries that are loaded later and for our own tree queries: one core for the block."""
    new = "torch" not in sys.modules
    try:
        with _one_said(), single():
            yield
    finally:
        if new and "torch" in sys.modules:  # it read the variables, and would keep to one thread forever
            sys.modules["torch"].set_num_threads(n_threads())


@contextmanager
def on_one_core() -> Iterator[None]:
    """Keep this thread, and those that it starts, on one core for the block, where the system can (Linux)."""
    if not hasattr(os, "sched_setaffinity"):
        yield
        return
    allowed = os.sched_getaffinity(0)
    with suppress(OSError):  # a sandbox may forbid it
        os.sched_setaffinity(0, {min(allowed)})
    try:
        yield
    finally:
        with suppress(OSError):
            os.sched_setaffinity(0, allowed)
