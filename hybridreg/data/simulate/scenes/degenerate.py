# SPDX-License-Identifier: MIT
"""Scenes that do not fix a pose: a corridor (nothing holds the long axis) and an open field (nothing holds yaw)."""

from __future__ import annotations

import numpy as np

from hybridreg.data.simulate.furniture import wall
from hybridreg.data.simulate.ground import Terrain
from hybridreg.data.simulate.layout import Layout
from hybridreg.data.simulate.materials import MATERIAL_INDEX
from hybridreg.data.simulate.scenes.scatter import add_people, in_box, plant_bushes, plant_trees


def corridor(rng: np.random.Generator) -> Layout:
    """Two long plain walls along x, an underpass or a lane between blank walls."""
    terrain = Terrain.draw(rng, 0.05)
    half, asphalt = rng.uniform(2.0, 5.0), MATERIAL_INDEX["asphalt"]
    layout = Layout(
        terrain,
        lambda x, y: np.full(x.shape, asphalt),
        lambda r: np.array([r.uniform(-30, 30), r.uniform(-1, 1) * (half - 1.0)]),
    )
    layout.still.append(terrain.mesh(rng, 0.008))
    height = rng.uniform(3, 8)
    for side in (-1, 1):
        ends = np.array([[-110.0, side * half], [110.0, side * half]])
        layout.still.append(wall(rng, layout.line(ends[0], ends[1], 220.0), height))
    add_people(layout, in_box(rng, (-30, -half + 0.5), (30, half - 0.5), int(rng.integers(0, 3))), rng)
    return layout


def open_field(rng: np.random.Generator) -> Layout:
    """Grass to the horizon with next to nothing on it."""
    terrain = Terrain.draw(rng, rng.uniform(0.02, 0.15))
    ground = MATERIAL_INDEX[str(rng.choice(["grass", "soil", "asphalt"]))]
    layout = Layout(terrain, lambda x, y: np.full(x.shape, ground), lambda r: r.uniform(-30, 30, 2))
    layout.still.append(terrain.mesh(rng, 0.015))
    angle = rng.uniform(0, 6.28, int(rng.integers(0, 8)))
    plant_trees(layout, 95 * np.c_[np.cos(angle), np.sin(angle)], rng)
    plant_bushes(layout, in_box(rng, (-60, -60), (60, 60), int(rng.integers(0, 5))), rng)
    return layout
