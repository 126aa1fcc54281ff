# SPDX-License-Identifier: MIT
"""From first hits to what a sensor reports: power, noise, mixed pixels, strays, the blind zone."""

from __future__ import annotations

import numpy as np

from hybridreg.data.simulate.caster import Hits
from hybridreg.data.simulate.materials import LOST, MATERIAL_INDEX, REFLECTIVITY, ROUGHNESS
from hybridreg.data.simulate.sensors import Sensor

STRAY_SHARE = 0.0004
INSIDE_SHARE = 0.35  # of the pulses that pass a pane: they come back from the room or the seats behind it
MIXED_SHARE = 0.3  # of pulses at an edge
GLASS = MATERIAL_INDEX["glass"]


def measured_ranges(
    sensor: Sensor, directions: np.ndarray, hits: Hits, rng: np.random.Generator
) -> np.ndarray:
    """Reported range (n,) of each pulse, NaN where nothing is reported.

    Every random number is drawn for every pulse, so that one changed hit changes one range only.
    """
    n = len(directions)
    chance = rng.random((4, n), dtype=np.float32)
    gauss = rng.standard_normal((2, n), dtype=np.float32)
    t = np.where(np.isfinite(hits.distance), hits.distance, 0.0)
    cosine = np.clip(-np.einsum("ij,ij->i", hits.normal, directions), 0.01, 1.0)
    # The radar equation for a rough surface that fills the beam, against the data sheet's 10 % target.
    power = REFLECTIVITY[hits.material] / 0.1 * np.sqrt(cosine) * (sensor.range_10 / np.maximum(t, 0.1)) ** 2
    returned = chance[0] < (1 - LOST[hits.material]) / (1 + power**-2.5)
    returned &= np.isfinite(hits.distance)
    mixed = _mix_edges(t, returned, chance[1], chance[2])
    spread = sensor.noise_m + sensor.noise_growth * t
    # A slanted footprint smears the pulse: its length along the ray is divergence x range x tan(incidence).
    smear = np.minimum(0.04 * sensor.divergence_mrad * 1e-3 * t * np.sqrt(1 - cosine**2) / cosine, 0.15)
    noise = np.hypot(spread, smear) * gauss[0] + ROUGHNESS[hits.material] * gauss[1]
    ranges = np.where(returned, mixed + noise, np.nan)
    inside = ~returned & (hits.material == GLASS) & (chance[1] < INSIDE_SHARE) & (power > 0.3)
    ranges[inside] = t[inside] + 0.3 + 4.0 * chance[2][inside] ** 2
    stray = chance[3] < STRAY_SHARE
    ranges[stray] = sensor.range_min + 50 * chance[0][stray] ** 2
    ranges[(ranges < sensor.range_min) | (ranges > sensor.range_max)] = np.nan
    return ranges


def _mix_edges(t: np.ndarray, returned: np.ndarray, chance: np.ndarray, share: np.ndarray) -> np.ndarray:
    """A pulse half on an edge reports a range between the two surfaces when they are within a pulse length."""
    behind = np.roll(t, -1) - t
    edge = returned & np.roll(returned, -1) & (np.abs(behind) > 0.15) & (np.abs(behind) < 2.5)
    return np.where(edge & (chance < MIXED_SHARE), t + share * behind, t)
