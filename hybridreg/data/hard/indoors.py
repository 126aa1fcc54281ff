# SPDX-License-Identifier: MIT
"""Rooms with irregular furniture, and floors of several rooms along a corridor."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from hybridreg.data.hard.place import Place

# Metres.
_WALL = 0.12
_DOOR = 0.95


class Room(NamedTuple):
    """Middle and half size in metres."""

    x: float
    y: float
    half_x: float
    half_y: float


def room(rng: np.random.Generator, n_things: tuple[int, int] = (7, 19)) -> tuple[Place, Room]:
    """One closed room with a floor, a ceiling and furniture."""
    place, height = Place(), rng.uniform(2.4, 3.6)
    a, b = rng.uniform(2.2, 5.0), rng.uniform(1.8, 4.0)
    here = Room(0.0, 0.0, a, b)
    for side in (-1, 1):
        place.box(side * (a + _WALL / 2), 0.0, 0.0, (_WALL, 2 * b + 2 * _WALL, height))
        place.box(0.0, side * (b + _WALL / 2), 0.0, (2 * a, _WALL, height))
    if rng.random() < 0.5:  # a chimney breast or a lift's shaft in one corner
        size = rng.uniform(0.4, 1.2, 2)
        place.box(a - size[0] / 2, b - size[1] / 2, 0.0, (*size, height))
    furnish(place, here, rng, int(rng.integers(*n_things)))
    place.ground(a + 1.0 if a > b else b + 1.0)
    place.ceiling(a + 0.5, b + 0.5, height)
    return place, here


def floor(rng: np.random.Generator) -> tuple[Place, list[Room]]:
    """Rooms of varying width on both sides of a corridor, with open doors; the corridor comes last."""
    place, height, half = Place(), rng.uniform(2.5, 3.2), rng.uniform(0.8, 1.4)
    length, rooms = rng.uniform(16.0, 26.0), []
    for side in (-1, 1):
        deep, x = rng.uniform(3.5, 6.0), -length / 2
        while x < length / 2 - 0.1:
            wide = rng.uniform(2.8, 6.0)
            wide = length / 2 - x if length / 2 - x - wide < 2.5 else wide
            middle = side * (half + _WALL + deep / 2)
            rooms.append(Room(x + wide / 2, middle, wide / 2 - _WALL / 2, deep / 2))
            door = x + rng.uniform(0.9, wide - 0.9)
            for low, high in ((x, door - _DOOR / 2), (door + _DOOR / 2, x + wide)):
                wall = (high - low, _WALL, height)
                place.box((low + high) / 2, side * (half + _WALL / 2), 0.0, wall)
            place.box(x + wide, middle, 0.0, (_WALL, deep, height))
            x += wide
        place.box(-length / 2, side * (half + _WALL + deep / 2), 0.0, (_WALL, deep, height))
        place.box(0.0, side * (half + _WALL + deep), 0.0, (length, _WALL, height))
    for side in (-1, 1):
        place.box(side * length / 2, 0.0, 0.0, (_WALL, 2 * half, height))
    for here in rooms:
        furnish(place, here, rng, int(rng.integers(4, 10)))
    place.ground(length)
    place.ceiling(length, length, height)
    return place, [*rooms, Room(0.0, 0.0, length / 2, half)]


def stand_in(place: Place, here: Room, rng: np.random.Generator) -> tuple[float, float]:
    """A free position in a room, as far from everything as a few dozen tries find."""
    reach = np.maximum([here.half_x - 0.4, here.half_y - 0.4], 0.2)
    for clearance in (0.7, 0.45, 0.3, 0.15):
        for _ in range(60):
            x, y = rng.uniform(-reach, reach) + [here.x, here.y]
            if place.free(x, y, clearance):
                return float(x), float(y)
    return here.x, here.y


def furnish(place: Place, here: Room, rng: np.random.Generator, n_things: int) -> None:
    """Cupboards and shelves along the walls, tables, chairs, pillars and crates anywhere."""
    # No more than leaves room to walk.
    for _ in range(min(n_things, int(2.0 * here.half_x * here.half_y))):
        thing = rng.choice(["cupboard", "table", "chair", "crate", "pillar", "picture"])
        yaw = rng.choice([0.0, np.pi / 2, rng.uniform(0.0, np.pi)])
        x = here.x + rng.uniform(-0.85, 0.85) * here.half_x
        y = here.y + rng.uniform(-0.85, 0.85) * here.half_y
        if thing == "cupboard":
            deep, wide, high = rng.uniform(0.3, 0.7), rng.uniform(0.5, 2.0), rng.uniform(0.7, 2.2)
            if rng.random() < 0.5:
                y = here.y + rng.choice([-1, 1]) * (here.half_y - deep / 2)
                place.box(x, y, 0.0, (wide, deep, high))
            else:
                x = here.x + rng.choice([-1, 1]) * (here.half_x - deep / 2)
                place.box(x, y, 0.0, (deep, wide, high))
        elif thing == "picture":  # a box on the wall: a lamp, a pipe, a boiler
            size = (rng.uniform(0.3, 1.2), 0.15, rng.uniform(0.2, 0.9))
            place.box(x, here.y + rng.choice([-1, 1]) * here.half_y, rng.uniform(0.8, 1.6), size)
        elif thing == "pillar":
            place.post(x, y, rng.uniform(0.1, 0.25), rng.uniform(1.0, 2.3))
        elif thing == "crate":
            place.box(x, y, 0.0, tuple(rng.uniform(0.25, 1.0, 3)), yaw)
        else:
            _on_legs(place, x, y, yaw, thing == "table", rng)


def _on_legs(place: Place, x: float, y: float, yaw: float, table: bool, rng: np.random.Generator) -> None:
    high = rng.uniform(0.68, 0.8) if table else rng.uniform(0.42, 0.5)
    wide, deep = (rng.uniform(0.8, 1.8), rng.uniform(0.6, 0.9)) if table else (0.45, 0.45)
    place.box(x, y, high, (wide, deep, 0.04), yaw)
    c, s = np.cos(yaw), np.sin(yaw)
    for side, end in ((-1, -1), (-1, 1), (1, -1), (1, 1)):
        u, v = side * (wide / 2 - 0.04), end * (deep / 2 - 0.04)
        place.box(x + c * u - s * v, y + s * u + c * v, 0.0, (0.05, 0.05, high), yaw)
    if not table:
        v = deep / 2 - 0.02
        place.box(x - s * v, y + c * v, high, (wide, 0.04, 0.45), yaw)
