# SPDX-License-Identifier: MIT
"""Kernel points of a KPConv: spread in the unit ball by repulsion, or on half circles (docs/methods.md 3.1)."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import numpy.typing as npt

_MEAN_RADIUS = 0.66
_STEPS = 600
# Radii of the half circles, in search radii; by hand.
_INNER = 0.45
_OUTER = 0.9


@lru_cache(maxsize=8)
def _disposition(n_points: int) -> npt.NDArray[np.float64]:
    """(n_points, 3): the first at the centre, the others repelled by 1/d and attracted to the centre by 10 r^2."""
    rng = np.random.default_rng(0)
    points = rng.normal(size=(n_points, 3)) * 0.3
    points[0] = 0.0
    for step in range(_STEPS):
        rate = 0.01 * 0.995**step
        move = np.clip(-_gradient(points) * rate, -0.05, 0.05)
        points[1:] += move[1:]
    radius = np.linalg.norm(points[1:], axis=1).mean()
    return points * (_MEAN_RADIUS / radius)


def _gradient(points: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    difference = points[:, None] - points[None]
    distance = np.linalg.norm(difference, axis=-1) + np.eye(len(points))
    return 20.0 * points - (difference / distance[..., None] ** 3).sum(1)


def kernel_points(
    n_points: int, radius: float, rng: np.random.Generator | None = None
) -> npt.NDArray[np.float32]:
    """Kernel points of one layer.

    Parameters
    ----------
    n_points
        15 in every published network.
    radius
        Search radius of the layer in metres.
    rng
        Rotates the points about z and adds normal noise of 0.01 radii, as the original does for each layer; ``None``
        leaves them unchanged, so that the layers of a stage can share them.

    Returns
    -------
    ndarray
        (n_points, 3) float32, metres.
    """
    points = _disposition(n_points)
    if rng is not None:
        angle = rng.uniform(0.0, 2 * np.pi)
        cos, sin = np.cos(angle), np.sin(angle)
        turned = points @ np.array([[cos, sin, 0.0], [-sin, cos, 0.0], [0.0, 0.0, 1.0]])
        points = turned + rng.normal(scale=0.01, size=points.shape)
    return (points * radius).astype(np.float32)


def cylindrical_kernel_points(n_points: int, radius: float) -> npt.NDArray[np.float32]:
    """Kernel points (n_points, 3) float32 in metres for offsets folded about the vertical axis, all with y = 0.

    One in the middle, the others evenly on two half circles around it: a neighbour's coordinates are its distance from
    the axis and its height, so that the convolution is invariant to yaw.
    """
    inner = round((n_points - 1) * _INNER / (_INNER + _OUTER))
    places = [np.zeros((1, 2))]
    for share, count in ((_INNER, inner), (_OUTER, n_points - 1 - inner)):
        angle = np.linspace(-np.pi / 2, np.pi / 2, count)
        places.append(share * np.column_stack([np.cos(angle), np.sin(angle)]))
    across, up = (np.concatenate(places) * radius).T
    return np.column_stack([across, np.zeros(n_points), up]).astype(np.float32)
