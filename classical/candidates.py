# SPDX-License-Identifier: MIT
"""Several poses, one scene: which of them lays most of the source on the target?"""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hybridreg.classical.gicp import Gicp
from hybridreg.fitness import measure
from hybridreg.matches import Pose
from hybridreg.normals import tree
from hybridreg.scene import Scene

Array = NDArray[np.float64]


class Settled(NamedTuple):
    """A pose `start` (4, 4), where it went when refined (`T`), and the share of the source that then lies on the
    target."""

    start: Array
    T: Array
    overlap: float


def best_first(scene: Scene, starts: Iterable[Array], refine: Gicp | None = None) -> list[Settled]:
    """Refine each of `starts` (4, 4) by GICP and sort by overlap within 1.25 spacings; equals keep their order."""
    refine = refine or Gicp()
    settled = [_settle(scene, start, refine) for start in starts]
    return sorted(settled, key=lambda one: -one.overlap)


def _settle(scene: Scene, start: Array, refine: Gicp) -> Settled:
    T = refine(scene, Pose(start)).T
    overlap = measure(scene.source.points, tree(scene, "target"), T, 1.25 * scene.spacing).fitness
    return Settled(start, T, overlap)
