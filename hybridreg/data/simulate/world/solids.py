# SPDX-License-Identifier: MIT
"""Simple bodies, many at a time: one numpy call makes all fence posts of a fence."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hybridreg.data.simulate.sensing.column_arrays import stack
from hybridreg.data.simulate.world.mesh import Colour, Mesh

_BOX = np.array(
    [[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0], [-1, -1, 1], [1, -1, 1], [1, 1, 1], [-1, 1, 1]]
) * [0.5, 0.5, 1.0]
# No bottom: nothing simulated is ever seen from below at the height where it stands on the ground.
_BOX_FACES = np.array(
    [
        [4, 5, 6],
        [4, 6, 7],
        [0, 1, 5],
        [0, 5, 4],
        [1, 2, 6],
        [1, 6, 5],
        [2, 3, 7],
        [2, 7, 6],
        [3, 0, 4],
        [3, 4, 7],
    ],
    np.int32,
)


def _repeat(template: np.ndarray, copies: int, stride: int) -> np.ndarray:
    return (template + np.arange(0, copies * stride, stride, dtype=np.int32)[:, None, None]).reshape(-1, 3)


def boxes(base: np.ndarray, size: np.ndarray, yaw: float | np.ndarray, material: str, tint: Colour) -> Mesh:
    """Boxes standing on `base` (n,3) with edges `size` (n,3), turned by `yaw` (n,) radians; open below."""
    local = _BOX * np.asarray(size).reshape(-1, 1, 3)
    angle = np.asarray(yaw).reshape(-1, 1)
    c, s = np.cos(angle), np.sin(angle)
    x, y = local[..., 0], local[..., 1]
    up = np.broadcast_to(local[..., 2], (len(base), 8))
    east, north, height = (np.asarray(base)[:, k, None] for k in range(3))
    corners = stack(c * x - s * y + east, s * x + c * y + north, up + height)
    return Mesh.of(corners, _repeat(_BOX_FACES, len(base), 8), material, tint)


def tubes(
    start: np.ndarray,
    end: np.ndarray,
    radius_start: float | np.ndarray,
    radius_end: float | np.ndarray,
    material: str,
    tint: Colour,
    sides: int = 6,
) -> Mesh:
    """Tapered tubes from `start` (n,3) to `end` (n,3): poles, trunks, branches, limbs; open at both ends."""
    start, end = np.atleast_2d(start).astype(float), np.atleast_2d(end).astype(float)
    n = len(start)
    axis = _unit(end - start)
    helper = np.where(np.abs(axis[:, 2:3]) > 0.9, [[1.0, 0, 0]], [[0, 0, 1.0]])
    u = _unit(cross(axis, helper))
    v = cross(axis, u)
    angle = np.arange(sides) * (2 * np.pi / sides)
    ring = u[:, None] * np.cos(angle)[:, None] + v[:, None] * np.sin(angle)[:, None]  # (n, sides, 3)
    r0 = np.broadcast_to(np.asarray(radius_start, float), (n,))[:, None, None]
    r1 = np.broadcast_to(np.asarray(radius_end, float), (n,))[:, None, None]
    vertices = np.stack([start[:, None] + r0 * ring, end[:, None] + r1 * ring], 1).reshape(-1, 3)
    k = np.arange(sides)
    j = (k + 1) % sides
    faces = np.concatenate([np.c_[k, j, j + sides], np.c_[k, j + sides, k + sides]])
    return Mesh.of(vertices, _repeat(faces, n, 2 * sides), material, tint)


def quads(corners: np.ndarray, material: str, tint: Colour) -> Mesh:
    """Quadrilaterals with `corners` (n,4,3) in order around."""
    n = len(corners)
    return Mesh.of(corners.reshape(-1, 3), _repeat(np.array([[0, 1, 2], [0, 2, 3]]), n, 4), material, tint)


def loft(rings: np.ndarray, material: str, tint: Colour, closed_ends: bool = True) -> Mesh:
    """A skin over `rings` (S,K,3): car bodies, heads, roofs."""
    stations, around, _ = rings.shape
    i = np.arange(stations - 1)[:, None] * around
    k = np.arange(around)[None]
    j = (k + 1) % around
    a, b, c, d = i + k, i + j, i + around + j, i + around + k
    faces = [np.stack([a, b, c], -1).reshape(-1, 3), np.stack([a, c, d], -1).reshape(-1, 3)]
    if closed_ends:
        fan = np.c_[np.zeros(around - 2, int), np.arange(1, around - 1), np.arange(2, around)]
        faces += [fan, fan + (stations - 1) * around]
    return Mesh.of(rings.reshape(-1, 3), np.concatenate(faces), material, tint)


def ellipsoid(centre: Sequence[float], radii: Sequence[float], material: str, tint: Colour) -> Mesh:
    """A ball of 5 by 8 facets stretched to `radii`."""
    polar = np.linspace(0.15, np.pi - 0.15, 5)[:, None]
    turn = np.linspace(0, 2 * np.pi, 8, endpoint=False)[None]
    unit = np.stack(
        [np.sin(polar) * np.cos(turn), np.sin(polar) * np.sin(turn), np.broadcast_to(np.cos(polar), (5, 8))],
        -1,
    )
    return loft(unit * np.asarray(radii) + np.asarray(centre), material, tint)


def cards(
    centres: np.ndarray, size: np.ndarray, rng: np.random.Generator, material: str, tint: Colour
) -> Mesh:
    """Small randomly turned triangles at `centres` (n,3), `size` (n,) metres wide: leaves, litter, rubble."""
    n = len(centres)
    u = _unit(rng.normal(size=(n, 3)))
    v = _unit(cross(u, rng.normal(size=(n, 3))))
    half = 0.75 * np.broadcast_to(size, (n,))[:, None]
    u, v = u * half, v * half * rng.uniform(0.5, 1.0, (n, 1))
    corners = np.asarray(centres)[:, None] + np.stack([-u - v, u - v, v], 1)
    return Mesh.of(corners.reshape(-1, 3), np.arange(3 * n).reshape(n, 3), material, tint)


def cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Cross products of rows (n,3); numpy's own takes four times as long on short arrays."""
    (ax, ay, az), (bx, by, bz) = a.T, b.T
    return np.stack([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx], -1)


def _unit(rows: np.ndarray) -> np.ndarray:
    return rows / np.maximum(np.sqrt(np.einsum("ij,ij->i", rows, rows)), 1e-9)[:, None]
