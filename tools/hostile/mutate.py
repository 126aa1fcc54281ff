# SPDX-License-Identifier: MIT
"""Mutations of values, keys and nesting of TOML and JSON."""

from __future__ import annotations

import copy
import datetime
from collections.abc import Iterator
from typing import Any

from hypothesis import strategies as st

Change = tuple[Any, ...]

_ODD: tuple[Any, ...] = (
    -1, 0, 1, 2, 3, 7, 2**31, 2**63 - 1, -0.5, 0.3, 1.0, 1e-300, 1e300, float("nan"), float("inf"), True, False,
    "", "none", "omp", "fpfh", "os:system", "hybridreg.classical.voxel:VoxelGrid", "estimate.kiss", "../..",
    "\x00", "é" * 50, [], {}, [[]], [1, "a", {}], [0.5, 0.25], [-1.0], {"stage": "none"},
    {"stage": "estimate.candidates"},    {"stage": 3}, {"stage": "voxel", "voxel": "a"}, {"estimate": "kiss"},
    datetime.date(2024, 2, 29),
)  # fmt: skip
_WORDS = (
    "voxel",
    "stage",
    "of",
    "refine",
    "radius",
    "iterations",
    "weights",
    "data",
    "rows",
    "__class__",
    "seed",
    "T",
)


def changes() -> st.SearchStrategy[tuple[Change, ...]]:
    """Up to four changes; positions are numbers that wrap around the existing leaves."""
    place, value = st.integers(0, 60), st.sampled_from(_ODD)
    return st.lists(
        st.one_of(
            st.tuples(st.just("value"), place, value),
            st.tuples(st.just("value"), place, value),
            st.tuples(st.just("delete"), place),
            st.tuples(st.just("rename"), place, st.sampled_from(_WORDS)),
            st.tuples(st.just("add"), place, st.sampled_from(_WORDS), value),
            st.tuples(st.just("wrap"), place),
        ),
        min_size=1,
        max_size=4,
    ).map(tuple)


def changed(content: Any, todo: tuple[Change, ...]) -> Any:
    """A changed copy of nested dictionaries and lists."""
    held = [copy.deepcopy(content)]
    for kind, place, *rest in todo:
        places = list(_places(held))
        parent, key = places[place % len(places)]
        if kind == "value":
            parent[key] = copy.deepcopy(rest[0])
        elif kind == "wrap":
            parent[key] = [parent[key]]
        elif kind == "delete" and parent is not held:
            del parent[key]
        elif kind == "rename" and isinstance(parent, dict):
            parent[rest[0]] = parent.pop(key)
        elif kind == "add" and isinstance(parent, dict):
            parent[rest[0]] = copy.deepcopy(rest[1])
    return held[0]


def _places(content: Any) -> Iterator[tuple[Any, Any]]:
    keys = list(content) if isinstance(content, dict) else range(len(content))
    for key in keys:
        yield content, key
        if isinstance(content[key], (dict, list)):
            yield from _places(content[key])
