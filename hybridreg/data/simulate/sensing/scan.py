# SPDX-License-Identifier: MIT
"""One scan of one sensor."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from hybridreg.data.simulate.sensing.caster import Hits, World
from hybridreg.data.simulate.sensing.column_arrays import pick, turned
from hybridreg.data.simulate.sensing.patterns import pattern
from hybridreg.data.simulate.sensing.returns import measured_ranges
from hybridreg.data.simulate.sensing.sensors import Sensor
from hybridreg.data.simulate.world.layout import Surface
from hybridreg.data.simulate.world.materials import GROUND


def with_ground(hits: Hits, origin: np.ndarray, directions: np.ndarray, surface: Surface) -> Hits:
    """Terrain hits with the material of the ground there."""
    ground = np.flatnonzero((hits.material == GROUND) & (hits.face >= 0))
    distance = hits.distance.take(ground)
    x, y = (np.float32(origin[k]) + distance * directions[:, k].take(ground) for k in range(2))
    material = hits.material.copy()
    material[ground] = surface(x, y)
    return replace(hits, material=material)


def scan(
    world: World, surface: Surface, sensor: Sensor, T_world_sensor: np.ndarray, rng: np.random.Generator
) -> NDArray[np.float32]:
    """Points (n,3) float32 in the sensor's frame, on its grid of `quantum_m`, in firing order."""
    directions = pattern(sensor, rng)
    rotation, origin = T_world_sensor[:3, :3], T_world_sensor[:3, 3]
    rays = turned(directions, rotation)
    hits = with_ground(world.cast(origin, rays), origin, rays, surface)
    ranges = measured_ranges(sensor, rays, hits, rng)
    kept = np.flatnonzero(np.isfinite(ranges))
    quantum = np.float32(sensor.quantum_m)
    points = pick(directions, kept)
    points *= (ranges.take(kept) / quantum)[:, None]
    return np.ascontiguousarray(np.rint(points, out=points) * quantum)
