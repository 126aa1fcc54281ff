# SPDX-License-Identifier: MIT
"""Work spread over processes that end with the one that started them, however that ends."""

from __future__ import annotations

import multiprocessing
import os
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from typing import Any, Literal, TypeVar

T = TypeVar("T")

# How often a worker looks whether its leader still lives, seconds.
_LOOK = 0.25
_watching = False
_process = os.getpid()
_parents: list[Any] = []


def spread(
    function: Callable[..., T],
    jobs: Iterable[tuple[Any, ...]],
    workers: int | None,
    *,
    ordered: bool = False,
    singly: bool = False,
) -> Iterator[T]:
    """What `function` gives for each tuple of arguments, by joblib.

    Parameters
    ----------
    workers : processes; None takes what `joblib.parallel_config` says, else 1
    ordered : in the order of the jobs, else as they are done
    singly : one job a task, so that each result comes as soon as it is there

    Warns
    -----
    UserWarning
        The system cannot start processes (a full /dev/shm); the work is done in this one.
    """
    from joblib import Parallel, delayed
    from joblib.parallel import get_active_backend

    _own_workers_only()
    # On dask joblib (1.6) takes all cores whatever `n_jobs` says; but no more than `pre_dispatch` tasks wait or run.
    wanted = get_active_backend()[1] if workers is None else workers
    ahead = wanted if wanted is not None and wanted > 0 else "2*n_jobs"
    many: dict[str, Any] = {"batch_size": 1, "pre_dispatch": ahead} if singly else {}
    how: Literal["generator", "generator_unordered"] = "generator" if ordered else "generator_unordered"
    leader = os.getpid()
    tasks = (delayed(led)(leader, function, job) for job in jobs)
    results: Iterator[T] = Parallel(n_jobs=workers, return_as=how, **many)(tasks)
    return results


def _own_workers_only() -> None:
    """Forget the pool of worker processes that joblib's loky keeps, where this process was forked since: joblib (1.6)
    would wait for ever for the parent's."""
    global _process
    if _process == os.getpid():
        return
    _process = os.getpid()
    from joblib.externals.loky import reusable_executor

    # Kept, as its end would be told to threads that are not in this process.
    _parents.append(getattr(reusable_executor, "_executor", None))
    reusable_executor._executor = None


def led(leader: int, function: Callable[..., T], job: tuple[Any, ...]) -> T:
    """`function` of the arguments in `job`, in a process that ends with its leader."""
    end_with(leader)
    return function(*job)


def end_with(leader: int) -> None:
    """Have this process end when its leader has, if it is a child of the leader's; of others nothing is known.

    A thread looks for it. Linux could signal it, but does so as soon as the *thread* ends that started the child.
    """
    global _watching
    if _watching or os.name != "posix" or os.getpid() == leader:
        return
    if os.getppid() == leader:
        _watching = True
        threading.Thread(target=_watch, args=(leader,), daemon=True, name="leader-watch").start()
    elif multiprocessing.current_process().name.startswith("Loky"):
        os._exit(1)  # such a process is always its leader's child: the leader has gone already


def _watch(leader: int) -> None:
    while os.getppid() == leader:
        time.sleep(_LOOK)
    os._exit(1)
