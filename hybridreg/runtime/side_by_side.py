# SPDX-License-Identifier: MIT
"""The same work on both clouds of a pair, in a thread each."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

from hybridreg.runtime.cores import n_threads

Given = TypeVar("Given")
Value = TypeVar("Value")


def side_by_side(make: Callable[[Given], Value], *of: Given) -> list[Value]:
    """`make` of each, at the same time where there is a second core.

    For sorting, trees and arithmetic on long arrays, which release the interpreter's lock; nothing else gains.
    """
    threads = min(len(of), n_threads())
    if threads < 2:
        return [make(one) for one in of]
    with ThreadPoolExecutor(threads) as pool:
        return list(pool.map(make, of))
