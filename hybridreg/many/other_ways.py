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
    for other in (*_parts_moved(n, tree, joined, poses, reference), *_one_moved(joined, poses, reference)):
        if all(_agrees_somehow(link, other, middles) for link in joined):
            unsure |= {
                int(k)
                for k in np.flatnonzero(np.any(other != poses, axis=(1, 2)) & np.isfinite(other[:, 0, 0]))
            }
    return sorted(unsure)


def _parts_moved(
    n: int, tree: Sequence[Link], joined: Sequence[Link], poses: Array, reference: int
) -> Iterator[Array]:
    # All that a link of the tree joins to the reference, where a rival of that link puts it.
    for link in tree:
        for T in link.rivals if link in joined else ():
            changed = [replace(each, T_target_source=T) if each is link else each for each in tree]
            there = placed(n, changed, reference)
            side = np.isfinite(placed(n, [each for each in tree if each is not link], reference)[:, 0, 0])
            there[side] = poses[side]
            yield there


def _one_moved(joined: Sequence[Link], poses: Array, reference: int) -> Iterator[Array]:
    # One cloud where a rival of any of its links puts it.
    for link in joined:
        for T in link.rivals:
            for k, there in (
                (link.source, poses[link.target] @ T),
                (link.target, poses[link.source] @ se3.inverse(T)),
            ):
                if k != reference:
                    other = poses.copy()
                    other[k] = there
                    yield other


def _agrees_somehow(link: Link, poses: Array, middles: Array) -> bool:
    return any(
        agrees(replace(link, T_target_source=T), poses, middles) for T in (link.T_target_source, *link.rivals)
    )
