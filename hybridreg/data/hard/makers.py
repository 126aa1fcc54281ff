# SPDX-License-Identifier: MIT
"""The kinds by name."""

from __future__ import annotations

import zlib
from dataclasses import replace

import numpy as np

from hybridreg.data.hard import (
    hung,
    impossible,
    maps,
    repeating,
    roads,
    rooms,
    small_things,
    vehicles,
)
from hybridreg.data.hard.true_poses import Maker, Sample

_MAKERS: dict[str, Maker] = {
    "map-ground": maps.map_ground,
    "map-sensor": maps.map_sensor,
    "tiles": maps.tiles,
    "base-link": vehicles.base_link,
    "merged": vehicles.several,
    "depth-room": rooms.depth_room,
    "object": small_things.thing,
    "crop": hung.crop,
    "tilt": hung.tilt,
    "upside-down": hung.upside_down,
    "flat": rooms.flat,
    "tunnel": repeating.tunnel,
    "few": hung.few,
    "traffic": roads.traffic,
    "rack": repeating.rack,
    "building": maps.building,
    "mirrored": impossible.mirrored,
    "scaled": impossible.scaled,
    "strained": impossible.strained,
    "unit": impossible.unit,
    "doubled": impossible.doubled,
    "disjoint": impossible.disjoint,
}
KINDS = tuple(_MAKERS)


def sample(kind: str, seed: int) -> Sample:
    """The pair of a kind with a seed; always the same one."""
    rng = np.random.default_rng([seed, zlib.crc32(kind.encode())])
    return replace(_MAKERS[kind](rng, seed), kind=kind, name=f"{kind}-{seed}")
