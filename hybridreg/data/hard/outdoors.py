# SPDX-License-Identifier: MIT
"""Streets, crossings, yards and towns, every third with ground relief of a few centimetres."""

from __future__ import annotations

import numpy as np

from hybridreg.data.hard.place import Place


def outdoors(rng: np.random.Generator, seed: int) -> Place:
    """A street, a crossing, a yard or a town."""
    rolls = seed % 3 == 0
    place = Place(relief=rng.uniform(0.02, 0.05) if rolls else 0.0, phase=rng.uniform(0.0, 6.28, 3))
    kind = rng.choice(["street", "crossing", "yard", "town"], p=[0.3, 0.15, 0.25, 0.3])
    if kind == "yard":
        _yard(place, rng)
    elif kind == "town":
        _town(place, rng)
    else:
        _street(place, rng, crossing=kind == "crossing")
    _clutter(place, rng)
    place.ground(100.0)
    return place


def _street(place: Place, rng: np.random.Generator, crossing: bool) -> None:
    # Houses of varying width and setback along x, cars at the kerb, lamp posts and trees.
    for side in (-1, 1):
        x = -75.0
        while x < 75.0:
            width, gap = rng.uniform(6, 18), rng.choice([0.0, rng.uniform(2, 10)])
            if not (crossing and abs(x + width / 2) < 12):
                setback, deep = rng.uniform(8, 13), rng.uniform(8, 12)
                place.box(x + width / 2, side * (setback + deep / 2), 0.0, (width, deep, rng.uniform(4, 14)))
                if rng.random() < 0.4:  # a porch or a bay
                    at = x + width * rng.uniform(0.3, 0.7)
                    place.box(at, side * setback, 0.0, (rng.uniform(1.5, 3), 2.0, rng.uniform(2.5, 4)))
            x += width + gap
        for x in np.arange(-65, 65, rng.uniform(6, 12)):
            if rng.random() < 0.6:
                size = (rng.uniform(3.8, 4.8), 1.8, rng.uniform(1.4, 1.9))
                place.box(
                    x + rng.uniform(-1, 1), side * rng.uniform(4.2, 5.5), 0.0, size, rng.normal(0, 0.05), True
                )
        for x in np.arange(-60, 60, rng.uniform(12, 22)):
            place.post(x + rng.uniform(-2, 2), side * 6.5, rng.uniform(0.08, 0.2), 7.0)
            if rng.random() < 0.5:
                place.bush(np.array([x + 5, side * 7.0, rng.uniform(1, 4)]), rng.uniform(0.8, 2.0), rng)


def _yard(place: Place, rng: np.random.Generator) -> None:
    # Containers, sheds, cars and posts about an open place.
    for _ in range(rng.integers(14, 30)):
        x, y = rng.uniform(-38, 38, 2)
        if np.hypot(x, y) > 7:
            size = (rng.uniform(2, 10), rng.uniform(2, 4), rng.uniform(1.4, 4))
            place.box(x, y, 0.0, size, rng.uniform(0, np.pi))
    for _ in range(rng.integers(2, 5)):
        turn, far = rng.uniform(0, 2 * np.pi), rng.uniform(28, 42)
        size = (rng.uniform(10, 30), rng.uniform(8, 14), rng.uniform(5, 12))
        place.box(far * np.cos(turn), far * np.sin(turn), 0.0, size, rng.uniform(0, np.pi))
    for _ in range(rng.integers(4, 10)):
        x, y = rng.uniform(-25, 25, 2)
        if place.free(x, y, 2.5) and np.hypot(x, y) > 5:
            place.box(x, y, 0.0, (4.3, 1.8, 1.5), rng.choice([0.0, np.pi / 2]), True)
    for _ in range(rng.integers(5, 20)):
        x, y = rng.uniform(-35, 35, 2)
        if np.hypot(x, y) > 2:
            place.post(x, y, rng.uniform(0.08, 0.4), rng.uniform(3, 8))


def _town(place: Place, rng: np.random.Generator) -> None:
    # Houses of any yaw around two wide roads that cross, with posts and cars anywhere.
    for _ in range(30):
        x, y = rng.uniform(-80, 80, 2)
        if min(abs(x), abs(y)) > 9:
            size = (rng.uniform(5, 20), rng.uniform(5, 20), rng.uniform(3, 14))
            place.box(x, y, 0.0, size, rng.uniform(0, np.pi))
    for _ in range(40):
        x, y = rng.uniform(-40, 40, 2)
        if np.hypot(x, y) > 3:
            place.post(x, y, rng.uniform(0.08, 0.3), rng.uniform(3, 8))
    for _ in range(10):
        x, y = rng.uniform(-25, 25, 2)
        if np.hypot(x, y) > 5:
            place.box(x, y, 0.0, (4.2, 1.8, 1.6), rng.choice([0.0, np.pi / 2]), True)


def _clutter(place: Place, rng: np.random.Generator) -> None:
    # Bins, bollards, low walls and crates near the middle: all that a cropped scan has to rely on.
    for _ in range(rng.integers(4, 12)):
        turn, far = rng.uniform(0, 2 * np.pi), rng.uniform(4, 14)
        x, y = far * np.cos(turn), far * np.sin(turn)
        if rng.random() < 0.3:
            place.post(x, y, rng.uniform(0.08, 0.3), rng.uniform(0.8, 3))
        else:
            size = (rng.uniform(0.4, 3.0), rng.uniform(0.3, 1.0), rng.uniform(0.7, 2.2))
            place.box(x, y, 0.0, size, rng.uniform(0, np.pi))
