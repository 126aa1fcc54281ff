# SPDX-License-Identifier: MIT
"""Grids of the sides of things: what lies beyond a cloud's ends takes no part, so that no shift wraps around."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np

from hybridreg.search.axis_turns import _CELLS, _Sides


def test_the_few_points_beyond_the_ends_are_left_out_on_either_side() -> None:
    rng = np.random.default_rng(0)
    points = rng.uniform(0.0, 10.0, (1000, 3))
    points[:4] += [15.0, 0.0, 0.0]
    points[4:8] -= [15.0, 0.0, 0.0]
    facing = np.eye(3)[rng.integers(0, 3, len(points))]
    view = cast(Any, SimpleNamespace(points=points, normals=facing, settling=np.arange(len(points))))
    sides = _Sides(view, np.eye(3))
    held = sides.grid(sides.extent / (0.49 * _CELLS))
    _, x, y, z = np.nonzero(held)
    assert max(x.max(), y.max(), z.max()) < _CELLS / 2
    assert len(x) > 500
