# SPDX-License-Identifier: MIT
"""What carries a sensor, and appears in its view."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np
from scipy.spatial.transform import Rotation

from hybridreg.data.simulate.world.cars import SHAPES, car
from hybridreg.data.simulate.world.layout import Layout
from hybridreg.data.simulate.world.mesh import EMPTY, Mesh
from hybridreg.data.simulate.world.pool import one_of
from hybridreg.data.simulate.world.solids import boxes, ellipsoid, tubes

CARS = {kind: partial(car, kind=kind) for kind in ("hatchback", "estate", "suv")}


@dataclass(frozen=True)
class Carrier:
    """A body around the sensor's foot point on the ground, and the sensor's height over that point."""

    body: Mesh
    height: float
    room: float  # metres of clear ground it needs


def draw_carrier(rng: np.random.Generator) -> Carrier:
    """A car with the sensor on its roof, a small robot, or a person with a backpack or tripod."""
    return carrier_named(str(rng.choice(["car", "robot", "person"], p=[0.5, 0.3, 0.2])), rng)


def carrier_named(kind: str, rng: np.random.Generator) -> Carrier:
    """A carrier of one kind: "car", "robot" or "person"."""
    if kind == "car":
        shape = str(rng.choice(["hatchback", "estate", "suv"]))
        lift = rng.uniform(0.22, 0.5)
        rack = boxes(np.array([[0, 0, 1.5]]), np.array([0.25, 0.25, 0.2]), 0.0, "metal", (0.2, 0.2, 0.2))
        body = Mesh.merge([one_of(CARS[shape], rng, 24, 0.02).moved(0.0, (0.4, 0, 0)), rack])
        return Carrier(body, SHAPES[shape].size[2] * 1.05 + lift, 1.6)
    if kind == "robot":
        height = rng.uniform(0.7, 1.3)
        chassis = boxes(
            np.array([[-0.1, 0, 0.15]]), np.array([0.9, 0.6, 0.35]), 0.0, "paint", (0.6, 0.5, 0.1)
        )
        mast = tubes(
            np.array([[-0.05, 0, 0.4]]),
            np.array([[-0.05, 0, height - 0.12]]),
            0.04,
            0.04,
            "metal",
            (0.3,) * 3,
        )
        return Carrier(Mesh.merge([chassis, mast]), height, 0.8)
    if rng.random() < 0.5:
        return Carrier(EMPTY, rng.uniform(1.3, 1.8), 0.5)
    head = ellipsoid((-0.32, 0, 1.6), (0.12, 0.2, 0.18), "cloth", (0.4, 0.3, 0.25))
    return Carrier(head, rng.uniform(1.6, 1.9), 0.5)


def mount(
    layout: Layout, carrier: Carrier, xy: np.ndarray, yaw: float, rng: np.random.Generator
) -> np.ndarray:
    """T_world_sensor (4,4) of a sensor on `carrier` at `xy`, looking along `yaw`, tilted by a degree or two."""
    T = np.eye(4)
    tilt = rng.normal(0, 0.025, 2)
    T[:3, :3] = Rotation.from_euler("ZYX", [yaw, *tilt]).as_matrix()
    T[:3, 3] = [xy[0], xy[1], layout.terrain.height_at(xy) + carrier.height]
    return T
