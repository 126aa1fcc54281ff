# SPDX-License-Identifier: MIT
from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from hybridreg.data.simulate.sensing.caster import Hits
from hybridreg.data.simulate.sensing.returns import measured_ranges
from hybridreg.data.simulate.sensing.sensors import SENSORS
from hybridreg.data.simulate.world.materials import MATERIAL_INDEX

SENSOR = SENSORS["hdl64e"]
N = 6000


def wall(distance: float | np.ndarray, cosine: float = 1.0, material: str = "concrete") -> np.ndarray:
    directions = np.tile(np.float32([1, 0, 0]), (N, 1))
    normal = np.tile(np.float32([-cosine, np.sqrt(1 - cosine**2), 0]), (N, 1))
    distances = np.broadcast_to(np.float32(distance), (N,)).copy()
    index = np.full(N, MATERIAL_INDEX[material], np.uint8)
    hits = Hits(distances, normal, index, np.where(np.isfinite(distances), 0, -1).astype(np.int32))
    return measured_ranges(SENSOR, directions, hits, np.random.default_rng(0))


def share(ranges: np.ndarray) -> float:
    return float(np.isfinite(ranges).mean())


def spread(ranges: np.ndarray) -> float:
    return float(np.subtract(*np.nanpercentile(ranges, [84, 16])) / 2)


def test_noise_is_unbiased_and_grows_with_range_and_slant() -> None:
    assert np.nanmedian(wall(20.0)) == pytest.approx(20.0, abs=0.003)
    assert spread(wall(10.0)) == pytest.approx(np.hypot(0.015 + 0.0002 * 10, 0.004), rel=0.1)
    assert spread(wall(60.0)) > 1.3 * spread(wall(5.0))
    assert spread(wall(30.0, cosine=0.1)) > 1.5 * spread(wall(30.0))


def test_returns_thin_out_with_range_slant_and_darkness() -> None:
    assert share(wall(10.0)) > 0.97
    assert share(wall(85.0, material="asphalt")) < 0.7 * share(wall(20.0, material="asphalt"))
    assert share(wall(50.0, cosine=0.05)) < 0.8 * share(wall(50.0))
    assert share(wall(50.0, material="rubber")) < 0.5 * share(wall(50.0, material="plaster"))


def test_panes_let_pulses_into_the_room_behind() -> None:
    ranges = wall(10.0, material="glass")
    assert 0.25 < share(ranges) < 0.7
    assert np.nanmax(ranges[np.isfinite(ranges)]) > 11
    assert np.nanmedian(ranges) < 12


def test_blind_zone_and_reach_are_silent_but_for_strays() -> None:
    for distance in (0.5 * SENSOR.range_min, 1.2 * SENSOR.range_max, np.inf):
        assert share(wall(distance)) < 0.003


def test_strays_come_from_rays_that_hit_nothing_too() -> None:
    ranges = wall(np.inf)
    assert 0 < np.isfinite(ranges).sum() < 0.003 * N


def test_edges_give_ranges_between_the_two_surfaces() -> None:
    stairs = np.where(np.arange(N) % 2, 10.0, 11.5)
    ranges = wall(stairs)
    between = (ranges > 10.2) & (ranges < 11.3)
    assert 0.1 < between.mean() < 0.35
    deep = wall(np.where(np.arange(N) % 2, 10.0, 30.0))  # farther apart than a pulse is long: either or
    assert ((deep > 10.5) & (deep < 29.5)).mean() < 0.003


def test_one_changed_hit_changes_no_other_range_but_its_neighbour() -> None:
    plain = np.full(N, 15.0)
    bumped = plain.copy()
    bumped[100] = 16.0
    differs = np.flatnonzero(~np.isclose(wall(plain), wall(bumped), equal_nan=True))
    assert set(differs) <= {99, 100}
    assert 100 in differs


def test_power_is_calibrated_to_the_data_sheet() -> None:
    # range_10 is where half the pulses return from a 10 % target at right angles.
    sensor = replace(SENSOR, range_10=40.0)
    dark = Hits(
        np.full(N, 40.0, np.float32), np.tile(np.float32([-1, 0, 0]), (N, 1)),
        np.full(N, MATERIAL_INDEX["dark_paint"], np.uint8), np.zeros(N, np.int32),
    )  # fmt: skip
    ranges = measured_ranges(sensor, np.tile(np.float32([1, 0, 0]), (N, 1)), dark, np.random.default_rng(0))
    assert share(ranges) == pytest.approx(0.5 * (1 - 0.35), abs=0.03)  # dark paint loses 35 % besides
