# SPDX-License-Identifier: MIT
"""Whether many clouds fit together in another way as well.

Links that agree around a circle confirm one another, unless each is as good at another pose: in a square room, or along
a row of equal houses, wrong poses close circles too.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from hybridreg.geometry import se3
from hybridreg.many.links import Link, agrees, placed

Array = NDArray[np.float64]


def elsewhere(n: int, tree: Sequence[Link], fit: Sequence[Link], middles: Array, reference: int) -> list[int]:
    """Clouds that rivals of their links put elsewhere, where as many links agree, at their pose or at a rival.

    Parameters
    ----------
    tree, fit : links
        Those that place the clouds, and all that agree with them.
    middles : (n, 3)
        Of the clouds, each in its own frame.
    """
    poses = placed(n, tree, reference)
    joined = [link for link in fit if np.isfinite(poses[link.source]).all()]
    unsure: set[int] = set()
    for part, other in _moved(n, tree, joined, poses, reference):
        if all(_agrees_somehow(link, other, middles) for link in joined):
            unsure.update(part)
    return sorted(unsure)


def _moved(
    n: int, tree: Sequence[Link], joined: Sequence[Link], poses: Array, reference: int
) -> Iterator[tuple[list[int], Array]]:
    # Some clouds where a rival of a link puts them, and all poses then: the cloud at either end of the link, and where
    # the link is one of the tree, all that it joins to the reference.
    for link in joined:
        beyond = _beyond(n, tree, link, reference)
        for T in link.rivals:
            for k, there in (
                (link.source, poses[link.target] @ T),
                (link.target, poses[link.source] @ se3.inverse(T)),
            ):
                if k == reference:
                    continue
                step = there @ se3.inverse(poses[k])
                for part in ([k], beyond) if k in beyond else ([k],):
                    other = poses.copy()
                    other[part] = step @ poses[part]
                    yield part, other


def _beyond(n: int, tree: Sequence[Link], link: Link, reference: int) -> list[int]:
    # The clouds that a link of the tree joins to the reference; none for others.
    rest = [each for each in tree if each is not link]
    sides = [np.flatnonzero(np.isfinite(placed(n, rest, k)[:, 0, 0])) for k in (link.source, link.target)]
    return next((side.tolist() for side in sides if reference not in side), [])


def _agrees_somehow(link: Link, poses: Array, middles: Array) -> bool:
    return any(
        agrees(replace(link, T_target_source=T), poses, middles) for T in (link.T_target_source, *link.rivals)
    )
