# SPDX-License-Identifier: MIT
from __future__ import annotations

import numpy as np
import pytest

from hybridreg.data.simulate.sensing.patterns import pattern
from hybridreg.data.simulate.sensing.sensors import SENSORS, SOURCE_SENSORS, TARGET_SENSORS


def angles(name: str, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    d = pattern(SENSORS[name], np.random.default_rng(seed))
    return np.degrees(np.arctan2(d[:, 1], d[:, 0])), np.degrees(np.arcsin(d[:, 2]))


@pytest.mark.parametrize("name", SENSORS)
def test_pattern_has_unit_directions_and_about_the_stated_pulses(name: str) -> None:
    directions = pattern(SENSORS[name], np.random.default_rng(0))
    assert len(directions) == pytest.approx(SENSORS[name].points, rel=0.03)
    np.testing.assert_allclose(np.linalg.norm(directions, axis=1), 1, atol=1e-5)


@pytest.mark.parametrize("name", [n for n, s in SENSORS.items() if s.kind == "spinning"])
def test_rings_lie_at_the_tabled_elevations_all_around(name: str) -> None:
    azimuth, elevation = angles(name)
    beams = np.array(SENSORS[name].elevations_deg)
    nearest = np.abs(elevation[::11, None] - beams[None]).min(axis=1)  # a prime step meets every beam
    assert nearest.max() < 0.2
    assert len(np.unique(np.floor(azimuth / 10))) == 36


@pytest.mark.parametrize(
    ("name", "beams"),
    [("vlp16", 16), ("hdl32e", 32), ("vlp32c", 32), ("pandar40", 40), ("hdl64e", 64), ("os1-64", 64),
     ("pandar64", 64), ("pandarqt", 64), ("vls128", 128)],
)  # fmt: skip
def test_spinning_sensors_have_their_beams(name: str, beams: int) -> None:
    assert len(set(SENSORS[name].elevations_deg)) == beams


@pytest.mark.parametrize("name", [n for n, s in SENSORS.items() if s.kind != "spinning"])
def test_limited_sensors_fill_their_field_and_no_more(name: str) -> None:
    azimuth, elevation = angles(name)
    wide, high = SENSORS[name].fov_deg
    assert np.ptp(azimuth) == pytest.approx(wide, rel=0.06)
    assert np.ptp(elevation) == pytest.approx(high, rel=0.12)
    assert abs(azimuth.mean()) < 2


def test_raster_is_dense_about_the_horizon() -> None:
    _, elevation = angles("raster")
    centre, rim = (np.abs(elevation) < 2).mean() / 4, (np.abs(elevation) > 8).mean() / 4
    assert centre > 2 * rim


def test_rows_are_evenly_spaced_and_look_down() -> None:
    """As three clouds of PandaSet's PandarGT: 15 degrees below the horizon to 5.5 above, 0.15 to 0.16 between rows."""
    azimuth, elevation = angles("pandargt")
    middle = azimuth[np.argmin(np.abs(azimuth))]
    ahead = np.sort(elevation[np.abs(azimuth - middle) < 0.02])
    assert elevation.min() == pytest.approx(-15.4, abs=0.6)
    assert elevation.max() == pytest.approx(5.4, abs=0.6)
    below, above = (np.diff(ahead[part]).mean() for part in (ahead < -5.0, ahead > -5.0))
    assert below == pytest.approx(0.16, abs=0.01)
    assert above == pytest.approx(below, abs=0.01)


def test_rosette_never_repeats_and_the_others_keep_their_lines() -> None:
    one, other = (pattern(SENSORS["rosette"], np.random.default_rng(s)) for s in (1, 2))
    assert np.degrees(np.arccos(np.clip((one * other).sum(1), -1, 1))).max() > 10
    # A fan is the same grid each time, but for the seams of its modules.
    one, other = (pattern(SENSORS["mems-fan"], np.random.default_rng(s)) for s in (1, 2))
    assert np.degrees(np.arccos(np.clip((one * other).sum(1), -1, 1))).max() < 1


def test_chances_name_known_sensors_and_targets_spin() -> None:
    assert {SENSORS[n].kind for n in TARGET_SENSORS} == {"spinning"}
    assert {SENSORS[n].kind for n in SOURCE_SENSORS} == {"fan", "rosette", "raster"}
