# SPDX-License-Identifier: MIT
"""Scan patterns of each kind of sensor: unit directions in firing order, x forward and z up."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from hybridreg.data.simulate.sensing.column_arrays import stack
from hybridreg.data.simulate.sensing.sensors import Sensor


def _directions(azimuth: np.ndarray, elevation: np.ndarray) -> np.ndarray:
    # Single precision is four times as fast, and a tenth of a millimetre at a hundred metres.
    azimuth, elevation = azimuth.astype(np.float32), elevation.astype(np.float32)
    level = np.cos(elevation)
    up = np.broadcast_to(np.sin(elevation), np.broadcast_shapes(azimuth.shape, elevation.shape))
    return stack(level * np.cos(azimuth), level * np.sin(azimuth), up)


def spinning(sensor: Sensor, rng: np.random.Generator) -> np.ndarray:
    """Rings, one beam after the other; each unit's beams are misaligned by a few hundredths of a degree."""
    beams = len(sensor.elevations_deg)
    steps = sensor.points // beams
    elevation = np.radians(np.array(sensor.elevations_deg) + rng.normal(0, 0.03, beams))
    start = rng.uniform(0, 2 * np.pi, beams)
    azimuth = start[:, None] + np.arange(steps) * (2 * np.pi / steps)
    return _directions(azimuth, elevation[:, None])


def fan(sensor: Sensor, rng: np.random.Generator) -> np.ndarray:
    """Five modules side by side, each a mirror that scans its own part, slightly misaligned."""
    modules = 5
    wide, high = np.radians(sensor.fov_deg)
    part = wide / modules
    rows = round(np.sqrt(sensor.points / modules * high / (part * 1.05)))
    columns = sensor.points // modules // rows
    swing = np.sin(np.linspace(-0.44 * np.pi, 0.44 * np.pi, columns)) / np.sin(0.44 * np.pi)
    tilt = np.linspace(-0.5, 0.5, rows)
    parts = []
    for k in range(modules):
        # Neighbouring modules overlap by 5 %; within one, rows bow like the image of a tilted mirror.
        across = (k - 2) * part + 0.525 * part * swing[None, :] + rng.normal(0, 0.0015)
        up = high * tilt[:, None] + 0.012 * swing[None, :] ** 2 * (1 if k % 2 else -1) + rng.normal(0, 0.0015)
        up = up + np.linspace(0, high / rows, columns)[None, :]
        parts.append(_directions(across, up))
    return np.concatenate([part.T for part in parts], axis=1).T


def rosette(sensor: Sensor, rng: np.random.Generator) -> np.ndarray:
    """Two counter-rotating wedge prisms with six emitters in a row; no two scans repeat."""
    emitters = 6
    n = sensor.points // emitters
    wide, high = np.radians(sensor.fov_deg)
    time = np.arange(n) * (0.2 / n)
    phase = rng.uniform(0, 2 * np.pi, 2)
    first = 2 * np.pi * 121.6 * time + phase[0]
    second = -2 * np.pi * 77.7 * time + phase[1]
    x = 0.5 * (np.cos(first) + np.cos(second))
    y = 0.5 * (np.sin(first) + np.sin(second))
    spread = (np.arange(emitters) - 2.5)[:, None] * 0.011
    return _directions(0.5 * wide * 0.97 * x[None] + spread, 0.5 * high * y[None] + 0.3 * spread)


def raster(sensor: Sensor, rng: np.random.Generator) -> np.ndarray:
    """Lines that are dense at the horizon and sparse at the edges."""
    wide, high = np.radians(sensor.fov_deg)
    rows = round(np.sqrt(sensor.points * high / wide) * 1.1)
    columns = sensor.points // rows
    u = np.linspace(-1, 1, rows)
    elevation = 0.5 * high * (0.35 * u + 0.65 * u**3) + rng.normal(0, 0.0003, rows)
    azimuth = 0.5 * wide * np.linspace(-1, 1, columns)
    shift = rng.uniform(0, wide / columns, rows)[:, None]
    return _directions(azimuth[None] + shift, elevation[:, None])


def rows(sensor: Sensor, rng: np.random.Generator) -> np.ndarray:
    """Three modules side by side that scan evenly spaced rows in step; as three clouds of PandaSet's PandarGT show."""
    modules = 3
    wide, high = np.radians(sensor.fov_deg)
    columns = round(np.sqrt(1.47 * sensor.points * wide / high) / modules)  # denser within rows than across
    lines = sensor.points // (modules * columns)
    part = wide / modules
    along = np.linspace(-0.5, 0.5, columns)
    up = np.radians(sensor.middle_deg) + 0.5 * high * np.linspace(1, -1, lines)
    middle = part * (np.arange(modules) - 1)
    azimuth = middle[:, None, None] + 1.01 * part * along
    # Rows slope by a degree over the width of their module.
    elevation = up[:, None] + 0.017 * along + rng.normal(0, 0.0005, (modules, lines))[:, :, None]
    return _directions(azimuth, elevation)


PATTERNS: dict[str, Callable[[Sensor, np.random.Generator], np.ndarray]] = {
    "spinning": spinning,
    "fan": fan,
    "rosette": rosette,
    "raster": raster,
    "rows": rows,
}


def pattern(sensor: Sensor, rng: np.random.Generator) -> np.ndarray:
    """Unit directions (n,3) float32 of one scan, in firing order, stored column by column."""
    return PATTERNS[sensor.kind](sensor, rng)
