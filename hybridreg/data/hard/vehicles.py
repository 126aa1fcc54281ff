# SPDX-License-Identifier: MIT
"""Single and merged scans in a vehicle's frame, whose origin lies on the ground between the wheels."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hybridreg.data.hard.outdoors import outdoors
from hybridreg.data.hard.outings import GRAIN, METRES, mount, next_to, scans, stand
from hybridreg.data.hard.shared_surface import judged
from hybridreg.data.hard.sights import AROUND, LIDARS, Shot, lidar, look, merged, pose
from hybridreg.data.hard.true_poses import Sample
from hybridreg.data.simulate.sensing.caster import World

Array = NDArray[np.float64]


def base_link(rng: np.random.Generator, seed: int) -> Sample:
    """One or both scans in the vehicle's frame, 10 cm under to 10 cm over the ground."""
    source, target, (first, second) = scans(rng, seed)
    which = rng.choice(["source", "target", "both"])
    if which != "target":
        source = source.within(first @ _lifted(rng))
    if which != "source":
        target = target.within(second @ _lifted(rng))
    return judged(source, target, METRES, GRAIN)


def several(rng: np.random.Generator, seed: int) -> Sample:
    """Two to four LiDARs merged in the vehicle's frame, against one scan or the same vehicle elsewhere."""
    place = outdoors(rng, seed)
    second = stand(place, rng)
    first = next_to(place, rng, second, 1.0, 12.0)
    rig = _rig(rng)
    lift = _lifted(rng)
    target = merged(_looks(place.world(), rig, second, rng), second @ lift)
    later = place.world(rng, (first, second))
    if rng.random() < 0.5:
        source = merged(_looks(later, rig, first, rng), first @ lift)
    else:
        source = look(later, lidar(str(rng.choice(LIDARS)), rng), first @ mount(rng), rng)
        if rng.random() < 0.5:
            source = source.within(first @ lift)
    if rng.random() < 0.3:
        source, target = target, source
    return judged(source, target, METRES, GRAIN)


def _lifted(rng: np.random.Generator) -> Array:
    return pose(0.0, 0.0, rng.uniform(-0.1, 0.1), 0.0)


def _rig(rng: np.random.Generator) -> list[tuple[str, Array]]:
    # Names of the LiDARs with their positions on the vehicle.
    rig = []
    for k in range(rng.integers(2, 5)):
        if k == 0:
            rig.append((str(rng.choice(AROUND)), pose(0.0, 0.0, rng.uniform(1.6, 2.1), 0.0)))
            continue
        yaw = rng.choice([0.0, 45.0, 90.0, 180.0, -90.0, -45.0]) + rng.normal(0.0, 2.0)
        c, s = np.cos(np.radians(yaw)), np.sin(np.radians(yaw))
        place = (2.0 * c, 0.9 * s, rng.uniform(0.5, 1.9))
        rig.append(
            (str(rng.choice(["rings16", "fan", "rosette"])), pose(*place, yaw, rng.uniform(0.0, 12.0)))
        )
    return rig


def _looks(world: World, rig: list[tuple[str, Array]], T: Array, rng: np.random.Generator) -> list[Shot]:
    return [look(world, lidar(name, rng, columns=600), T @ T_mount, rng) for name, T_mount in rig]
