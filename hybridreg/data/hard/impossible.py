# SPDX-License-Identifier: MIT
"""Pairs that no pose explains, or several do: made from ordinary pairs that a good method finds."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from hybridreg.data.hard import hung, maps, rooms, small_things, vehicles
from hybridreg.data.hard.true_poses import Array, Maker, Sample
from hybridreg.geometry import se3

_UNITS = {"mm": 1000.0, "cm": 100.0, "ft": 1.0 / 0.3048}
_ORDINARY = (hung.plain, hung.plain, hung.plain, maps.map_sensor, rooms.depth_room, rooms.lidars)


def mirrored(rng: np.random.Generator, seed: int) -> Sample:
    """The source as its mirror image: one axis exported the wrong way round, or two swapped."""
    pair = _ordinary(rng, seed)
    if rng.random() < 0.3:
        source = pair.source[:, [1, 0, 2]]
    else:
        source = pair.source * np.where(np.arange(3) == rng.choice(3, p=[0.35, 0.45, 0.2]), -1.0, 1.0)
    return _hopeless(pair, source, "mirror")


def scaled(rng: np.random.Generator, seed: int) -> Sample:
    """The source 3 to 12 % too small or too large."""
    pair = _ordinary(rng, seed)
    factor = round(float(rng.choice([rng.uniform(0.88, 0.97), rng.uniform(1.03, 1.12)])), 3)
    return _hopeless(pair, pair.source / factor, f"scale {factor}")


def strained(rng: np.random.Generator, seed: int) -> Sample:
    """The source stretched or narrowed by 4 to 10 % along one level direction, or sheared by as much."""
    pair = _solvable(maps.map_sensor if rng.random() < 0.5 else hung.plain, rng, seed)
    turned = se3.yaw(rng.uniform(0.0, 360.0))[:3, :3]
    part = float(rng.choice([-1.0, 1.0]) * rng.uniform(0.04, 0.1))
    strain = np.eye(3)
    strain[0, int(rng.random() < 0.5)] += part
    return _hopeless(pair, pair.source @ (turned @ strain @ turned.T).T, f"strain {part:.3f}")


def unit(rng: np.random.Generator, seed: int) -> Sample:
    """The source in millimetres, centimetres or feet."""
    pair = _ordinary(rng, seed)
    name = str(rng.choice(list(_UNITS)))
    return _hopeless(pair, pair.source * _UNITS[name], name)


def doubled(rng: np.random.Generator, seed: int) -> Sample:
    """The target, a map or a scan, contains itself twice, 1 to 4 m and up to 3 degrees apart."""
    make = maps.map_sensor if rng.random() < 0.5 else hung.plain
    pair = _solvable(make, rng, seed)
    turn, far = rng.uniform(0.0, 2.0 * np.pi), rng.uniform(1.0, 4.0)
    R = se3.yaw(rng.uniform(-3.0, 3.0))[:3, :3]
    J = se3.about(np.median(pair.target, axis=0), R, far * np.array([np.cos(turn), np.sin(turn), 0.0]))
    both = np.vstack([pair.target, se3.apply(J, pair.target)])
    return replace(pair, target=both, truths=(pair.truths[0], J @ pair.truths[0]))


def disjoint(rng: np.random.Generator, seed: int) -> Sample:
    """Source and target of two different worlds of one kind."""
    makes = (
        hung.plain, hung.crop, hung.crop, hung.tilt, maps.map_ground, maps.map_sensor, vehicles.base_link,
        vehicles.several, rooms.depth_room, rooms.lidars, rooms.flat, maps.building, small_things.thing,
        small_things.thing,
    )  # fmt: skip
    make = makes[rng.integers(len(makes))]
    one, other = make(rng, seed), make(rng, seed + 1)
    return replace(one, target=other.target, truths=(), metres=max(one.metres, other.metres), solvable=False)


def _ordinary(rng: np.random.Generator, seed: int) -> Sample:
    return _solvable(_ORDINARY[rng.integers(len(_ORDINARY))], rng, seed)


def _solvable(make: Maker, rng: np.random.Generator, seed: int) -> Sample:
    # The first that a good method solves; a hopeless pair would say nothing about the mistake.
    for _ in range(12):
        pair = make(rng, seed)
        if pair.solvable:
            break
    return pair


def _hopeless(pair: Sample, source: Array, cure: str) -> Sample:
    return replace(pair, source=np.ascontiguousarray(source), truths=(), solvable=False, cure=cure)
