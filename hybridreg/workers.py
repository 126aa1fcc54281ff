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

    many: dict[str, Any] = {"batch_size": 1, "pre_dispatch": "2*n_jobs"} if singly else {}
    how: Literal["generator", "generator_unordered"] = "generator" if ordered else "generator_unordered"
    leader = os.getpid()
    tasks = (delayed(led)(leader, function, job) for job in jobs)
    results: Iterator[T] = Parallel(n_jobs=workers, return_as=how, **many)(tasks)
    return results


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
