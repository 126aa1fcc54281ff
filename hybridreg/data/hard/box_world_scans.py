# SPDX-License-Identifier: MIT
"""An unlimited supply of pairs of scans in the synthetic worlds of the verdict's tests.

Streets, crossings, yards, woods, rooms and corridors, each seen by two sensors, one in ten upside down and one in ten
tilted by 30 degrees, with a third of the cars moved in between.
"""

from __future__ import annotations

import copy
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hybridreg.cloud import PointCloud
from hybridreg.data.hard import box_world
from hybridreg.geometry import se3
from hybridreg.pair import Pair

Array = NDArray[np.float64]
KINDS = ("street", "crossing", "yard", "wood", "room", "corridor")
SOURCES = ("rings16", "rings32", "rings64", "hemisphere", "rosette", "raster")
TARGETS = ("rings32", "rings64", "rings64", "hemisphere", "rings16")


@dataclass(frozen=True, eq=False)
class Sight:
    """One world seen by two sensors, with the true pose (4, 4)."""

    kind: str
    pair: Pair
    truth: Array

    @property
    def indoor(self) -> bool:
        return self.kind in ("room", "corridor")


def build(kind: str, rng: np.random.Generator) -> box_world.World:
    """A world of a kind."""
    if kind in ("street", "crossing"):
        return box_world.street(rng, crossing=kind == "crossing")
    if kind in ("room", "corridor"):
        return box_world.room(rng, corridor=kind == "corridor")
    return box_world.yard(rng) if kind == "yard" else box_world.wood(rng)


def sight(i: int) -> Sight:
    """The i-th pair of scans."""
    rng = np.random.default_rng(1000 + i)
    kind = KINDS[i % len(KINDS)]
    before, indoor = build(kind, rng), kind in ("room", "corridor")
    after = copy.deepcopy(before)
    for j, (centre, half, yaw) in enumerate(after.boxes):
        if not indoor and half[2] < 1.0 and rng.random() < 0.3:
            after.boxes[j] = (centre + [rng.normal(0.0, 5.0), 0.0, 0.0], half, yaw)
    z = 1.3 if indoor else 1.8
    apart = rng.uniform(-1, 1) if indoor else rng.choice([0, 3, 8, 15]) * rng.choice([-1, 1])
    tilt = rng.choice([180.0, 30.0, rng.normal(0.0, 2.0)], p=[0.1, 0.1, 0.8])
    T_world_target = box_world.sensor_pose(
        0, rng.uniform(-0.3, 0.3), z, rng.uniform(0, 360), rng.normal(0, 1)
    )
    T_world_source = box_world.sensor_pose(apart, rng.uniform(-0.5, 0.5), z, rng.uniform(0, 360), tilt)
    source = box_world.scan(after, str(rng.choice(SOURCES)), T_world_source, rng)
    target = box_world.scan(before, str(rng.choice(TARGETS)), T_world_target, rng)
    truth = se3.inverse(T_world_target) @ T_world_source
    pair = Pair(source=PointCloud.of(source), target=PointCloud.of(target), id=f"world-{i}")
    return Sight(kind, pair, truth)
