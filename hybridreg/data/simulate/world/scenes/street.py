# SPDX-License-Identifier: MIT
"""A street between buildings: kerbs, parked and driving cars, trees, lamps, perhaps a crossing."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hybridreg.data.simulate.world.buildings import building
from hybridreg.data.simulate.world.furniture import bollards, fence, lamp, sign, traffic_light
from hybridreg.data.simulate.world.layout import Layout, Surface
from hybridreg.data.simulate.world.materials import MATERIAL_INDEX
from hybridreg.data.simulate.world.mesh import Mesh
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
)
from hybridreg.data.simulate.world.solids import boxes
from hybridreg.data.simulate.world.uneven_ground import Terrain


@dataclass(frozen=True)
class Course:
    """The street's middle line y = bend(x), with its widths in metres."""

    sway: float
    length: float
    phase: float
    road: float  # half the carriageway
    pavement: float
    lawn: float  # between the pavement and the buildings
    crossing: float | None  # x of a side street

    @staticmethod
    def draw(rng: np.random.Generator) -> Course:
        """Anything from a lane between walls to an avenue."""
        return Course(
            rng.uniform(0, 3.5), rng.uniform(60, 160), rng.uniform(0, 6.28),
            float(np.exp(rng.uniform(np.log(2.8), np.log(14)))), rng.uniform(1.6, 5.0),
            float(rng.choice([0.0, rng.uniform(1, 16)], p=[0.35, 0.65])),
            float(rng.uniform(-30, 30)) if rng.random() < 0.45 else None,
        )  # fmt: skip

    def bend(self, x: np.ndarray | float) -> np.ndarray:
        """Middle of the street at `x`."""
        return self.sway * np.sin((2 * np.pi / self.length) * x + self.phase)

    def yaw(self, x: float) -> float:
        """Direction of the street at `x`, radians."""
        return float(np.arctan((self.bend(x + 0.5) - self.bend(x - 0.5)) / 1.0))

    def at(self, x: float, side: float) -> np.ndarray:
        """The place (2,) at `x` along the street and `side` metres to the left of its middle."""
        return np.array([x, float(self.bend(x)) + side])


def _surface(course: Course, verge: str) -> Surface:
    asphalt, paving, other = (MATERIAL_INDEX[m] for m in ("asphalt", "paving", verge))

    def surface(x: np.ndarray, y: np.ndarray) -> np.ndarray:
        off = np.abs(y - course.bend(x))
        if course.crossing is not None:
            off = np.minimum(off, np.abs(x - course.crossing))
        return np.where(
            off < course.road, asphalt, np.where(off < course.road + course.pavement, paving, other)
        )

    return surface


def street(rng: np.random.Generator) -> Layout:
    """A street along x."""
    course = Course.draw(rng)
    terrain = Terrain.draw(rng, rng.uniform(0.1, 0.5))

    def stand(r: np.random.Generator) -> np.ndarray:
        reach = course.road + (course.pavement if r.random() < 0.3 else -0.8)
        return course.at(r.uniform(-34, 34), r.uniform(-reach, reach))

    layout = Layout(terrain, _surface(course, str(rng.choice(["grass", "paving", "gravel"]))), stand)
    layout.still.append(terrain.mesh(rng, 0.012))
    for side in (-1.0, 1.0):
        layout.still.append(_kerb(layout, course, side))
        _houses(layout, course, side, rng)
        _roadside(layout, course, side, rng)
    _traffic(layout, course, rng)
    add_backdrop(layout, rng)
    return layout


def _kerb(layout: Layout, course: Course, side: float) -> Mesh:
    """The pavement as a raised slab in short pieces that follow the ground."""
    x = np.arange(-90, 90, 3.0) + 1.5
    if course.crossing is not None:
        x = x[np.abs(x - course.crossing) > course.road + 1.5]
    y = course.bend(x) + side * (course.road + course.pavement / 2)
    z = layout.terrain.height(x, y) - 0.2
    yaw = np.arctan(course.bend(x + 0.5) - course.bend(x - 0.5))
    size = np.c_[np.full(len(x), 3.05), np.full(len(x), course.pavement), np.full(len(x), 0.33)]
    return boxes(np.c_[x, y, z], size, yaw, "paving", (0.52, 0.51, 0.5))


def _houses(layout: Layout, course: Course, side: float, rng: np.random.Generator) -> None:
    x = -120.0 + rng.uniform(0, 12)
    eye = np.zeros(2)
    mean_height = rng.uniform(5, 18)
    gappy = rng.random() < 0.5
    while x < 120:
        size = np.array(
            [rng.uniform(9, 28), rng.uniform(8, 14), np.clip(rng.normal(mean_height, 2.5), 3.5, 28)]
        )
        mid = x + size[0] / 2
        back = course.road + course.pavement + course.lawn + size[1] / 2 + max(rng.normal(0.4, 1.0), 0.1)
        xy = course.at(mid, side * back)
        off_crossing = course.crossing is None or abs(mid - course.crossing) > size[0] / 2 + course.road + 1
        if off_crossing and rng.random() < 0.93:
            yaw = course.yaw(mid) + (np.pi if side > 0 else 0)
            base = layout.terrain.height_at(xy) - 1.0
            size[2] += 1.0
            layout.still.append(building(xy, size, yaw, base, rng, eye))
            layout.claim(xy, (size[0] / 2, size[1] / 2), yaw)
        x += size[0] + (rng.uniform(1.5, 14) if gappy or not off_crossing else rng.uniform(0, 0.3))


def _roadside(layout: Layout, course: Course, side: float, rng: np.random.Generator) -> None:
    edge = course.road + 0.6
    if rng.random() < 0.75:
        spacing = rng.uniform(5.5, 11)
        for x in np.arange(-75, 75, spacing):
            if rng.random() < 0.72:
                yaw = course.yaw(x) + (0 if side < 0 else np.pi) + rng.normal(0, 0.03)
                add_car(layout, course.at(x + rng.normal(0, 0.6), side * (course.road - 1.15)), yaw, rng)
    for x in np.arange(-80 + rng.uniform(0, 9), 80, rng.uniform(18, 32)):
        layout.put(one_of(lamp, rng), course.at(x, side * edge), -side * np.pi / 2, (0.2, 0.2))
    if rng.random() < 0.75:
        spacing = rng.uniform(5.5, 14)
        x = np.arange(-80, 80, spacing) + rng.normal(0, 0.8, len(np.arange(-80, 80, spacing)))
        line = edge + (0.4 if course.lawn == 0 else course.pavement + 0.5 * course.lawn)
        plant_trees(
            layout,
            np.stack([course.at(v, side * line) for v in x]),
            rng,
            "round" if rng.random() < 0.5 else None,
        )
    spots = rng.uniform(-60, 60, int(rng.integers(6, 20)))
    add_furniture(
        layout,
        np.stack([course.at(v, side * (edge + rng.uniform(0.2, course.pavement))) for v in spots]),
        0.0,
        rng,
    )
    for _ in range(int(rng.integers(1, 5))):
        layout.put(
            one_of(sign, rng),
            course.at(rng.uniform(-50, 50), side * edge),
            rng.choice([0, np.pi]),
            (0.2, 0.2),
        )
    if course.lawn > 1.5:
        _front_gardens(layout, course, side, rng)


def _front_gardens(layout: Layout, course: Course, side: float, rng: np.random.Generator) -> None:
    reach = course.road + course.pavement

    def places(n: int) -> np.ndarray:
        return np.stack(
            [
                course.at(rng.uniform(-75, 75), side * (reach + rng.uniform(0.3, course.lawn)))
                for _ in range(n)
            ]
        )

    border = rng.choice(3)
    for x in np.arange(-70, 70, rng.uniform(8, 20)):
        xy, length = course.at(x, side * (reach + 0.5)), rng.uniform(4, 9)
        if border == 0 and rng.random() < 0.7:
            layout.put(hedge(rng, length), xy, course.yaw(x), (length / 2, 0.5))
        elif border == 1 and rng.random() < 0.7:
            ends = (
                course.at(x - length / 2, side * (reach + 0.4)),
                course.at(x + length / 2, side * (reach + 0.4)),
            )
            layout.still.append(fence(rng, layout.line(*ends, 2.2)))
    plant_trees(layout, places(int(rng.integers(2, 14))), rng)
    plant_bushes(layout, places(int(rng.integers(8, 32))), rng)


def _traffic(layout: Layout, course: Course, rng: np.random.Generator) -> None:
    for side in (-1.0, 1.0):
        for _ in range(int(rng.integers(0, 5))):
            x = rng.uniform(-60, 60)
            yaw = course.yaw(x) + (0 if side < 0 else np.pi)
            speed = rng.uniform(2, 20) if rng.random() < 0.8 else 0.0
            lane = side * max(course.road * 0.35, 1.2)
            add_car(layout, course.at(x, lane + rng.normal(0, 0.2)), yaw, rng, speed)
    edge = course.road + course.pavement
    add_people(layout, np.stack([course.at(rng.uniform(-45, 45), rng.choice([-1, 1]) * rng.uniform(course.road, edge))
                                 for _ in range(int(rng.integers(3, 16)))]), rng)  # fmt: skip
    if course.crossing is not None:
        for dx in (-1, 1):
            for side in (-1, 1):
                xy = course.at(course.crossing + dx * (course.road + 0.6), side * (course.road + 0.6))
                layout.put(one_of(traffic_light, rng), xy, rng.uniform(0, 6.28), (0.2, 0.2))
    elif rng.random() < 0.3:
        x0 = rng.uniform(-20, 20)
        layout.still.append(
            bollards(
                layout.line(course.at(x0, course.road + 0.3), course.at(x0 + 12, course.road + 0.3), 1.5)
            )
        )
    plant_bushes(layout, in_box(rng, (-70, -30), (70, 30), 8), rng)
