# SPDX-License-Identifier: MIT
"""Poses of the two sensors, so that the pair has its tier's distance and overlap."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from hybridreg.data.simulate.difficulty import Tier
from hybridreg.data.simulate.sensing.caster import World
from hybridreg.data.simulate.sensing.overlaps import expected_overlap
from hybridreg.data.simulate.sensing.sensors import Sensor
from hybridreg.data.simulate.world.carriers import Carrier, draw_carrier, mount
from hybridreg.data.simulate.world.layout import Layout

PROPOSALS = 12
CLOSE_ENOUGH = 0.1  # between the wanted and the expected overlap


@dataclass(frozen=True)
class Stand:
    """A sensor in the world."""

    T_world_sensor: np.ndarray
    carrier: Carrier
    xy: np.ndarray
    yaw: float


def _stand(layout: Layout, xy: np.ndarray, carrier: Carrier, yaw: float, rng: np.random.Generator) -> Stand:
    return Stand(mount(layout, carrier, xy, yaw, rng), carrier, xy, yaw)


def free_place(layout: Layout, room: float, rng: np.random.Generator) -> np.ndarray:
    """A position (2,) in the scene with `room` metres of clear ground around it, or the last one tried."""
    for _ in range(40):
        xy = layout.stand(rng)
        if layout.free(xy, room):
            break
    return xy


def _propose(
    layout: Layout, tier: Tier, carriers: tuple[Carrier, Carrier], rng: np.random.Generator
) -> tuple[Stand, Stand]:
    """Two sensor poses at the tier's distance; the source often, but not always, looks towards the target."""
    best: tuple[float, np.ndarray, np.ndarray] = (np.inf, np.zeros(2), np.zeros(2))
    low, high = tier.distance
    for _ in range(400):
        a, b = layout.stand(rng), layout.stand(rng)
        gap = math.dist(a, b)
        miss = max(low - gap, gap - high, 0.0)
        if miss < best[0]:
            best = (miss, a, b)
        # Distance first: it is checked a hundred times as fast as whether there is room.
        if miss == 0 and layout.free(a, carriers[0].room) and layout.free(b, carriers[1].room):
            best = (miss, a, b)
            break
    _, source, target = best
    between = target - source
    if best[0] > 0:  # crowded scene: keep the direction, set the distance
        source = target - between / max(float(np.linalg.norm(between)), 1e-6) * np.mean(tier.distance)
        between = target - source
    towards = float(np.arctan2(between[1], between[0]))
    yaw = towards + rng.normal(0, 0.7) if rng.random() < 0.5 else rng.uniform(0, 2 * np.pi)
    return _stand(layout, source, carriers[0], yaw, rng), _stand(
        layout, target, carriers[1], rng.uniform(0, 6.283), rng
    )


def choose_stands(
    layout: Layout, world: World, tier: Tier, sensors: tuple[Sensor, Sensor], rng: np.random.Generator
) -> tuple[Stand, Stand]:
    """The first proposal whose expected overlap lies in the tier's range, otherwise the nearest to it."""
    carriers = (draw_carrier(rng), draw_carrier(rng))
    low, high = tier.overlap
    wanted = rng.uniform(low, high)
    best: tuple[float, tuple[Stand, Stand]] | None = None
    for _ in range(PROPOSALS):
        stands = _propose(layout, tier, carriers, rng)
        guess = expected_overlap(world, *sensors, stands[0].T_world_sensor, stands[1].T_world_sensor)
        miss = abs(guess - wanted)
        if best is None or miss < best[0]:
            best = (miss, stands)
        if miss < CLOSE_ENOUGH:
            break
    assert best is not None
    return best[1]


def single_stand(layout: Layout, rng: np.random.Generator, carrier: Carrier | None = None) -> Stand:
    """One sensor anywhere in the scene."""
    carrier = carrier or draw_carrier(rng)
    return _stand(layout, free_place(layout, carrier.room, rng), carrier, rng.uniform(0, 6.283), rng)
