# SPDX-License-Identifier: MIT
"""A motorway whose traffic has moved on as one stream between the two scans."""

from __future__ import annotations

import numpy as np

from hybridreg.data.hard.outings import GRAIN, METRES, base, mount
from hybridreg.data.hard.place import Place
from hybridreg.data.hard.shared_surface import judged
from hybridreg.data.hard.sights import AROUND, lidar, look
from hybridreg.data.hard.true_poses import Sample

_LANES = (-6.2, -2.7, 2.7, 6.2)


def traffic(rng: np.random.Generator, seed: int) -> Sample:
    """Between rails or noise barriers; but for posts nothing that is fixed faces along the road."""
    ahead, driven, yaws = rng.uniform(3.0, 12.0), rng.uniform(0.0, 10.0), rng.uniform(0.0, 360.0, 2)
    later, now = _road(seed, ahead), _road(seed, 0.0)
    shots = [
        look(place.world(), lidar(str(rng.choice(AROUND)), rng), base(place, x, 0.0, yaw) @ mount(rng), rng)
        for place, x, yaw in zip((later, now), (driven, 0.0), yaws, strict=True)
    ]
    return judged(shots[0], shots[1], METRES, GRAIN)


def _road(seed: int, ahead: float) -> Place:
    # The same road for a seed, its vehicles `ahead` metres further.
    rng = np.random.default_rng([seed, 7])
    place = (
        Place()
    )  # level: a place's relief nearly repeats after nine metres, and would agree where traffic does
    high, aside = (float(rng.uniform(3.0, 5.0)), 12.0) if rng.random() < 0.5 else (0.8, 10.0)
    for side in (-1.0, 1.0):
        place.box(0.0, side * aside, 0.0, (190.0, 0.3, high))
    for _ in range(rng.integers(0, 20)):
        place.post(rng.uniform(-70.0, 70.0), rng.choice([-9.5, 9.5]), 0.1, 6.0)
    for lane in _LANES:
        for x in np.arange(-62.0, 62.0, rng.uniform(13.0, 22.0)):
            long = rng.random() < 0.5
            size = (10.5, 2.5, 3.6) if long else (rng.uniform(4.0, 5.0), 1.8, rng.uniform(1.4, 1.9))
            place.box(x + rng.normal(0.0, 1.5) + ahead, lane, 0.0, size)
    place.ground(100.0)
    return place
