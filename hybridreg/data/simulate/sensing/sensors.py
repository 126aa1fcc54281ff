# SPDX-License-Identifier: MIT
"""The sensors, as a table. A row added here (or a `Sensor` handed to `pairs`) is a new sensor."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, kw_only=True)
class Sensor:
    """Geometry and ranging of one model; elevations and rates follow the makers' data sheets."""

    name: str
    kind: str  # "spinning", "fan", "rosette", "raster" or "rows": one of patterns.PATTERNS
    points: int  # pulses per scan
    fov_deg: tuple[float, float] = (
        360.0,
        0.0,
    )  # across and up; up follows from `elevations_deg` when spinning
    elevations_deg: tuple[float, ...] = ()  # one per beam, spinning sensors only
    middle_deg: float = 0.0  # elevation of the middle of the field of view, "rows" only
    range_min: float = 0.5  # blind zone, metres
    range_max: float = 120.0
    range_10: float = 60.0  # where half the pulses return from a 10 % target at right angles
    noise_m: float = 0.012  # standard deviation at close range
    noise_growth: float = 0.0002  # and its increase per metre
    divergence_mrad: float = 2.5
    quantum_m: float = 1 / 256  # coordinates come in steps of about 4 mm


def _steps(*pieces: tuple[float, float, int]) -> tuple[float, ...]:
    return tuple(float(v) for start, end, n in pieces for v in np.linspace(start, end, n))


_VLP32C = (
    -25.0, -15.639, -11.31, -8.843, -7.254, -6.148, -5.333, -4.667, -4.0, -3.667, -3.333, -3.0, -2.667, -2.333, -2.0,
    -1.667, -1.333, -1.0, -0.667, -0.333, 0.0, 0.333, 0.667, 1.0, 1.333, 1.667, 2.333, 3.333, 4.667, 7.0, 10.333, 15.0,
)  # fmt: skip
_HDL64E = _steps((-24.33, -8.83, 32), (-8.33, 2.0, 32))  # 1/2 degree below, 1/3 degree above
_PANDAR64 = (-25.0, -19.0, *_steps((-14, -6, 9), (-5.833, 2.0, 48)), 3.0, 5.0, 8.0, 11.0, 15.0)
_PANDAR40 = (-16.0, *_steps((-15, -6, 10), (-5.67, 2.0, 24)), 3.0, 4.0, 5.0, 6.0, 7.0)
_VLS128 = _steps((-25, -7, 19), (-6.5, -4.1, 13), (-4.0, 2.0, 56), (2.15, 5.0, 20), (5.3, 15.0, 20))

SENSORS = {
    sensor.name: sensor
    for sensor in (
        Sensor(name="vlp16", kind="spinning", elevations_deg=_steps((-15, 15, 16)), points=16 * 1800, range_10=45),
        Sensor(name="hdl32e", kind="spinning", elevations_deg=_steps((-30.67, 10.67, 32)), points=32 * 2160,
               range_10=45, range_max=90),
        Sensor(name="vlp32c", kind="spinning", elevations_deg=_VLP32C, points=32 * 1800, range_10=80, range_max=200),
        Sensor(name="pandar40", kind="spinning", elevations_deg=_PANDAR40, points=40 * 1800, range_10=80,
               range_max=200),
        Sensor(name="hdl64e", kind="spinning", elevations_deg=_HDL64E, points=64 * 2083, range_min=0.9, range_10=50,
               range_max=90, noise_m=0.015),
        Sensor(name="os1-64", kind="spinning", elevations_deg=_steps((-16.6, 16.6, 64)), points=64 * 2048,
               range_min=0.8, range_10=26, noise_m=0.018, noise_growth=0.0006, divergence_mrad=3.2),
        Sensor(name="pandar64", kind="spinning", elevations_deg=_PANDAR64, points=64 * 1800, range_10=80,
               range_max=200),
        Sensor(name="pandarqt", kind="spinning", elevations_deg=_steps((-52.1, 52.1, 64)), points=64 * 600,
               range_min=0.1, range_10=18, range_max=60),
        Sensor(name="vls128", kind="spinning", elevations_deg=_VLS128, points=128 * 1800, range_10=110, range_max=220),
        Sensor(name="mems-fan", kind="fan", fov_deg=(120.0, 25.0), points=126 * 625, range_10=75, range_max=200,
               noise_m=0.02, noise_growth=0.0003, divergence_mrad=3.0),
        Sensor(name="rosette", kind="rosette", fov_deg=(70.4, 77.2), points=48_000, range_min=1.0, range_10=95,
               range_max=200, noise_m=0.015, divergence_mrad=3.5),
        Sensor(name="raster", kind="raster", fov_deg=(60.0, 20.0), points=60_000, range_min=1.0, range_10=120,
               range_max=200, noise_m=0.02, noise_growth=0.0003, divergence_mrad=2.0),
        # Not among SOURCE_SENSORS: the tiers were frozen before its pattern was read off real clouds.
        Sensor(name="pandargt", kind="rows", fov_deg=(61.5, 20.6), middle_deg=-5.0, points=130 * 570, range_min=1.0,
               range_10=120, range_max=300, noise_m=0.02, noise_growth=0.0003, divergence_mrad=2.0),
    )
}  # fmt: skip
SOURCE_SENSORS = {"mems-fan": 0.5, "rosette": 0.25, "raster": 0.25}
TARGET_SENSORS = {
    "hdl64e": 0.25, "os1-64": 0.15, "pandar64": 0.15, "vls128": 0.1, "vlp32c": 0.12, "hdl32e": 0.11, "vlp16": 0.12,
}  # fmt: skip
