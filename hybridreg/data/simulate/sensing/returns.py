# SPDX-License-Identifier: MIT
"""From first hits to what a sensor reports: power, noise, mixed pixels, stray returns, the blind zone."""

from __future__ import annotations

import numpy as np

from hybridreg.data.simulate.sensing.caster import Hits
from hybridreg.data.simulate.sensing.column_arrays import dot
from hybridreg.data.simulate.sensing.sensors import Sensor
from hybridreg.data.simulate.world.materials import LOST, MATERIAL_INDEX, REFLECTIVITY, ROUGHNESS

STRAY_SHARE = 0.0004
INSIDE_SHARE = 0.35  # share of the pulses that pass a pane and return from the room or the seats behind it
MIXED_SHARE = 0.3  # share of the pulses at an edge
GLASS = MATERIAL_INDEX["glass"]


def measured_ranges(
    sensor: Sensor, directions: np.ndarray, hits: Hits, rng: np.random.Generator
) -> np.ndarray:
    """Reported range (n,) of each pulse, NaN where nothing is reported.

    Every random number is drawn for every pulse, so that one changed hit changes one range only.
    """
    n = len(directions)
    chance = rng.random((4, n), dtype=np.float32)
    gauss = rng.standard_normal(n, dtype=np.float32)
    hit = hits.face >= 0
    t = np.where(hit, hits.distance, np.float32(0))
    cosine = np.clip(-dot(hits.normal, directions), 0.01, 1.0)
    # The radar equation for a rough surface that fills the beam, against the data sheet's 10 % target.
    reach = np.float32(sensor.range_10) / np.maximum(t, np.float32(0.1))
    power = (10 * REFLECTIVITY).take(hits.material) * np.sqrt(cosine) * reach * reach
    returned = chance[0] * (1 + 1 / (power * power * np.sqrt(power))) < (1 - LOST).take(hits.material)
    returned &= hit
    mixed = _mix_edges(t, returned, chance[1], chance[2])
    ranges = np.where(returned, mixed + _noise(sensor, t, cosine, hits.material) * gauss, np.float32(np.nan))
    inside = np.flatnonzero(~returned & (hits.material == GLASS) & (chance[1] < INSIDE_SHARE) & (power > 0.3))
    ranges[inside] = t[inside] + 0.3 + 4.0 * chance[2][inside] ** 2
    stray = np.flatnonzero(chance[3] < STRAY_SHARE)
    ranges[stray] = sensor.range_min + 50 * chance[0][stray] ** 2
    ranges[(ranges < sensor.range_min) | (ranges > sensor.range_max)] = np.nan
    return ranges


def _noise(sensor: Sensor, t: np.ndarray, cosine: np.ndarray, material: np.ndarray) -> np.ndarray:
    """Standard deviation (n,) of a range `t`: the clock's, the slanted footprint's and the surface's own."""
    clock = np.float32(sensor.noise_m) + np.float32(sensor.noise_growth) * t
    # The footprint's length along the ray is divergence x range x tan(incidence).
    slant = np.sqrt(1 - cosine * cosine) / cosine
    smear = np.minimum(np.float32(0.04e-3 * sensor.divergence_mrad) * t * slant, np.float32(0.15))
    rough = (ROUGHNESS * ROUGHNESS).take(material)
    return np.asarray(np.sqrt(clock * clock + smear * smear + rough))


def _mix_edges(t: np.ndarray, returned: np.ndarray, chance: np.ndarray, share: np.ndarray) -> np.ndarray:
    """A pulse half on an edge reports a range between the two surfaces when they are within a pulse length."""
    behind = np.roll(t, -1) - t
    depth = np.abs(behind)
    edge = np.flatnonzero(
        (chance < MIXED_SHARE) & (depth > 0.15) & (depth < 2.5) & returned & np.roll(returned, -1)
    )
    mixed = t.copy()
    mixed[edge] += share[edge] * behind[edge]
    return mixed
