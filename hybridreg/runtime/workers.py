# SPDX-License-Identifier: MIT
"""Work spread over processes that end with the one that started them, however it ends."""

from __future__ import annotations

import multiprocessing
import os
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from numbers import Integral
from typing import Any, Literal, TypeVar

T = TypeVar("T")

# Seconds between a worker's checks that its leader is still alive.
_LOOK = 0.25
_watching = False
_process = _seen = os.getpid()
_parents: list[Any] = []


def spread(
    function: Callable[..., T],
    jobs: Iterable[tuple[Any, ...]],
    workers: int | None,
    *,
    ordered: bool = False,
    singly: bool = False,
) -> Iterator[T]:
    """Results of `function` for each tuple of arguments, through joblib.

    Parameters
    ----------
    workers : processes, or -1 for one a core; None takes what `joblib.parallel_config` says, else 1
    ordered : in the order of the jobs, otherwise as they finish
    singly : one job a task, so that each result comes as soon as it is ready

    Raises
    ------
    ValueError
        Another number of workers.

    Warns
    -----
    UserWarning
        The system cannot start processes (a full /dev/shm); the work is done in this one.
    """
    _check(workers)
    return _spread(function, jobs, workers, ordered=ordered, singly=singly)


def _check(workers: int | None) -> None:
    if workers is None:
        return
    if isinstance(workers, bool) or not isinstance(workers, Integral) or workers == 0:
        raise ValueError(f"workers={workers!r} must be 1 or more processes, or -1 for one a core")


def _spread(
    function: Callable[..., T],
    jobs: Iterable[tuple[Any, ...]],
    workers: int | None,
    *,
    ordered: bool,
    singly: bool,
) -> Iterator[T]:
    from joblib import Parallel, delayed
    from joblib.parallel import get_active_backend

    # With dask, joblib (1.6) takes all cores whatever `n_jobs` says; but no more than `pre_dispatch` tasks wait or run.
    wanted = get_active_backend()[1] if workers is None else workers
    ahead = wanted if wanted is not None and wanted > 0 else "2*n_jobs"
    many: dict[str, Any] = {"batch_size": 1, "pre_dispatch": ahead} if singly else {}
    how: Literal["generator", "generator_unordered"] = "generator" if ordered else "generator_unordered"
    leader = os.getpid()
    tasks = (delayed(led)(leader, function, job) for job in jobs)
    with _own_workers():
        yield from Parallel(n_jobs=workers, return_as=how, **many)(tasks)


@contextmanager
def _own_workers() -> Iterator[None]:
    """Within the block joblib's loky starts workers for this process; in a child process they end with the block.

    loky (joblib 1.6) keeps its workers for the next call. A forked process would wait forever for those of its parent,
    and one of multiprocessing's waits at its end until its own have been idle for five minutes.
    """
    global _seen
    from joblib.externals.loky import reusable_executor

    if _seen != os.getpid():
        _seen = os.getpid()
        # Kept, because its end would be signalled to threads that do not exist in this process.
        _parents.append(getattr(reusable_executor, "_executor", None))
        reusable_executor._executor = None
    try:
        yield
    finally:
        executor = getattr(reusable_executor, "_executor", None)
        if executor is not None and (_process != os.getpid() or multiprocessing.parent_process()):
            executor.shutdown(wait=True)


def led(leader: int, function: Callable[..., T], job: tuple[Any, ...]) -> T:
    """`function` of the arguments in `job`, in a process that ends with its leader."""
    end_with(leader)
    return function(*job)


def end_with(leader: int) -> None:
    """End this process when its leader has ended, if it is a child of the leader; of others nothing is known.

    A thread checks for it. Linux could signal it, but does so as soon as the *thread* that started the child ends.
    """
    global _watching
    if _watching or os.name != "posix" or os.getpid() == leader:
        return
    if os.getppid() == leader:
        _watching = True
        threading.Thread(target=_watch, args=(leader,), daemon=True, name="leader-watch").start()
    elif multiprocessing.current_process().name.startswith("Loky"):
        os._exit(1)  # such a process is always its leader's child: the leader has already ended


def _watch(leader: int) -> None:
    while os.getppid() == leader:
        time.sleep(_LOOK)
    os._exit(1)
