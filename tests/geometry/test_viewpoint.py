# SPDX-License-Identifier: MIT
"""Where a cloud was seen from: said, found, or honestly unknown."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import hybridreg as hr
from hybridreg.cli import options
from hybridreg.cli.app import app
from hybridreg.data.hard import box_world
from hybridreg.data.loaders.folder import load_pair
from hybridreg.geometry import se3
from hybridreg.geometry.range_image import RangeImages, Seen

P = np.random.default_rng(0).normal(size=(500, 3)) * [5.0, 4.0, 2.0]


def street_scan(z: float = 1.8, seed: int = 3, sensor: str = "rings32") -> np.ndarray:
    world = box_world.street(np.random.default_rng(seed), crossing=True)
    return box_world.scan(world, sensor, box_world.sensor_pose(0.0, 0.3, z, 20.0), np.random.default_rng(1))


def fused_map(seed: int = 3) -> np.ndarray:
    world = box_world.street(np.random.default_rng(seed), crossing=True)
    rng = np.random.default_rng(2)
    scans = []
    for x in np.arange(-40.0, 41.0, 10.0):
        T = box_world.sensor_pose(x, 0.0, 1.8, 0.0)
        scans.append(se3.apply(T, box_world.scan(world, "rings32", T, rng, density=0.5)))
    return np.vstack(scans)


@pytest.mark.parametrize("sensor", ["rings16", "rings64", "hemisphere", "raster", "rosette"])
def test_a_sensor_at_the_origin_is_found(sensor: str) -> None:
    cloud = hr.PointCloud.of(street_scan(sensor=sensor))
    assert np.array_equal(cloud.viewpoint, np.zeros(3)), cloud.seen.words


def test_a_sensor_looks_forward_from_outside_its_points() -> None:
    world = box_world.yard(np.random.default_rng(5))
    scan = box_world.scan(
        world, "raster", box_world.sensor_pose(2.0, 0.0, 1.5, 25.0), np.random.default_rng(1)
    )
    far = scan[scan[:, 0] > 8.0]
    assert far[:, 0].min() > 8.0
    assert np.array_equal(hr.PointCloud.of(far).viewpoint, np.zeros(3))


@pytest.mark.parametrize("height", [-0.1, 0.0, 0.1])
def test_an_origin_in_the_ground_is_no_viewpoint(height: float) -> None:
    cloud = hr.PointCloud.of(street_scan() + [0.0, 0.0, 1.8 - height])
    assert cloud.viewpoint is None
    assert "origin" in cloud.seen.words


@pytest.mark.parametrize("origin", [(0.0, 0.0, 0.05), (0.0, 0.0, -2.0)])
def test_the_origin_of_a_map_is_no_viewpoint(origin: tuple[float, float, float]) -> None:
    assert hr.PointCloud.of(fused_map() - origin).viewpoint is None


def test_an_origin_far_away_is_no_viewpoint() -> None:
    cloud = hr.PointCloud.of(street_scan() + [5_000.0, 3_000.0, 0.0])
    assert cloud.viewpoint is None
    assert "far away" in cloud.seen.words


def test_a_scan_of_one_beam_has_its_sensor_in_its_plane() -> None:
    turn = np.linspace(-np.pi, np.pi, 720, endpoint=False)
    # Four walls of a room, 6 x 4 m.
    reach = 1.0 / np.maximum(np.abs(np.cos(turn)) / 3.0, np.abs(np.sin(turn)) / 2.0)
    scan = np.column_stack([reach * np.cos(turn), reach * np.sin(turn), np.zeros_like(turn)])
    assert np.array_equal(hr.PointCloud.of(scan).viewpoint, np.zeros(3))


def test_what_is_said_is_taken() -> None:
    assert np.array_equal(hr.PointCloud.of(P, viewpoint=(1.0, 2.0, 3.0)).viewpoint, [1.0, 2.0, 3.0])
    assert hr.PointCloud.of(P, viewpoint="none").viewpoint is None
    assert hr.PointCloud.of(P, viewpoint=None).viewpoint is None
    places, rows = np.array([[0.0, 0.0, 1.0], [2.0, 0.0, 1.0]]), np.arange(500) % 2
    both = hr.PointCloud.of(P, viewpoint=(places, rows))
    assert np.array_equal(both.viewpoint, places)
    each = hr.PointCloud.of(P, viewpoint=places[rows])
    assert np.array_equal(each.viewpoint, places)
    assert np.array_equal(each.seen.of_point, rows)
    assert isinstance(both.range_image, RangeImages)


def test_a_place_is_given_in_the_coordinates_of_the_points() -> None:
    cloud = hr.PointCloud.of(P + [500_000.0, 0.0, 0.0], viewpoint=(500_001.0, 2.0, 3.0))
    assert np.allclose(cloud.viewpoint, [1.0, 2.0, 3.0])


def test_rows_that_are_dropped_take_their_places_along() -> None:
    holed = P.copy()
    holed[::2] = np.nan
    places, rows = np.array([[0.0, 0.0, 1.0], [2.0, 0.0, 1.0]]), np.arange(500) % 2
    cloud = hr.PointCloud.of(holed, nonfinite="drop", viewpoint=(places, rows))
    assert len(cloud.seen.of_point) == len(cloud) == 250
    assert (cloud.seen.of_point == 1).all()


@pytest.mark.parametrize(
    "bad",
    [
        "somewhere",
        (1.0, 2.0),
        (1.0, np.nan, 2.0),
        np.zeros((4, 3)),
        (np.zeros((2, 3)), np.zeros(7, dtype=int)),
        (np.zeros((2, 3)), np.full(500, 2)),
        object(),
    ],
)
def test_what_is_no_place_is_refused_by_name(bad: object) -> None:
    with pytest.raises(ValueError, match="source: viewpoint must be"):
        hr.PointCloud.of(P, name="source", viewpoint=bad)


def test_several_sensors_look_from_where_each_stood() -> None:
    # Two sensors before a wall on either side; what one looks through, the other does not see.
    left = np.column_stack([np.full(400, 5.0), np.linspace(-2, 2, 400), np.tile(np.linspace(-1, 1, 20), 20)])
    places = np.array([[0.0, 0.0, 0.0], [20.0, 0.0, 0.0]])
    right = left * [-1.0, 1.0, 1.0] + [20.0, 0.0, 0.0]
    points = np.vstack([left, right])
    images = RangeImages.of(points, places, np.repeat([0, 1], 400))
    asked = np.array([[2.5, 0.0, 0.0], [17.5, 0.0, 0.0], [5.0, 0.0, 0.0], [10.0, 0.0, 0.0]])
    assert images.look(asked, margin=0.2).tolist() == [Seen.FREE, Seen.FREE, Seen.SEEN, Seen.HIDDEN]


def pcd(path: Path, viewpoint: str) -> Path:
    head = (
        f"VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 500\nHEIGHT 1\n"
        f"VIEWPOINT {viewpoint}\nPOINTS 500\nDATA binary\n"
    )
    path.write_bytes(head.encode() + P.astype("<f4").tobytes())
    return path


def test_a_pcd_tells_where_its_sensor_stood(tmp_path: Path) -> None:
    cloud = hr.PointCloud.of(pcd(tmp_path / "a.pcd", "50 20 1.8 0.707107 0 0 0.707107"))
    assert np.allclose(cloud.viewpoint, [50.0, 20.0, 1.8])
    assert cloud.seen.words == "as its file says"
    # Writers fill in the origin for want of better: it is put to the test as ever.
    plain = hr.PointCloud.of(pcd(tmp_path / "b.pcd", "0 0 0 1 0 0 0"))
    assert plain.seen.words == hr.PointCloud.of(P.astype(np.float32)).seen.words


@pytest.mark.parametrize("viewpoint", ["1 2", "a b c 1 0 0 0", "nan 0 0 1 0 0 0"])
def test_a_pcd_whose_viewpoint_is_no_place_is_refused(tmp_path: Path, viewpoint: str) -> None:
    with pytest.raises(ValueError, match="VIEWPOINT"):
        hr.PointCloud.of(pcd(tmp_path / "a.pcd", viewpoint))


def test_a_folder_of_pairs_tells_where_its_sensors_stood(tmp_path: Path) -> None:
    for side in ("source", "target"):
        np.save(tmp_path / f"{side}.npy", P)
    meta = {
        "T_target_source": np.eye(4).tolist(),
        "source_viewpoint": [0.0, 0.0, 1.8],
        "target_viewpoint": {"places": [[0, 0, 1], [1, 0, 1]], "of_point": [0, 1] * 250},
    }
    (tmp_path / "meta.json").write_text(json.dumps(meta))
    pair = load_pair(tmp_path).pair
    assert np.array_equal(pair.source.viewpoint, [0.0, 0.0, 1.8])
    assert pair.target.viewpoint.shape == (2, 3)


def test_the_command_line_takes_places() -> None:
    assert options.viewpoint("1,2,-3.5", "--source-viewpoint") == (1.0, 2.0, -3.5)
    assert options.viewpoint("none", "--source-viewpoint") == "none"
    with pytest.raises(ValueError, match=r"--source-viewpoint 1,2: give three numbers"):
        options.viewpoint("1,2", "--source-viewpoint")


def test_the_command_line_refuses_what_is_no_place(tmp_path: Path) -> None:
    np.save(tmp_path / "a.npy", P)
    cloud = str(tmp_path / "a.npy")
    told = CliRunner().invoke(app, ["register", cloud, cloud, "--target-viewpoint", "up"])
    assert told.exit_code == 2
    assert "--target-viewpoint up: give three numbers" in " ".join(told.output.split())


def test_the_result_says_when_a_place_is_not_known() -> None:
    pipe = hr.Pipeline(match="none", estimate="identity", refine="none", voxel=0.5)
    source = street_scan()
    result = pipe.run(hr.Pair.of(source, source, target_viewpoint="none"))
    assert any("target was seen from no known place" in note for note in result.notes)
    assert any("the viewpoint of the target is unknown" in reason for reason in result.reasons)
