# SPDX-License-Identifier: MIT
"""A campus: buildings at angles on sloping lawns, paths, groups of trees, walls, benches, bicycles."""

from __future__ import annotations

import numpy as np

from hybridreg.data.simulate.world.buildings import building
from hybridreg.data.simulate.world.furniture import fence, lamp, wall
from hybridreg.data.simulate.world.layout import Layout, Surface
from hybridreg.data.simulate.world.materials import MATERIAL_INDEX
from hybridreg.data.simulate.world.plants import hedge
from hybridreg.data.simulate.world.pool import one_of
from hybridreg.data.simulate.world.scenes.backdrop import add_backdrop
from hybridreg.data.simulate.world.scenes.scatter import (
    add_car,
    add_furniture,
    add_people,
    in_box,
    plant_bushes,
    plant_trees,
    spot,
)
from hybridreg.data.simulate.world.uneven_ground import Terrain


def _paths(rng: np.random.Generator) -> Surface:
    """Three straight paths and a forecourt over grass."""
    angle, shift, width = rng.uniform(0, np.pi, 3), rng.uniform(-12, 12, 3), rng.uniform(1.2, 4.0, 3)
    court = rng.uniform(4, 14)
    hard = MATERIAL_INDEX[str(rng.choice(["paving", "asphalt", "gravel"]))]
    soft = MATERIAL_INDEX[str(rng.choice(["grass", "grass", "soil"]))]

    def surface(x: np.ndarray, y: np.ndarray) -> np.ndarray:
        path = np.hypot(x, y) < court
        for a, s, w in zip(angle, shift, width, strict=True):
            path |= np.abs(np.cos(a) * x + np.sin(a) * y - s) < w
        return np.where(path, hard, soft)

    return surface


def campus(rng: np.random.Generator) -> Layout:
    """Buildings on every side, not necessarily parallel to each other."""
    terrain = Terrain.draw(rng, rng.uniform(0.4, 1.0))
    layout = Layout(terrain, _paths(rng), lambda r: spot(r, 30))
    layout.still.append(terrain.mesh(rng, 0.025))
    square = rng.random() < 0.4
    for _ in range(int(rng.integers(7, 15))):
        _place_building(layout, rng, square)
    plant_trees(layout, in_box(rng, (-75, -75), (75, 75), int(rng.integers(10, 42))), rng)
    plant_bushes(layout, in_box(rng, (-50, -50), (50, 50), int(rng.integers(5, 30))), rng)
    _borders(layout, rng)
    add_furniture(
        layout, in_box(rng, (-40, -40), (40, 40), int(rng.integers(8, 26))), rng.uniform(0, 6.28), rng
    )
    for xy in in_box(rng, (-45, -45), (45, 45), int(rng.integers(3, 12))):
        layout.put(one_of(lamp, rng), xy, rng.uniform(0, 6.28), (0.2, 0.2))
    for xy in in_box(rng, (-45, -45), (45, 45), int(rng.integers(0, 9))):
        add_car(layout, xy, rng.uniform(0, 6.28), rng, leaves=0.25)
    add_people(layout, in_box(rng, (-35, -35), (35, 35), int(rng.integers(4, 22))), rng)
    add_backdrop(layout, rng)
    return layout


def _place_building(layout: Layout, rng: np.random.Generator, square: bool) -> None:
    angle = rng.uniform(0, 2 * np.pi)
    size = np.array([rng.uniform(12, 42), rng.uniform(10, 20), rng.uniform(4, 22)])
    xy = rng.uniform(17, 72) * np.array([np.cos(angle), np.sin(angle)]) + 0.4 * size[1] * np.array(
        [np.cos(angle), np.sin(angle)]
    )
    yaw = float(rng.choice([0, np.pi / 2])) if square else rng.uniform(0, np.pi)
    if not layout.free(xy, float(size[0]) / 2) or np.linalg.norm(xy) < size[0] / 2 + 5:
        return
    base = layout.terrain.height_at(xy) - 1.5
    layout.still.append(building(xy, size + [0, 0, 1.5], yaw, base, rng, np.zeros(2)))
    layout.claim(xy, (size[0] / 2, size[1] / 2), yaw)


def _borders(layout: Layout, rng: np.random.Generator) -> None:
    for _ in range(int(rng.integers(1, 6))):
        start = rng.uniform(-35, 35, 2)
        yaw, length = rng.uniform(0, 6.28), rng.uniform(5, 22)
        end = start + length * np.array([np.cos(yaw), np.sin(yaw)])
        middle = (start + end) / 2
        if not layout.free(middle, length / 2):
            continue
        layout.claim(middle, (length / 2, 0.5), yaw)
        kind = rng.integers(3)
        if kind == 0:
            layout.still.append(fence(rng, layout.line(start, end, 2.4)))
        elif kind == 1:
            layout.still.append(wall(rng, layout.line(start, end, 5.0), rng.uniform(0.5, 2.4)))
        else:
            layout.still.append(layout.on_ground(hedge(rng, length), middle, yaw))
