# SPDX-License-Identifier: MIT
"""Measured facts of a data set: motions, overlaps, kinds of sensors, the poses' direction."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hybridreg.data.lists import azimuth
from hybridreg.data.lists.direction import CURE, Direction, overlap, spread
from hybridreg.data.lists.listed import ListedPairs
from hybridreg.geometry import se3
from hybridreg.pair import LabelledPair

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False, kw_only=True)
class Summary:
    """Facts of a data set: clouds over the pairs that were read, poses over all pairs where they are known without
    reading.

    Attributes
    ----------
    n_pairs, n_read, n_images : int
        Pairs in the set; read for this; of those, with a camera image.
    fields : tuple of str
        Columns of the data set's own list.
    roles : mapping of "source" and "target" to counts by (sensor's name, kind by `hybridreg.data.lists.azimuth`)
    points : mapping of "source" and "target" to the median number of points
    translation_m, rotation_deg : (n,)
        Size of the true motions: the errors of the identity.
    overlaps : (n_read,)
    direction : Direction
    cure : str
        What to do if the poses are inverted.
    """

    n_pairs: int
    n_read: int
    n_images: int
    fields: tuple[str, ...]
    roles: dict[str, Counter[tuple[str, str]]]
    points: dict[str, int]
    translation_m: Array
    rotation_deg: Array
    overlaps: Array
    direction: Direction
    cure: str


def summarise(pairs: Sequence[LabelledPair], n: int = 50) -> Summary:
    """Read up to `n` pairs, spread evenly over the set, and measure them.

    Raises
    ------
    ValueError
        No pairs.
    """
    if len(pairs) == 0:
        raise ValueError("the data set has 0 pairs; there is nothing to measure")
    read: Callable[[int], LabelledPair] = getattr(pairs, "read", pairs.__getitem__)
    radius = float(getattr(pairs, "overlap_radius", 0.5))
    seen = [_Seen.of(read(row), radius) for row in spread(len(pairs), n)]
    motions = (
        [e.T_target_source for e in pairs.entries] if isinstance(pairs, ListedPairs) else [s.T for s in seen]
    )
    both = [(s.overlap, s.inverse_overlap) for s in seen]
    return Summary(
        n_pairs=len(pairs),
        n_read=len(seen),
        n_images=sum(s.has_image for s in seen),
        fields=tuple(getattr(pairs, "fields", ())),
        roles={side: Counter(s.roles[side] for s in seen) for side in ("source", "target")},
        points={side: int(np.median([s.points[side] for s in seen])) for side in ("source", "target")},
        translation_m=np.array([np.linalg.norm(T[:3, 3]) for T in motions]),
        rotation_deg=np.array([se3.angle_deg(T[:3, :3]) for T in motions]),
        overlaps=np.array([given for given, _ in both]),
        direction=Direction.of(both, radius),
        cure=getattr(pairs, "if_inverted", "") or CURE,
    )


@dataclass(frozen=True)
class _Seen:
    T: Array
    overlap: float
    inverse_overlap: float
    has_image: bool
    roles: dict[str, tuple[str, str]]
    points: dict[str, int]

    @classmethod
    def of(cls, labelled: LabelledPair, radius: float) -> _Seen:
        clouds: dict[str, Any] = {"source": labelled.pair.source, "target": labelled.pair.target}
        return cls(
            T=labelled.T_target_source,
            overlap=overlap(labelled, radius),
            inverse_overlap=overlap(labelled, radius, inverted=True),
            has_image=labelled.pair.has_image,
            roles={
                side: (_sensor(labelled, side), azimuth.coverage(c.points).role) for side, c in clouds.items()
            },
            points={side: len(c) for side, c in clouds.items()},
        )


def _sensor(labelled: LabelledPair, side: str) -> str:
    cloud = getattr(labelled.pair, side)
    return str(cloud.sensor or labelled.pair.meta.get(f"{side}_sensor", ""))
