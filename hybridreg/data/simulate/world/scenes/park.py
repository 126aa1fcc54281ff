# SPDX-License-Identifier: MIT
"""Parks and woods: irregular, hardly a flat wall in sight."""

from __future__ import annotations

import numpy as np

from hybridreg.data.simulate.world.buildings import building
from hybridreg.data.simulate.world.furniture import fence, heap, lamp
from hybridreg.data.simulate.world.layout import Layout
from hybridreg.data.simulate.world.materials import MATERIAL_INDEX
from hybridreg.data.simulate.world.plants import hedge
from hybridreg.data.simulate.world.pool import one_of
from hybridreg.data.simulate.world.scenes.backdrop import add_backdrop
from hybridreg.data.simulate.world.scenes.scatter import (
    add_furniture,
    add_people,
    in_box,
    plant_bushes,
    plant_trees,
)
from hybridreg.data.simulate.world.uneven_ground import Terrain


def _with_path(rng: np.random.Generator, ground: str, relief: float, bumps: float) -> Layout:
    terrain = Terrain.draw(rng, relief)
    width, sway, length = rng.uniform(1.0, 2.5), rng.uniform(2, 7), rng.uniform(40, 90)
    way, soft = MATERIAL_INDEX[str(rng.choice(["gravel", "asphalt", "soil"]))], MATERIAL_INDEX[ground]

    def surface(x: np.ndarray, y: np.ndarray) -> np.ndarray:
        return np.where(np.abs(y - sway * np.sin(2 * np.pi * x / length)) < width, way, soft)

    def stand(r: np.random.Generator) -> np.ndarray:
        x = r.uniform(-30, 30)
        return np.array([x, sway * np.sin(2 * np.pi * x / length) + r.normal(0, 3.0)])

    layout = Layout(terrain, surface, stand)
    layout.still.append(terrain.mesh(rng, bumps))
    return layout


def park(rng: np.random.Generator) -> Layout:
    """Lawns with scattered trees, hedges, benches, now and then a house at the rim."""
    layout = _with_path(rng, str(rng.choice(["grass", "grass", "meadow"])), rng.uniform(0.5, 1.4), 0.03)
    for _ in range(int(rng.integers(1, 5))):
        angle, far = rng.uniform(0, 6.28), rng.uniform(28, 65)
        xy, size = far * np.array([np.cos(angle), np.sin(angle)]), rng.uniform([8, 7, 3.5], [25, 14, 12])
        base = layout.terrain.height_at(xy) - 1.0
        layout.still.append(building(xy, size, rng.uniform(0, 3.14), base, rng, np.zeros(2)))
        layout.claim(xy, (float(size[0]) / 2, float(size[0]) / 2))
    plant_trees(layout, in_box(rng, (-70, -70), (70, 70), int(rng.integers(22, 55))), rng)
    plant_bushes(layout, in_box(rng, (-55, -55), (55, 55), int(rng.integers(15, 45))), rng)
    for _ in range(int(rng.integers(0, 5))):
        xy, yaw, length = rng.uniform(-35, 35, 2), rng.uniform(0, 3.14), rng.uniform(4, 15)
        if layout.free(xy, length / 2):
            layout.claim(xy, (length / 2, 0.6), yaw)
            layout.still.append(layout.on_ground(hedge(rng, length), xy, yaw))
    for xy in in_box(rng, (-40, -12), (40, 12), int(rng.integers(2, 8))):
        layout.put(one_of(lamp, rng), xy, rng.uniform(0, 6.28), (0.2, 0.2))
    add_furniture(
        layout, in_box(rng, (-35, -15), (35, 15), int(rng.integers(4, 15))), rng.uniform(0, 6.28), rng
    )
    add_people(layout, in_box(rng, (-30, -20), (30, 20), int(rng.integers(3, 15))), rng)
    add_backdrop(layout, rng)
    return layout


def woods(rng: np.random.Generator) -> Layout:
    """Trunks and undergrowth on rough ground, a track, a fence, a heap of timber."""
    layout = _with_path(rng, str(rng.choice(["soil", "meadow", "meadow"])), rng.uniform(0.8, 1.8), 0.06)
    kind = str(rng.choice(["round", "conifer", "mixed"]))
    places = in_box(rng, (-65, -65), (65, 65), int(rng.integers(60, 95)))
    plant_trees(layout, places, rng, None if kind == "mixed" else kind)
    plant_bushes(layout, in_box(rng, (-50, -50), (50, 50), int(rng.integers(30, 80))), rng)
    for xy in in_box(rng, (-35, -35), (35, 35), int(rng.integers(1, 5))):
        layout.put(one_of(heap, rng), xy, 0.0, (1.5, 1.5))
    start = rng.uniform(-30, 30, 2)
    layout.still.append(fence(rng, layout.line(start, start + rng.uniform(-30, 30, 2), 2.5)))
    add_people(layout, in_box(rng, (-25, -15), (25, 15), int(rng.integers(0, 5))), rng)
    add_backdrop(layout, rng)
    return layout
