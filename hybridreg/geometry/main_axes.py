# SPDX-License-Identifier: MIT
"""The three main directions that the surfaces of a place face."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Rows = NDArray[np.int64]

# Fixed-point steps to the main axes; each about squares the error.
_TURNS = 12  # at most; by hand
_STILL = 1e-6  # change at which they have converged, no unit; by hand
# Normals of a cloud that the axes are computed from.
_SAMPLE = 1_000


def main_axes(*facing: Array) -> Array:
    """Three orthogonal directions (..., 3, 3), rows, around which the normals (..., n, 3) of one or more clouds
    cluster, the most common first; every cloud has the same weight. They may form a left-handed frame.

    Eigenvectors of the normals' scatter alone are ambiguous where two directions are equally common (the floor and the
    walls of a room). From there the sum of fourth powers of the normals' components is maximised over rotations, by
    the fixed-point iteration that independent component analysis uses for kurtosis.
    """
    some = [n[..., :: max(1, n.shape[-2] // _SAMPLE), :] for n in facing]
    normals = np.concatenate(some, axis=-2)
    weight = np.concatenate([np.full(n.shape[-2], 1.0 / n.shape[-2]) for n in some])[:, None]
    axes = np.swapaxes(np.linalg.eigh(np.swapaxes(weight * normals, -1, -2) @ normals)[1], -1, -2)
    moving = np.ones(axes.shape[:-2], dtype=bool)
    for _ in range(_TURNS):
        along = normals @ np.swapaxes(axes, -1, -2)
        cubed = weight * (along * along * along)  # ** 3 takes five times as long
        U, _, Vt = np.linalg.svd(np.swapaxes(cubed, -1, -2) @ normals)
        before, axes = axes, np.where(moving[..., None, None], U @ Vt, axes)
        moving = np.abs(axes - before).max(axis=(-2, -1)) >= _STILL
        if not moving.any():
            break
    nearest = faced(normals, axes)
    share = np.stack([(weight[:, 0] * (nearest == axis)).sum(axis=-1) for axis in range(3)], axis=-1)
    return np.take_along_axis(axes, np.argsort(-share, axis=-1)[..., None], axis=-2)


def faced(normals: Array, axes: Array) -> Rows:
    """The axis (..., 3, 3) that each normal (..., n, 3) is nearest to, (..., n)."""
    axis: Rows = np.argmax(np.abs(normals @ np.swapaxes(axes, -1, -2)), axis=-1)
    return axis


def balanced(normals: Array, n: int) -> Rows:
    """At most n rows, in random order, that face each main axis equally often, as far as there are such rows.

    On a field nine points in ten lie on the ground, which does not constrain a shift along it; normal-space sampling
    (Rusinkiewicz and Levoy 2001) gives the few other points their weight.
    """
    axis = faced(normals, main_axes(normals))
    rng = np.random.default_rng(0)
    groups = sorted((rng.permutation(np.flatnonzero(axis == k)) for k in range(3)), key=len)
    kept: list[Rows] = []
    for k, group in enumerate(groups):
        kept.append(group[: (n - sum(map(len, kept))) // (3 - k)])
    return rng.permutation(np.concatenate(kept))
