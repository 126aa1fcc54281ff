# SPDX-License-Identifier: MIT
"""Places that repeat themselves: ribbed tunnels, and warehouses with regular racks."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hybridreg.data.hard.place import Place
from hybridreg.data.hard.shared_surface import judged, shift, turn_about
from hybridreg.data.hard.sights import AROUND, LIDARS, level, lidar, look
from hybridreg.data.hard.true_poses import Sample

Array = NDArray[np.float64]


def tunnel(rng: np.random.Generator, seed: int) -> Sample:
    """A tunnel or corridor with ribs every 2 to 5 m, bare or with a few objects."""
    place, half, height = Place(), rng.uniform(1.2, 3.0), rng.uniform(2.4, 4.5)
    rib, step = rng.uniform(0.1, 0.3), rng.uniform(2.0, 5.0)
    for side in (-1, 1):
        place.box(0.0, side * (half + 0.1), 0.0, (160.0, 0.2, height))
    for x in np.arange(-79.0, 79.0, step):
        for side in (-1, 1):
            place.box(x, side * (half - rib / 2), 0.0, (0.25, rib, height))
        place.box(x, 0.0, height - rib, (0.25, 2 * half, rib))
    n_things = int(rng.choice([0, 0, 4, 12, 12]))
    for _ in range(n_things):  # cabinets, pipes and crates along the walls
        size = (rng.uniform(0.5, 2.5), rng.uniform(0.4, 0.9), rng.uniform(0.8, 2.2))
        y = rng.choice([-1, 1]) * (half - size[1] / 2)
        place.box(rng.uniform(-7, 7), y, rng.choice([0.0, rng.uniform(0.0, 0.8)]), size)
    place.ground(80.0)
    place.ceiling(80.0, half + 0.2, height)
    far, z = rng.uniform(25.0, 50.0), rng.uniform(1.0, 1.9)
    apart = rng.uniform(0.5, 8.0)
    world = place.world()
    shots = [
        look(world, lidar(str(name), rng, far), level(rng, x, y, z), rng)
        for name, x, y in zip(
            (rng.choice(LIDARS), rng.choice(AROUND)),
            (-apart / 2, apart / 2),
            rng.uniform(-0.4, 0.4, 2),
            strict=True,
        )
    ]
    rivals = [shift(k * step, 0.0) for k in (-2, -1, 1, 2)] + [turn_about(0.0, 0.0, 180.0)]
    return judged(shots[0], shots[1], 0.2, 0.15, rivals)


def rack(rng: np.random.Generator, seed: int) -> Sample:
    """Rows of racks in a warehouse; irregular goods and end walls distinguish one bay from another."""
    place, bay, aisle = Place(), rng.uniform(2.2, 3.0), rng.uniform(2.6, 3.6)
    n_bays, n_rows = int(rng.integers(8, 14)), int(rng.integers(3, 6))
    deep, storey, n_levels = rng.uniform(0.9, 1.2), rng.uniform(1.2, 1.8), int(rng.integers(2, 5))
    row = deep + aisle
    filled = float(rng.choice([0.0, 1.0, rng.uniform(0.3, 0.8)], p=[0.2, 0.2, 0.6]))
    regular = filled in (0.0, 1.0)
    half_x, half_y = n_bays * bay / 2, n_rows * row / 2
    for i in range(n_rows):
        y = (i - (n_rows - 1) / 2) * row
        for j in range(n_bays + 1):
            for v in (-1, 1):
                place.box(j * bay - half_x, y + v * deep / 2, 0.0, (0.1, 0.08, storey * n_levels + 0.5))
        for k in range(1, n_levels + 1):
            for v in (-1, 1):
                place.box(0.0, y + v * deep / 2, k * storey, (2 * half_x, 0.05, 0.12))
        _goods(place, rng, filled, regular, bay, half_x, y, storey, n_levels, deep)
    if rng.random() < 0.6:  # a hall in view, with an object or two along its walls
        for side in (-1, 1):
            place.box(side * (half_x + rng.uniform(3, 6)), 0.0, 0.0, (0.3, 2 * half_y + 8, 8.0))
            place.box(0.0, side * (half_y + rng.uniform(1, 4)), 0.0, (2 * half_x + 8, 0.3, 8.0))
    place.ground(60.0)
    world, shots = place.world(), []
    y = (rng.integers(n_rows - 1) - (n_rows - 2) / 2) * row
    x, apart = rng.uniform(-0.7, 0.7) * half_x, rng.uniform(1.0, 8.0)
    for name, at in ((rng.choice(LIDARS), x), (rng.choice(AROUND), x + rng.choice([-1, 1]) * apart)):
        T = level(rng, at, y + rng.uniform(-0.5, 0.5), rng.uniform(0.5, 2.0))
        shots.append(look(world, lidar(str(name), rng, 50.0), T, rng))
    rivals = [shift(k * bay, m * row) for k in (-2, -1, 0, 1, 2) for m in (-1, 0, 1) if k or m]
    return judged(
        shots[0], shots[1], 0.2, 0.15, [*rivals, turn_about(0.0, 0.0, 180.0), turn_about(x, y, 180.0)]
    )


def _goods(
    place: Place,
    rng: np.random.Generator,
    filled: float,
    regular: bool,
    bay: float,
    half_x: float,
    y: float,
    storey: float,
    n_levels: int,
    deep: float,
) -> None:
    # Two pallets a bay: all alike, or some of them and each of its own size.
    for x in np.arange(bay / 4, 2 * half_x, bay / 2) - half_x:
        for k in range(n_levels):
            if rng.random() < filled:
                share = np.array([0.85, 0.9, 0.75]) if regular else rng.uniform(0.4, 0.95, 3)
                size = share * [bay / 2 - 0.1, deep, storey - 0.15]
                place.box(x, y, k * storey + (0.12 if k else 0.0), tuple(size))
