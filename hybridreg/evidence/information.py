# SPDX-License-Identifier: MIT
"""How well the surfaces constrain the pose, and along which motion they do not (degeneracy)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hybridreg.evidence.agreement import Agreement
from hybridreg.evidence.views import View
from hybridreg.geometry.point_to_plane import jacobian

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False, kw_only=True)
class Information:
    """Point-to-plane information of a pose.

    Attributes
    ----------
    matrix : (6, 6) float64
        Sum of J^T J over the source's asked points that agree, rotation (radians) before translation (metres), in
        the target's frame about `centre`.
    centre : (3,) float64
        Mean of those points: the centre of the overlap.
    radius : float
        Their root mean square distance from it, metres.
    weakest : float in [0, 1/3]
        Smallest eigenvalue per point, rotations measured in metres at the overlap's radius. A third is the most
        that three directions can share evenly; zero is an unconstrained motion.
    turns : bool
        Whether the weakest motion is a rotation rather than a translation.
    direction : (3,) float64, unit
        Its axis in the target's frame.
    """

    matrix: Array
    centre: Array
    radius: float
    weakest: float
    turns: bool
    direction: Array

    @property
    def words(self) -> str:
        """The poorly constrained motion as a phrase: `along x of the target (0.98 0.17 0.00)`, `in a turn about` it."""
        axis = int(np.argmax(np.abs(self.direction)))
        pointing = np.round(self.direction * np.sign(self.direction[axis]), 2) + 0.0  # no "-0.00"
        numbers = " ".join(f"{x:.2f}" for x in pointing)
        return f"{'in a turn about' if self.turns else 'along'} {'xyz'[axis]} of the target ({numbers})"

    def loosest(self, count: int) -> Array:
        """The motions (count, 6) that the surfaces hold least, a metre each: turns (radians), then shifts."""
        motions = np.linalg.eigh(_in_metres(self.matrix, self.radius))[1].T[:count]
        return motions / np.repeat([self.radius, 1.0], 3)


def measure(agreement: Agreement, target: View) -> Information:
    """Information of the pose under which `agreement` was found."""
    way = agreement.source
    points, normals = way.moved[way.agrees], target.normals[way.match[way.agrees]]
    if len(points) == 0:
        return Information(
            matrix=np.zeros((6, 6)),
            centre=np.zeros(3),
            radius=1.0,
            weakest=0.0,
            turns=False,
            direction=np.array([1.0, 0.0, 0.0]),
        )
    centre = points.mean(axis=0)
    J = jacobian(points - centre, normals)
    matrix = J.T @ J
    radius = float(np.sqrt(np.mean(np.sum((points - centre) ** 2, axis=1)))) or 1.0
    values, vectors = np.linalg.eigh(_in_metres(matrix, radius) / len(points))
    turn, slide = vectors[:3, 0], vectors[3:, 0]
    turns = bool(np.linalg.norm(turn) > np.linalg.norm(slide))
    direction = turn if turns else slide
    return Information(
        matrix=matrix,
        centre=centre,
        radius=radius,
        weakest=max(float(values[0]), 0.0),
        turns=turns,
        direction=direction / np.linalg.norm(direction),
    )


def _in_metres(matrix: Array, radius: float) -> Array:
    # With turns in metres at that radius.
    scale = np.repeat([1.0 / radius, 1.0], 3)
    in_metres: Array = matrix * np.outer(scale, scale)
    return in_metres
