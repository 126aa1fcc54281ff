# SPDX-License-Identifier: MIT
"""Degenerate scenes: a corridor (the long axis is poorly constrained) and an open field (yaw is poorly constrained)."""

from __future__ import annotations

import numpy as np

from hybridreg.data.simulate.world.furniture import container, heap, wall
from hybridreg.data.simulate.world.layout import Layout
from hybridreg.data.simulate.world.materials import MATERIAL_INDEX
from hybridreg.data.simulate.world.scenes.scatter import (
    add_furniture,
    add_people,
    in_box,
    plant_bushes,
    plant_trees,
)
from hybridreg.data.simulate.world.solids import boxes
from hybridreg.data.simulate.world.uneven_ground import Terrain


def corridor(rng: np.random.Generator) -> Layout:
    """Two long walls along x, an underpass or a lane: a few piers and small objects here and there, otherwise bare."""
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
        _piers(layout, side * half, height, rng)
        along = rng.uniform(-45, 45, int(rng.integers(2, 7)))
        add_furniture(layout, np.c_[along, np.full(len(along), side * (half - 0.7))], 0.0, rng)
    add_people(layout, in_box(rng, (-30, -half + 0.5), (30, half - 0.5), int(rng.integers(0, 3))), rng)
    return layout


def _piers(layout: Layout, y: float, height: float, rng: np.random.Generator) -> None:
    # At irregular intervals, as a regular row would fit equally well one bay off.
    for x in rng.uniform(-55, 55, int(rng.integers(4, 12))):
        width, depth = rng.uniform(0.3, 1.2), rng.uniform(0.2, 0.7)
        size = np.array([width, depth, height * rng.uniform(0.5, 1.0)])
        pier = boxes(np.zeros((1, 3)), size, 0.0, "concrete", (0.58, 0.57, 0.55))
        layout.put(pier, np.array([x, y - np.sign(y) * depth / 2]), 0.0, (width / 2, depth / 2))


def open_field(rng: np.random.Generator) -> Layout:
    """Grass to the horizon with a tree, a bush, a post or a heap here and there."""
    terrain = Terrain.draw(rng, rng.uniform(0.02, 0.15))
    ground = MATERIAL_INDEX[str(rng.choice(["grass", "soil", "asphalt"]))]
    layout = Layout(terrain, lambda x, y: np.full(x.shape, ground), lambda r: r.uniform(-30, 30, 2))
    layout.still.append(terrain.mesh(rng, 0.015))
    angle = rng.uniform(0, 6.28, int(rng.integers(0, 8)))
    plant_trees(layout, 95 * np.c_[np.cos(angle), np.sin(angle)], rng)
    for thing in (container, heap):
        for xy in rng.uniform(-50, 50, (int(rng.integers(0, 3)), 2)):
            layout.put(thing(rng), xy, rng.uniform(0, 6.28), (3.0, 1.5))
    plant_trees(layout, in_box(rng, (-50, -50), (50, 50), int(rng.integers(2, 7))), rng)
    plant_bushes(layout, in_box(rng, (-50, -50), (50, 50), int(rng.integers(2, 9))), rng)
    add_furniture(layout, in_box(rng, (-50, -50), (50, 50), int(rng.integers(2, 9))), 0.0, rng)
    return layout
