# SPDX-License-Identifier: MIT
"""How many points meet under each shift: counted among the cells that hold a point, whatever the cloud's extent."""

from __future__ import annotations

import tracemalloc

import numpy as np

from hybridreg.search.repeats import _Cells


def test_counts_are_those_of_every_shift_tried_by_itself() -> None:
    rng = np.random.default_rng(1)
    for extent in ([6.0, 6.0, 2.0], [40.0, 5.0, 1.0], [3.0, 60.0, 8.0]):
        held, points = rng.uniform(-np.array(extent), extent, (400, 3)), rng.uniform(-20.0, 20.0, (60, 3))
        cells = {tuple(cell) for cell in np.floor(held / 0.5).astype(int).tolist()}
        met = _Cells(held, 0.5).met(points, (4, 6))
        for i in range(-4, 5):
            for j in range(-6, 7):
                moved = np.floor(points / 0.5).astype(int) + [i, j, 0]
                assert met[i + 4, j + 6] == sum(tuple(cell) in cells for cell in moved.tolist())


def test_a_wide_sparse_cloud_costs_no_memory() -> None:
    """Thirty-five points within hundreds of metres, cells of centimetres: a full grid took 3 GB."""
    points = np.random.default_rng(2).uniform(-300.0, 300.0, (35, 3))
    tracemalloc.start()
    met = _Cells(points, 0.05).met(points, (20, 60))
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert met[20, 60] == 35
    assert peak < 20e6
