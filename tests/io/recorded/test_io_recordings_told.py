# SPDX-License-Identifier: MIT
"""Recordings as other tools leave them: merged, converted, cut off, compressed; and choices that choose nothing."""

from __future__ import annotations

import base64
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from test_io_recorded import HUNDRED, cloud_message, custom_message, livox_store, write_bag
from typer.testing import CliRunner

import hybridreg as hr
from hybridreg.cli.app import app
from hybridreg.cloud import PointCloud
from hybridreg.io import read_points


@pytest.fixture(scope="module")
def typesys() -> Any:
    return pytest.importorskip("rosbags.typesys")


def write_mcap(path: Path, messages: list[bytes], schema: str, encoding: str, profile: str = "") -> Path:
    """Messages 0.1 s apart on /points, as a library of MCAP writes them."""
    writer = pytest.importorskip("mcap.writer").Writer
    with path.open("wb") as file:
        out = writer(file)
        out.start(profile=profile, library="a test")
        channel = out.register_channel("/points", encoding, out.register_schema(schema, "", b""))
        for k, data in enumerate(messages):
            out.add_message(channel, 10**9 + k * 10**8, data, 10**9 + k * 10**8)
        out.finish()
    return path


@pytest.mark.parametrize("ros", [1, 2])
def test_messages_of_ros_in_an_mcap_file_of_no_profile_of_ros_2(
    ros: int, typesys: Any, tmp_path: Path
) -> None:
    store = livox_store(typesys, ros)
    between, encoding, serialize = (
        ("/", "ros1", store.serialize_ros1) if ros == 1 else ("/msg/", "cdr", store.serialize_cdr)
    )
    profile = "ros1" if ros == 1 else ""
    clouds = [cloud_message(store, HUNDRED + k, layout) for k, layout in enumerate(("plain", "big", "rows"))]
    data = [bytes(serialize(each, each.__msgtype__)) for each in clouds]
    path = write_mcap(tmp_path / "a.mcap", data, f"sensor_msgs{between}PointCloud2", encoding, profile)
    for k in range(3):
        np.testing.assert_array_equal(hr.read(path, index=k).points, HUNDRED + k)
    np.testing.assert_array_equal(hr.read(path, at=0.15, topic="/points").points, HUNDRED + 2)
    livox = custom_message(store, HUNDRED)
    data = [bytes(serialize(livox, livox.__msgtype__))]
    path = write_mcap(tmp_path / "b.mcap", data, f"livox_ros_driver{between}CustomMsg", encoding, profile)
    np.testing.assert_array_equal(read_points(path), HUNDRED)
    (tmp_path / "b.mcap").write_bytes(path.read_bytes()[:-20])
    with pytest.raises(ValueError, match="mcap recover"):
        read_points(path)


def test_a_byte_that_changed_is_told_by_the_checksum(typesys: Any, tmp_path: Path) -> None:
    store = livox_store(typesys, 2)
    message = cloud_message(store, HUNDRED)
    mcap = pytest.importorskip("mcap.writer")
    path = tmp_path / "a.mcap"
    with path.open("wb") as file:
        out = mcap.Writer(file, compression=mcap.CompressionType.NONE)
        out.start(profile="", library="a test")
        channel = out.register_channel(
            "/p", "cdr", out.register_schema("sensor_msgs/msg/PointCloud2", "", b"")
        )
        out.add_message(channel, 1, bytes(store.serialize_cdr(message, message.__msgtype__)), 1)
        out.finish()
    np.testing.assert_array_equal(read_points(path), HUNDRED)
    data = bytearray(path.read_bytes())
    place = data.index(HUNDRED[50].astype("<f4").tobytes())
    data[place + 3] ^= 1
    path.write_bytes(data)
    with pytest.raises(ValueError, match="a.mcap: cannot be read as an MCAP file"):
        read_points(path)


def test_a_cloud_of_foxglove_in_json_is_that_in_protobuf(tmp_path: Path) -> None:
    told = {
        "frame_id": "lidar",
        "pose": {
            "position": {"x": 1.0, "y": 2.0, "z": 3.0},
            "orientation": {"x": 0.0, "y": 0.0, "z": 1.0, "w": 0.0},
        },
        "point_stride": 14,
        "fields": [{"name": n, "offset": 2 + 4 * k, "type": 7} for k, n in enumerate("zyx")],
        "data": base64.b64encode(
            b"".join(b"\xff\xff" + row[::-1].astype("<f4").tobytes() for row in HUNDRED)
        ).decode(),
    }
    path = write_mcap(tmp_path / "a.mcap", [json.dumps(told).encode()], "foxglove.PointCloud", "json")
    found = hr.read(path).points
    np.testing.assert_allclose(found, HUNDRED * [-1.0, -1.0, 1.0] + [1.0, 2.0, 3.0], atol=1e-9)
    for wrong, word in (
        ({"data": "no base64!"}, "not base64"),
        ({"point_stride": 13}, "1400 bytes has points of 13"),
    ):
        path = write_mcap(path, [json.dumps({**told, **wrong}).encode()], "foxglove.PointCloud", "json")
        with pytest.raises(ValueError, match=word):
            read_points(path)
    bare = {key: value for key, value in told.items() if key != "pose"}
    path = write_mcap(path, [json.dumps(bare).encode()], "foxglove.PointCloud", "json")
    np.testing.assert_array_equal(read_points(path), HUNDRED)
    for text in (b"no json", b"[]", b'{"fields": [3]}', b'{"pose": {"position": {"x": "far"}}}'):
        path = write_mcap(path, [text], "foxglove.PointCloud", "json")
        with pytest.raises(ValueError, match="cannot be read as an MCAP file"):
            read_points(path)


@pytest.mark.parametrize("mode", ["FILE", "MESSAGE"])
def test_a_compressed_bag_is_read_as_its_folder(mode: str, typesys: Any, tmp_path: Path) -> None:
    rosbag2 = pytest.importorskip("rosbags.rosbag2")
    store = livox_store(typesys, 2)
    writer = rosbag2.Writer(tmp_path / "a", version=9)
    writer.set_compression(rosbag2.CompressionMode[mode], rosbag2.CompressionFormat.ZSTD)
    message = cloud_message(store, HUNDRED)
    with writer:
        connection = writer.add_connection("/points", message.__msgtype__, typestore=store)
        writer.write(connection, 10**9, store.serialize_cdr(message, message.__msgtype__))
    np.testing.assert_array_equal(read_points(tmp_path / "a"), HUNDRED)
    data, tells = (next(each for each in (tmp_path / "a").iterdir() if (each.suffix == ".yaml") == is_yaml)
                   for is_yaml in (False, True))  # fmt: skip
    for path in (data, tells):
        with pytest.raises(ValueError, match="give the folder"):
            hr.read(path, **({} if path == data else {"index": 0}))


def test_what_is_wrong_with_a_bag_is_told_with_a_cure(typesys: Any, tmp_path: Path) -> None:
    store = livox_store(typesys, 1)
    path = write_bag(tmp_path / "a.bag", "ros1", {"/p": [cloud_message(store, HUNDRED)] * 3}, store)
    whole = path.read_bytes()
    for name, data, word in (
        ("A.BAG", whole, r"rename it to end in \.bag"),
        ("b.bag", whole[: len(whole) // 2], "rosbag reindex"),
        ("c.bag.active", whole, "rosbag reindex"),
        ("d.osf", whole, "no reader for '.osf'; save one frame with `ouster-cli"),
    ):
        (tmp_path / name).write_bytes(data)
        with pytest.raises(ValueError, match=word):
            read_points(tmp_path / name)
    second = livox_store(typesys, 2)
    empty, full = cloud_message(second, HUNDRED[:0]), cloud_message(second, HUNDRED)
    write_bag(tmp_path / "d", "sqlite", {"/p": [empty, full]}, second)
    with pytest.raises(ValueError, match="is empty; choose another index"):
        read_points(tmp_path / "d")
    np.testing.assert_array_equal(hr.read(tmp_path / "d", index=1).points, HUNDRED)
    for command, cure in (
        ("register", "choose another --index"),
        ("together", "`hybridreg register --index`"),
    ):
        out = ["--out", str(tmp_path / "out")]
        done = CliRunner().invoke(app, [command, str(tmp_path / "d"), str(path), *out])
        assert done.exit_code == 2, done.output
        assert cure in done.stderr
    (tmp_path / "d").rename(tmp_path / "d.bag")
    with pytest.raises(ValueError, match="the folder of a ROS 2 bag; rename it"):
        read_points(tmp_path / "d.bag")


@pytest.mark.parametrize("at", [np.float32(0.25), np.int64(1), 0])
def test_seconds_are_numbers_of_any_kind(at: Any) -> None:
    from hybridreg.io.recorded.recording import Selection

    assert Selection(at=at).at == at
    with pytest.raises(ValueError, match="at=True"):
        Selection(at=True)


def test_a_choice_that_chooses_nothing_is_refused(tmp_path: Path) -> None:
    pye57 = pytest.importorskip("pye57")
    path, flat = str(tmp_path / "a.e57"), str(tmp_path / "a.npy")
    np.save(flat, HUNDRED)
    file = pye57.E57(path, mode="w")
    for k in range(3):
        axes = dict(zip(("cartesianX", "cartesianY", "cartesianZ"), (HUNDRED + k).T.copy(), strict=True))
        file.write_scan_raw(axes, rotation=np.array([1.0, 0.0, 0.0, 0.0]), translation=np.zeros(3))
    file.close()
    assert len(hr.read(path).points) == 300
    np.testing.assert_array_equal(hr.read(path, accumulate=2).points, np.vstack([HUNDRED, HUNDRED + 1]))
    for where, wrong, word in (
        (path, {"topic": "/p"}, "topic='/p' chooses nothing there"),
        (path, {"at": 1.0}, "at=1.0 chooses nothing there"),
        (path, {"accumulate": 4}, "holds 3 scans"),
        (flat, {"index": 0}, "holds one cloud; index=0"),
    ):
        with pytest.raises(ValueError, match=word):
            hr.read(where, **wrong)  # type: ignore[arg-type]
    for command in ("register", "view"):
        for options, word in (
            (("--topic", "/p"), "--topic /p: chooses nothing in"),
            (("--index", "x"), "--index x: give one whole number"),
            (("--accumulate", "9"), "holds 3 scans"),
            (("--accumulate", "0"), "--accumulate 0 must be"),
            (("--index", "-9"), "choose from 0 to 2"),
        ):
            done = CliRunner().invoke(app, [command, path, flat, *options])
            assert done.exit_code == 2, done.output
            assert word in done.stderr


def scan_message(store: Any, ranges: list[float]) -> Any:
    """A LaserScan of a beam every 90 degrees, from behind on."""
    return store.types["sensor_msgs/msg/LaserScan"](
        header=cloud_message(store, HUNDRED).header, angle_min=-np.pi, angle_max=np.pi, angle_increment=np.pi / 2,
        time_increment=0.0, scan_time=0.1, range_min=0.5, range_max=30.0, ranges=np.array(ranges, np.float32),
        intensities=np.zeros(0, np.float32),
    )  # fmt: skip


@pytest.mark.parametrize("kind", ["ros1", "sqlite", "mcap"])
def test_scans_of_2d_scanners_are_read_where_they_are_asked_for_or_alone(
    kind: str, typesys: Any, tmp_path: Path
) -> None:
    store = livox_store(typesys, 1 if kind == "ros1" else 2)
    scan = scan_message(store, [4.0, 3.0, 2.0, 1.0, 0.4, 31.0, np.inf, np.nan] * 10)
    want = [[-4.0, 0.0, 0.0], [0.0, -3.0, 0.0], [2.0, 0.0, 0.0], [0.0, 1.0, 0.0]] * 10
    ending = ".bag" if kind == "ros1" else ""
    path = write_bag(tmp_path / f"alone{ending}", kind, {"/scan": [scan]}, store)
    np.testing.assert_allclose(hr.read(path).points, want, atol=1e-4)
    np.testing.assert_allclose(PointCloud.of(scan).points, want, atol=1e-4)
    topics = {"/scan": [scan], "/points": [cloud_message(store, HUNDRED)]}
    path = write_bag(tmp_path / f"both{ending}", kind, topics, store)
    np.testing.assert_array_equal(hr.read(path).points, HUNDRED)
    np.testing.assert_allclose(hr.read(path, topic="/scan").points, want, atol=1e-4)


def test_scans_and_clouds_of_the_older_kind(typesys: Any, tmp_path: Path) -> None:
    store = livox_store(typesys, 2)
    told = {"angle_min": 0.0, "angle_increment": np.pi / 2, "range_min": 0.0, "range_max": 0.0}
    found = PointCloud.of({**told, "ranges": [1.0, 2.0, None, 3.0] * 10}).points
    np.testing.assert_allclose(found[:3], [[1.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, -3.0, 0.0]], atol=1e-9)
    for wrong, word in (([[1.0, 2.0]], r"have the shape \(1, 2\)"), ([object()], "give the first echo")):
        with pytest.raises(ValueError, match=word):
            PointCloud.of({**told, "ranges": wrong})
    point = store.types["geometry_msgs/msg/Point32"]
    older = store.types["sensor_msgs/msg/PointCloud"](
        header=cloud_message(store, HUNDRED).header, points=[point(x=x, y=y, z=z) for x, y, z in HUNDRED], channels=[]
    )  # fmt: skip
    path = write_bag(tmp_path / "a", "sqlite", {"/cloud": [older]}, store)
    np.testing.assert_array_equal(read_points(path), HUNDRED)
    np.testing.assert_array_equal(PointCloud.of(older).points, HUNDRED)


def test_a_message_in_hand_is_the_one_in_a_bag(typesys: Any, tmp_path: Path) -> None:
    store = livox_store(typesys, 2)
    holed = np.where(np.arange(100)[:, None] % 3 == 0, np.nan, HUNDRED)
    holed[1::5] = 0.0
    message = cloud_message(store, holed)
    path = write_bag(tmp_path / "a", "sqlite", {"/points": [message]}, store)
    left = holed[np.isfinite(holed).all(axis=1) & holed.any(axis=1)]
    np.testing.assert_array_equal(PointCloud.of(message).points, left)
    np.testing.assert_array_equal(hr.read(path).points, left)
    with pytest.raises(ValueError, match="is a .*PointCloud2, no path of a file; give it to register"):
        hr.read(message)
