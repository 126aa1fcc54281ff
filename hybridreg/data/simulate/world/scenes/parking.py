# SPDX-License-Identifier: MIT
"""A car park: the same objects over and over, which is what makes it hard."""

from __future__ import annotations

import numpy as np

from hybridreg.data.simulate.world.buildings import building
from hybridreg.data.simulate.world.chance import one
from hybridreg.data.simulate.world.furniture import lamp
from hybridreg.data.simulate.world.layout import Layout
from hybridreg.data.simulate.world.materials import MATERIAL_INDEX
from hybridreg.data.simulate.world.pool import one_of
from hybridreg.data.simulate.world.scenes.backdrop import add_backdrop
from hybridreg.data.simulate.world.scenes.scatter import (
    add_car,
    add_furniture,
    add_people,
    in_box,
    plant_bushes,
    plant_trees,
)
from hybridreg.data.simulate.world.uneven_ground import Terrain


def parking(rng: np.random.Generator) -> Layout:
    """Rows of bays along x with lanes between, hemmed by trees or a building."""
    terrain = Terrain.draw(rng, rng.uniform(0.05, 0.3))
    pitch = rng.uniform(15.5, 18.5)
    asphalt, grass = MATERIAL_INDEX["asphalt"], MATERIAL_INDEX["grass"]
    half = rng.uniform(34, 60)
    layout = Layout(
        terrain,
        lambda x, y: np.where((np.abs(x) < half) & (np.abs(y) < half), asphalt, grass),
        lambda r: np.array([r.uniform(-28, 28), pitch * r.integers(-1, 2) + r.uniform(-2, 2)]),
    )
    layout.still.append(terrain.mesh(rng, 0.012))
    full, bay = rng.uniform(0.4, 0.92), rng.uniform(2.5, 2.9)
    for row in range(-3, 4):
        middle = (row + 0.5) * pitch
        for x in np.arange(-half + 3, half - 3, bay):
            for side in (-1, 1):
                if abs(middle) < half and rng.random() < full * (1.0 if np.hypot(x, middle) < 40 else 0.6):
                    place = np.array([x + rng.normal(0, 0.15), middle + side * 2.6 + rng.normal(0, 0.2)])
                    _parked(layout, place, rng)
        for x in np.arange(-half + 8, half, rng.uniform(20, 35)):
            layout.put(one_of(lamp, rng), np.array([x, middle]), np.pi / 2, (0.2, 0.2))
        if rng.random() < 0.5:
            x = np.arange(-half, half, rng.uniform(9, 20))
            plant_trees(layout, np.c_[x, np.full(len(x), middle)], rng, "round")
    _surround(layout, half, rng)
    add_people(layout, in_box(rng, (-30, -30), (30, 30), int(rng.integers(1, 9))), rng)
    add_backdrop(layout, rng)
    return layout


def _parked(layout: Layout, xy: np.ndarray, rng: np.random.Generator) -> None:
    add_car(layout, xy, one(rng, (-1, 1)) * np.pi / 2 + rng.normal(0, 0.03), rng, leaves=0.1)


def _surround(layout: Layout, half: float, rng: np.random.Generator) -> None:
    for side in range(4):
        angle = side * np.pi / 2
        out = np.array([np.cos(angle), np.sin(angle)])
        across = np.array([-out[1], out[0]])
        if rng.random() < 0.55:
            size = np.array([rng.uniform(20, 60), rng.uniform(12, 25), rng.uniform(4.5, 14)])
            xy = out * (half + 3 + size[1] / 2) + across * rng.uniform(-15, 15)
            base = layout.terrain.height_at(xy) - 1.0
            layout.still.append(building(xy, size, angle + np.pi / 2, base, rng, np.zeros(2)))
            layout.claim(xy, (size[0] / 2, size[1] / 2), angle + np.pi / 2)
        line = out * (half + 2.5) + across * np.arange(-half, half, rng.uniform(5, 12))[:, None]
        plant_trees(layout, line + rng.normal(0, 0.7, line.shape), rng)
        plant_bushes(layout, line + rng.normal(0, 1.5, line.shape), rng)
    add_furniture(layout, in_box(rng, (-half, -half), (half, half), 8), 0.0, rng)
