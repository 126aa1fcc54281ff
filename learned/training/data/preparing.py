# SPDX-License-Identifier: MIT
"""Preparing all pairs of a source ahead of training, in several processes of one thread each."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator
from typing import TypeVar

from hybridreg.learned.training.data.opened_source import OpenedSource
from hybridreg.runtime.threads import one_thread
from hybridreg.runtime.workers import spread

Source = TypeVar("Source", bound=OpenedSource)
_log = logging.getLogger(__name__)


def prepare_all(source: Source, workers: int, on_pair: Callable[[], None] = lambda: None) -> Source:
    """The source without the pairs that cannot be prepared; those are logged by name.

    Raises
    ------
    ValueError
        No pair is left.
    """
    if source.cache.folder is None:
        return source
    missing = [index for index in source.usable if not source.is_prepared(index)]
    for _ in range(len(source.usable) - len(missing)):
        on_pair()
    problems: dict[int, str] = {}
    for index, problem in _run(source, missing, workers):
        on_pair()
        if problem is not None:
            problems[index] = problem
            _log.warning("%s: pair %s is left out: %s", source.title, source.ids[index], problem)
    usable = tuple(index for index in source.usable if index not in problems)
    if not usable:
        first = next(iter(problems.values()))
        raise ValueError(f"{source.title}: none of {len(problems)} pairs can be prepared; the first: {first}")
    return source.only(usable)


def _run(source: OpenedSource, missing: list[int], workers: int) -> Iterator[tuple[int, str | None]]:
    yield from spread(_prepare, ((source, index) for index in missing), workers)


def _prepare(source: OpenedSource, index: int) -> tuple[int, str | None]:
    with one_thread():
        return index, source.prepare(index)
