# SPDX-License-Identifier: MIT
"""Scattering objects over a scene: trees, people, cars, small furniture."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hybridreg.data.simulate.world.cars import car
from hybridreg.data.simulate.world.chance import one
from hybridreg.data.simulate.world.furniture import bench, billboard, bin_or_cabinet, lamp, sign
from hybridreg.data.simulate.world.layout import Layout
from hybridreg.data.simulate.world.people import bicycle, person, rider
from hybridreg.data.simulate.world.plants import bush, tree_from_pool
from hybridreg.data.simulate.world.pool import one_of


def in_box(rng: np.random.Generator, low: Sequence[float], high: Sequence[float], n: int) -> np.ndarray:
    """`n` places (n,2), thinning out with the distance from the middle of the box."""
    middle = (np.asarray(low) + np.asarray(high)) / 2
    return (
        middle
        + rng.uniform(-1, 1, (n, 2)) * rng.uniform(0.25, 1, (n, 1)) * (np.asarray(high) - np.asarray(low)) / 2
    )


def spot(rng: np.random.Generator, half: float) -> np.ndarray:
    """As `in_box` for one place (2,) of a square around the origin, but faster."""
    x, y, far = rng.uniform(-1, 1), rng.uniform(-1, 1), rng.uniform(0.25, 1)
    return np.array([x * far * half, y * far * half])


def plant_trees(
    layout: Layout, places: np.ndarray, rng: np.random.Generator, kind: str | None = None
) -> None:
    """A tree at every place (n,2) that is free."""
    for xy in places:
        if layout.free(xy, 0.6):
            thing = tree_from_pool(rng, float(np.hypot(*xy)), kind)
            layout.put(thing, xy, rng.uniform(0, 6.28), (0.35, 0.35))


def plant_bushes(layout: Layout, places: np.ndarray, rng: np.random.Generator) -> None:
    """A bush at every place (n,2) that is free."""
    for xy in places:
        layout.put(one_of(bush, rng, stretch=0.2), xy, rng.uniform(0, 6.28), (0.5, 0.5))


def add_people(layout: Layout, places: np.ndarray, rng: np.random.Generator) -> None:
    """People and cyclists; most have moved on, arrived or left by the time of the other scan."""
    for xy in places:
        yaw = rng.uniform(0, 2 * np.pi)
        heading = np.array([np.cos(yaw), np.sin(yaw)])
        if rng.random() < 0.2:
            moving = bool(rng.random() < 0.6)
            layout.put_mover(
                one_of(rider if moving else bicycle, rng),
                xy,
                yaw,
                heading * moving * rng.uniform(3, 15),
                (0.8, 0.3),
                _when(rng),
            )
        else:
            layout.put_mover(
                one_of(person, rng), xy, yaw, heading * max(0.0, rng.normal(1.5, 2.5)), (0.3, 0.3), _when(rng)
            )


def add_car(
    layout: Layout,
    xy: np.ndarray,
    yaw: float,
    rng: np.random.Generator,
    speed: float = 0.0,
    leaves: float = 0.08,
) -> None:
    """A car: driving (`speed` metres between the scans) or parked, with a chance `leaves` to leave or arrive."""
    half = (2.6, 1.1)
    heading = np.array([np.cos(yaw), np.sin(yaw)])
    if not layout.free(xy, 1.3):
        return
    body = one_of(car, rng, variants=160, stretch=0.03)
    if speed > 0 or rng.random() < leaves:
        layout.put_mover(
            body, xy, yaw, heading * speed, (half[1], half[1]), "both" if speed > 0 else _when(rng, 0.0)
        )
    else:
        layout.still.append(layout.on_ground(body, xy, yaw))
        layout.claim(xy, half, yaw)


def _when(rng: np.random.Generator, both: float = 0.6) -> str:
    return one(rng, ("both", "source", "target"), (both, (1 - both) / 2, (1 - both) / 2))


def add_furniture(layout: Layout, places: np.ndarray, yaw: float, rng: np.random.Generator) -> None:
    """Small objects at `places` (n,2), rotated by `yaw`."""
    makers = (bench, bin_or_cabinet, sign, billboard, lamp)
    for xy in places:
        thing = one_of(one(rng, makers, (0.2, 0.3, 0.25, 0.1, 0.15)), rng, stretch=0.12)
        layout.put(thing, xy, yaw + one(rng, (0, np.pi / 2, np.pi)) + rng.normal(0, 0.1), (0.4, 0.4))
