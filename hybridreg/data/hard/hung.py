# SPDX-License-Identifier: MIT
"""Scans in their sensors' frames: plain, tilted, upside down, cropped to what is near, thinned to few points."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from hybridreg.data.hard.outings import GRAIN, METRES, mount, scans
from hybridreg.data.hard.shared_surface import judged
from hybridreg.data.hard.sights import AROUND, LIDARS, Shot
from hybridreg.data.hard.true_poses import Sample
from hybridreg.geometry import se3

Array = NDArray[np.float64]


def plain(rng: np.random.Generator, seed: int) -> Sample:
    """Two ordinary scans: the material that mistakes are made from."""
    source, target, _ = scans(rng, seed, apart=(1.0, 8.0))
    return judged(source, target, METRES, GRAIN)


def tilt(rng: np.random.Generator, seed: int) -> Sample:
    """One sensor or both are tilted by 10 to 40 degrees."""
    both = rng.random() < 0.4
    mounts = mount(rng) @ _lean(rng), mount(rng) @ (_lean(rng) if both else np.eye(4))
    source, target, _ = scans(rng, seed, apart=(1.0, 12.0), mounts=mounts)
    return judged(*_either(rng, source, target), METRES, GRAIN)


def upside_down(rng: np.random.Generator, seed: int) -> Sample:
    """One sensor is mounted upside down: its own z points at the ground."""
    over = se3.from_rt(se3.rotation_about(np.array([np.pi, 0.0, 0.0])), np.zeros(3))
    source, target, _ = scans(rng, seed, apart=(1.0, 12.0), mounts=(mount(rng) @ over, mount(rng)))
    return judged(*_either(rng, source, target), METRES, GRAIN)


def crop(rng: np.random.Generator, seed: int) -> Sample:
    """Both scans cropped to what lies near their sensors, within a circle or a box."""
    source, target, _ = scans(rng, seed, (AROUND, LIDARS), apart=(1.0, 6.0))
    circle = rng.random() < 0.6
    half = np.full(2, rng.uniform(8.0, 12.0)) if circle else rng.uniform(7.0, 12.0, 2)
    source, target = _cut(source, half, circle), _cut(target, half, circle)
    return judged(*_either(rng, source, target), METRES, GRAIN)


def few(rng: np.random.Generator, seed: int) -> Sample:
    """One scan or both thinned at random to 150 to 1000 points."""
    source, target, _ = scans(rng, seed, apart=(1.0, 8.0))
    one = judged(source, target, METRES, GRAIN)
    n_source, n_target = np.exp(rng.uniform(np.log(150), np.log(1000), 2)).astype(int)
    thinned = _some(rng, source, n_source)
    other = _some(rng, target, n_target) if rng.random() < 0.6 else target
    sample = judged(thinned, other, METRES, GRAIN)
    # Surface is compared before the thinning: few points lie on the same surfaces, but seldom at the same spots.
    plenty = min(len(sample.source), len(sample.target)) >= 400
    return replace(sample, solvable=one.solvable and plenty)


def _cut(shot: Shot, half: Array, circle: bool) -> Shot:
    xy = shot.points[:, :2] / half
    far = np.linalg.norm(xy, axis=1) if circle else np.abs(xy).max(axis=1)
    return shot.kept(far < 1.0)


def _lean(rng: np.random.Generator) -> Array:
    axis = rng.uniform(0.0, 2.0 * np.pi)
    way = np.array([np.cos(axis), np.sin(axis), 0.0])
    return se3.from_rt(se3.rotation_about(way * np.radians(rng.uniform(10.0, 40.0))), np.zeros(3))


def _some(rng: np.random.Generator, shot: Shot, n: int) -> Shot:
    return shot.kept(np.sort(rng.permutation(len(shot.points))[:n]))


def _either(rng: np.random.Generator, source: Shot, target: Shot) -> tuple[Shot, Shot]:
    return (source, target) if rng.random() < 0.5 else (target, source)
