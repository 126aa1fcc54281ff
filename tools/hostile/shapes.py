# SPDX-License-Identifier: MIT
"""Degenerate shapes: planes, lines, lattices, duplicates, isolated returns."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hybridreg.testing import sample_pair

Array = NDArray[np.float64]

SHAPES = (
    "scene", "scene", "scene", "box", "gauss", "plane", "tilted plane", "line", "nearly line", "nearly plane",
    "one place", "two places", "duplicates", "lattice", "sphere", "ring", "poles", "far clusters", "lone return",
    "symmetric", "powers",
)  # fmt: skip
SPOILS = ("nan", "inf", "all nan", "huge row", "tiny row", "negative zero", "doubled")


def shape(name: str, n: int, seed: int) -> Array:
    """`n` points (n, 3) of a named shape, tens of metres across."""
    rng = np.random.default_rng(seed)
    uniform = rng.uniform(-10.0, 10.0, (n, 3))
    angle = rng.uniform(0.0, 2 * np.pi, n)
    if name == "scene":
        points = sample_pair(seed % 7, 1000)[0].source.points  # 4,000 and more
        return points[rng.permutation(len(points))[:n]]
    if name == "gauss":
        return rng.normal(0.0, 5.0, (n, 3))
    if name == "sphere":
        return 8.0 * uniform / np.linalg.norm(uniform, axis=1, keepdims=True)
    if name == "ring":
        return np.column_stack([9.0 * np.cos(angle), 9.0 * np.sin(angle), np.full(n, -1.7)])
    if name == "symmetric":
        return np.concatenate([uniform[: n // 2], -uniform[: n // 2], uniform[: n % 2]])
    if name == "powers":
        return np.sign(uniform) * 10.0 ** rng.uniform(-6.0, 6.0, (n, 3))
    return _flattened(name, uniform, rng)


def _flattened(name: str, points: Array, rng: np.random.Generator) -> Array:
    n = len(points)
    if name == "plane":
        points[:, 2] = 0.0
    elif name == "tilted plane":
        points[:, 2] = 0.3 * points[:, 0] - 0.7 * points[:, 1]
    elif name in ("line", "nearly line"):
        points = points[:, :1] * np.array([1.0, 2.0, -0.5]) + (name != "line") * rng.normal(0, 1e-5, (n, 3))
    elif name == "nearly plane":
        points[:, 2] *= 1e-9
    elif name == "one place":
        points[:] = points[:1]
    elif name == "two places":
        points = points[rng.integers(0, 2, n)] if n > 1 else points
    elif name == "duplicates":
        points = points[rng.integers(0, max(n // 10, 1), n)] if n else points
    elif name == "lattice":
        points = np.round(points)
    elif name == "poles":
        points[:, :2] = np.round(points[:, :2] / 10.0) * 10.0
    elif name == "far clusters":
        points[n // 2 :] += 1e5
    elif name == "lone return" and n:
        points[0] = 1e7
    return points


def spoil(points: Array, name: str, seed: int) -> Array:
    """The points, some of them corrupted."""
    if len(points) == 0:
        return points
    rng = np.random.default_rng(seed)
    spoilt, row = points.copy(), rng.integers(0, len(points))
    values = {"nan": np.nan, "inf": -np.inf, "huge row": 1.79e308, "tiny row": 5e-324, "negative zero": -0.0}
    if name in values:
        spoilt[row, rng.integers(0, 3)] = values[name]
    elif name == "all nan":
        spoilt[:] = np.nan
    elif name == "doubled":
        spoilt = np.concatenate([spoilt, spoilt])
    return spoilt
