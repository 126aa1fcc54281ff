# SPDX-License-Identifier: MIT
"""A construction site or industrial yard: containers, pipes, heaps, scaffolding, halls, lorries."""

from __future__ import annotations

import numpy as np

from hybridreg.data.simulate.world.buildings import building
from hybridreg.data.simulate.world.cars import lorry
from hybridreg.data.simulate.world.furniture import (
    bollards,
    container,
    fence,
    heap,
    lamp,
    pipes,
    scaffold,
    wall,
)
from hybridreg.data.simulate.world.layout import Layout
from hybridreg.data.simulate.world.materials import MATERIAL_INDEX
from hybridreg.data.simulate.world.pool import one_of
from hybridreg.data.simulate.world.scenes.backdrop import add_backdrop
from hybridreg.data.simulate.world.scenes.scatter import (
    add_car,
    add_people,
    in_box,
    plant_bushes,
    plant_trees,
    spot,
)
from hybridreg.data.simulate.world.uneven_ground import Terrain


def yard(rng: np.random.Generator) -> Layout:
    """Stacks and machines at arbitrary angles inside a fence."""
    terrain = Terrain.draw(rng, rng.uniform(0.15, 0.8))
    hard, soft = (
        MATERIAL_INDEX[m] for m in rng.choice([["asphalt", "gravel"], ["gravel", "soil"], ["soil", "soil"]])
    )
    seam = rng.normal(0, 1, 2)

    def surface(x: np.ndarray, y: np.ndarray) -> np.ndarray:
        return np.where(np.sin(0.07 * x + seam[0]) + np.sin(0.09 * y + seam[1]) > -0.3, hard, soft)

    layout = Layout(terrain, surface, lambda r: spot(r, 28))
    layout.still.append(terrain.mesh(rng, 0.04))
    _halls(layout, rng)
    _stacks(layout, rng)
    _rim(layout, rng)
    for xy in in_box(rng, (-45, -45), (45, 45), int(rng.integers(3, 12))):
        add_car(layout, xy, rng.uniform(0, 6.28), rng, leaves=0.3)
    for xy in in_box(rng, (-40, -40), (40, 40), int(rng.integers(1, 5))):
        layout.put(one_of(lorry, rng), xy, rng.uniform(0, 6.28), (4.2, 1.3))
    for xy in in_box(rng, (-40, -40), (40, 40), int(rng.integers(2, 7))):
        layout.put(one_of(lamp, rng), xy, rng.uniform(0, 6.28), (0.2, 0.2))
    add_people(layout, in_box(rng, (-30, -30), (30, 30), int(rng.integers(2, 10))), rng)
    plant_bushes(layout, in_box(rng, (-50, -50), (50, 50), int(rng.integers(5, 25))), rng)
    add_backdrop(layout, rng)
    return layout


def _halls(layout: Layout, rng: np.random.Generator) -> None:
    for _ in range(int(rng.integers(2, 7))):
        angle = rng.uniform(0, 6.28)
        size = rng.uniform([15, 12, 5], [45, 25, 14])
        xy = (rng.uniform(14, 45) + size[0] / 2) * np.array([np.cos(angle), np.sin(angle)])
        yaw = angle + rng.choice([0, np.pi / 2]) + rng.normal(0, 0.15)
        if layout.free(xy, float(size[0]) / 2):
            base = layout.terrain.height_at(xy) - 1.0
            layout.still.append(building(xy, size, yaw, base, rng, np.zeros(2)))
            layout.claim(xy, (float(size[0]) / 2, float(size[1]) / 2), yaw)


def _stacks(layout: Layout, rng: np.random.Generator) -> None:
    for xy in in_box(rng, (-48, -48), (48, 48), int(rng.integers(6, 20))):
        yaw, kind = rng.uniform(0, 6.28), rng.choice(4, p=[0.4, 0.2, 0.3, 0.1])
        if kind == 0:
            layout.put(one_of(container, rng), xy, yaw, (4.0, 1.3))
        elif kind == 1:
            layout.put(one_of(pipes, rng), xy, yaw, (3.2, 1.2))
        elif kind == 2:
            layout.put(one_of(heap, rng), xy, 0.0, (1.8, 1.8))
        else:
            layout.put(scaffold(rng, rng.uniform(6, 16)), xy, yaw, (5.0, 1.0))


def _rim(layout: Layout, rng: np.random.Generator) -> None:
    half = rng.uniform(35, 55)
    corners = half * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    for i in range(4):
        start, end = corners[i], corners[(i + 1) % 4]
        if rng.random() < 0.6:
            layout.still.append(fence(rng, layout.line(start, end, 3.0)))
        elif rng.random() < 0.5:
            layout.still.append(wall(rng, layout.line(start, end, 6.0), rng.uniform(1.5, 3.0)))
    x = rng.uniform(-20, 20, 2)
    layout.still.append(bollards(layout.line(x, x + [8, 0], 1.6)))
    plant_trees(layout, corners[rng.integers(4, size=12)] + rng.normal(0, 18, (12, 2)), rng)
