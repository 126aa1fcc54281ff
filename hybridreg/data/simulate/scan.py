# SPDX-License-Identifier: MIT
"""One scan of one sensor."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from hybridreg.data.simulate.caster import Hits, World
from hybridreg.data.simulate.layout import Surface
from hybridreg.data.simulate.materials import GROUND
from hybridreg.data.simulate.patterns import pattern
from hybridreg.data.simulate.returns import measured_ranges
from hybridreg.data.simulate.sensors import Sensor


def with_ground(hits: Hits, origin: np.ndarray, directions: np.ndarray, surface: Surface) -> Hits:
    """Hits on the terrain given the material that lies there."""
    ground = np.flatnonzero((hits.material == GROUND) & (hits.face >= 0))
    xy = origin[:2].astype(np.float32) + hits.distance[ground, None] * directions.take(ground, axis=0)[:, :2]
    material = hits.material.copy()
    material[ground] = surface(xy[:, 0], xy[:, 1])
    return replace(hits, material=material)


def scan(
    world: World, surface: Surface, sensor: Sensor, T_world_sensor: np.ndarray, rng: np.random.Generator
) -> NDArray[np.float32]:
    """Points (n,3) float32 in the sensor's frame, on its grid of `quantum_m`, in firing order."""
    directions = pattern(sensor, rng)
    rotation, origin = T_world_sensor[:3, :3], T_world_sensor[:3, 3]
    rays = directions @ rotation.T.astype(np.float32)
    hits = with_ground(world.cast(origin, rays), origin, rays, surface)
    ranges = measured_ranges(sensor, rays, hits, rng)
    kept = np.flatnonzero(np.isfinite(ranges))
    # take() gathers rows several times as fast as indexing does, here and below.
    points = directions.take(kept, axis=0)
    points *= ranges.take(kept)[:, None] / np.float32(sensor.quantum_m)
    return np.rint(points, out=points) * np.float32(sensor.quantum_m)
