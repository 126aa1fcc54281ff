# SPDX-License-Identifier: MIT
from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import hybridreg.data
from hybridreg.data import simulate
from hybridreg.data.simulate import Drawn, Sensor, simulated_folder
from hybridreg.data.simulate.sensing.overlaps import thin
from hybridreg.data.simulate.sensing.thinned import step, thinned
from hybridreg.data.simulate.simulated_folder import read_pair, write_pair, write_pairs

FACTS = {"id": "sim:train/mid/0/11", "tier": "mid", "seed": 0}


@pytest.mark.parametrize("voxel", [None, 0.25])
def test_folders_read_back_identically(tmp_path: Path, mid_pair: Drawn, voxel: float | None) -> None:
    made = simulate.to_labelled(mid_pair, FACTS["id"], voxel)
    read = read_pair(write_pair(tmp_path / "one", mid_pair, FACTS, voxel))
    np.testing.assert_array_equal(read.pair.source.points, made.pair.source.points)
    np.testing.assert_array_equal(read.pair.target.points, made.pair.target.points)
    np.testing.assert_array_equal(read.pair.image, made.pair.image)
    np.testing.assert_array_equal(read.T_target_source, made.T_target_source)
    assert (read.pair.id, read.overlap, read.pair.source.sensor) == (made.pair.id, made.overlap, "mems-fan")
    assert read.pair.meta == made.pair.meta


def test_layout_on_disk_is_the_documented_one(tmp_path: Path, mid_pair: Drawn) -> None:
    write_pair(tmp_path / "one", mid_pair, FACTS, None)
    assert sorted(p.name for p in (tmp_path / "one").iterdir()) == [
        "image.jpg",
        "meta.json",
        "source.npz",
        "target.npz",
    ]
    assert np.load(tmp_path / "one" / "source.npz")["xyz"].dtype == np.float32
    meta = json.loads((tmp_path / "one" / "meta.json").read_text())
    assert {"T_target_source", "source_sensor", "target_sensor", "overlap", "tier", "seed", "version"} <= set(
        meta
    )


def test_a_pair_is_written_whole_or_not_at_all(
    tmp_path: Path, mid_pair: Drawn, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full_disk(*_: object, **__: object) -> None:
        raise OSError("disk full")

    monkeypatch.setattr(simulated_folder, "_write_cloud", full_disk)
    with pytest.raises(OSError, match="disk full"):
        write_pair(tmp_path / "one", mid_pair, FACTS, None)
    assert list(tmp_path.iterdir()) == []


def test_runs_resume_and_workers_change_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, mid_pair: Drawn
) -> None:
    drawn: list[int] = []
    monkeypatch.setattr(simulated_folder, "draw", lambda tier, number: drawn.append(number) or mid_pair)
    first = list(write_pairs(tmp_path, tier="mid", pairs=2, seed=4))
    again = list(write_pairs(tmp_path, tier="mid", pairs=3, seed=4))
    assert again[:2] == first
    assert len(drawn) == 3


def test_thinned_clouds_take_less_than_four_bytes_a_point(tmp_path: Path, mid_pair: Drawn) -> None:
    path = write_pair(tmp_path / "one", mid_pair, FACTS, 0.25)
    for name in ("source.npz", "target.npz"):
        points = np.load(path / name)["xyz"]
        assert len(points) > 2000
        assert (path / name).stat().st_size < 4 * len(points)


@pytest.mark.parametrize(("voxel", "size"), [(0.25, 1 / 64), (0.3, 1 / 64), (0.1, 1 / 256), (1.0, 1 / 16)])
def test_thinned_points_are_measured_points_rounded_to_a_part_of_the_cube(
    mid_pair: Drawn, voxel: float, size: float
) -> None:
    assert step(voxel) == size
    points = thinned(mid_pair.target, voxel)
    exact = thin(mid_pair.target, voxel)
    assert points.dtype == np.float32
    np.testing.assert_array_equal(points / size, np.rint(points / size))
    assert np.abs(points - exact).max() <= size / 2
    assert thinned(mid_pair.target, None) is mid_pair.target


def test_the_pair_that_ships_is_sound(thin_sensors: tuple[Sensor, Sensor]) -> None:
    demo = Path(hybridreg.data.__file__).parent / "demo"
    labelled = read_pair(demo)
    assert sum(f.stat().st_size for f in demo.iterdir()) < 300_000
    share = simulate.overlap(
        labelled.pair.source.points, labelled.pair.target.points, labelled.T_target_source
    )
    assert share == pytest.approx(labelled.overlap, abs=0.03)
