# SPDX-License-Identifier: MIT
"""Registered pairs of many clouds, and which of them agree with one another."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from hybridreg.geometry import se3
from hybridreg.resolution import Tolerance
from hybridreg.runtime.read_only import lock

Array = NDArray[np.float64]
Role = Literal["tree", "loop", "contradicts", "failed"]

# Spanning trees that are drawn; degrees that a link may be off, for each root of the links that lie between.
_TREES, DEGREES = 300, 2.0


@dataclass(frozen=True, eq=False, kw_only=True)
class Link:
    """One registered pair.

    Attributes
    ----------
    source, target : int
        Rows of the clouds.
    T_target_source : (4, 4) float64
    verdict : "ok", "doubtful", "failed", or "given" for a pose of the caller's that the clouds neither confirm nor deny
    confidence : float in [0, 1]
    metres : float
        How far off a right pose may be.
    role : "tree", "loop", "contradicts" or "failed"
        What became of it: "contradicts" disagrees with what most others say together.
    rivals : (r, 4, 4) float64
        Other poses that explain both clouds nearly as well.
    off : Tolerance or None
        How far away the caller's pose lies, where one was given and the clouds were registered.
    """

    source: int
    target: int
    T_target_source: Array
    verdict: str
    confidence: float
    metres: float
    role: Role = "failed"
    rivals: Array = field(default_factory=lambda: np.zeros((0, 4, 4)))
    off: Tolerance | None = None

    def __post_init__(self) -> None:
        lock(self, "T_target_source", "rivals")


def placed(n: int, tree: Iterable[Link], root: int) -> Array:
    """Poses (n, 4, 4), cloud to root, along links without a circle; NaN where none lead."""
    beside: dict[int, list[tuple[int, Array]]] = {}
    for link in tree:
        beside.setdefault(link.target, []).append((link.source, link.T_target_source))
        beside.setdefault(link.source, []).append((link.target, se3.inverse(link.T_target_source)))
    poses = np.full((n, 4, 4), np.nan)
    poses[root] = np.eye(4)
    waiting = [root]
    while waiting:
        here = waiting.pop()
        for other, T_here_other in beside.get(here, []):
            if np.isnan(poses[other, 0, 0]):
                poses[other] = poses[here] @ T_here_other
                waiting.append(other)
    return poses


def agrees(link: Link, poses: Array, middles: Array) -> bool:
    """Whether two placed clouds (poses (n, 4, 4)) lie to one another as a link says, at the middle of its source."""
    wanted = poses[link.target] @ link.T_target_source
    if not np.isfinite(wanted).all() or not np.isfinite(poses[link.source]).all():
        return False
    centre = se3.apply(wanted, middles[link.source][None])[0]
    off = Tolerance.between(wanted, poses[link.source], centre)
    return off.metres < link.metres and off.degrees < DEGREES


def best_tree(
    n: int, links: Sequence[Link], middles: Array, rng: np.random.Generator
) -> tuple[list[Link], list[Link]]:
    """The spanning tree with which the most links agree, and those links; of clouds that no links join, a tree for each
    group.

    Trees are drawn with the more certain links first, each link as often as its confidence says; one with a wrong link
    in it disagrees with every circle that the link closes.
    """
    best: tuple[float, list[Link], list[Link]] = (-1.0, [], [])
    weights = np.array([max(link.confidence, 0.01) for link in links])
    for turn in range(_TREES):
        # Exponential races: an order in which the next link is drawn in proportion to its weight.
        order = (
            np.argsort(rng.exponential(size=len(links)) / weights)
            if turn
            else np.argsort(-weights, kind="stable")
        )
        tree = _grown(n, [links[k] for k in order])
        poses = all_placed(n, tree)
        fit = [link for link in links if agrees(link, poses, middles)]
        value = float(sum(link.confidence for link in fit))
        if value > best[0] + 1e-9:
            best = (value, tree, fit)
    return best[1], best[2]


def all_placed(n: int, tree: Sequence[Link]) -> Array:
    """Poses (n, 4, 4), each cloud to the first of the clouds that the tree joins it to."""
    poses = np.full((n, 4, 4), np.nan)
    for group, here in _each_placed(n, tree):
        poses[group] = here[group]
    return poses


def _grown(n: int, links: Sequence[Link]) -> list[Link]:
    # Kruskal's: a link that joins two groups is taken.
    group = list(range(n))

    def top(k: int) -> int:
        while group[k] != k:
            k = group[k]
        return k

    tree = []
    for link in links:
        a, b = top(link.source), top(link.target)
        if a != b:
            group[a] = b
            tree.append(link)
    return tree


def groups(n: int, links: Sequence[Link]) -> list[list[int]]:
    """Clouds that links join, the largest group first."""
    found = [group for group, _ in _each_placed(n, _grown(n, links))]
    return sorted(found, key=lambda group: (-len(group), group[0]))


def _each_placed(n: int, tree: Sequence[Link]) -> Iterator[tuple[list[int], Array]]:
    # Each group of clouds that a tree joins, and poses (n, 4, 4) to the first of these.
    left = set(range(n))
    while left:
        poses = placed(n, tree, min(left))
        group = np.flatnonzero(np.isfinite(poses[:, 0, 0])).tolist()
        yield group, poses
        left -= set(group)
