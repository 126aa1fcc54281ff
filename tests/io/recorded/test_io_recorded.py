# SPDX-License-Identifier: MIT
"""Files of devices, recorders and design tools, written by the packages that others write them with."""

from __future__ import annotations

import json
import struct
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import hybridreg as hr
from hybridreg.geometry import se3
from hybridreg.io import read_points, read_recorded
from hybridreg.io.recorded import livox_message
from hybridreg.io.recorded.recording import ANY, Selection

HUNDRED = np.random.default_rng(3).integers(-4000, 4000, (100, 3)) / 64.0


# --- bags


def cloud_message(store: Any, points: np.ndarray, layout: str = "plain") -> Any:
    """A PointCloud2 of points (N, 3), its fields in another order, padded, or big-endian."""
    fields = store.types["sensor_msgs/msg/PointField"]
    header = store.types["std_msgs/msg/Header"](**header_of(store))
    order = ">" if layout == "big" else "<"
    offsets = {"x": 16, "y": 4, "z": 8} if layout == "shuffled" else {"x": 0, "y": 4, "z": 8}
    step, rows = 24, 4 if layout == "rows" else 1
    record: Any = {
        "names": list(offsets),
        "formats": [f"{order}f4"] * 3,
        "offsets": list(offsets.values()),
        "itemsize": step,
    }
    data = np.zeros(len(points), np.dtype(record))
    data["x"], data["y"], data["z"] = points.T
    width = len(points) // rows
    raw = b"".join(data[k * width : (k + 1) * width].tobytes() + bytes(7 * (rows > 1)) for k in range(rows))
    return store.types["sensor_msgs/msg/PointCloud2"](
        header=header, height=rows, width=width, is_bigendian=layout == "big", point_step=step,
        fields=[fields(name=n, offset=o, datatype=7, count=1) for n, o in offsets.items()],
        row_step=width * step + 7 * (rows > 1), data=np.frombuffer(raw, np.uint8), is_dense=False,
    )  # fmt: skip


def header_of(store: Any) -> dict[str, Any]:
    stamp = store.types["builtin_interfaces/msg/Time"](sec=1, nanosec=0)
    extra = {"seq": 0} if "seq" in store.types["std_msgs/msg/Header"].__dataclass_fields__ else {}
    return {"stamp": stamp, "frame_id": "lidar", **extra}


LIVOX = """std_msgs/Header header
uint64 timebase
uint32 point_num
uint8 lidar_id
uint8[3] rsvd
CustomPoint[] points
================================================================================
MSG: livox_ros_driver/CustomPoint
uint32 offset_time
float32 x
float32 y
float32 z
uint8 reflectivity
uint8 tag
uint8 line
"""


def livox_store(typesys: Any, ros: int) -> Any:
    store = typesys.get_typestore(typesys.Stores.ROS1_NOETIC if ros == 1 else typesys.Stores.ROS2_HUMBLE)
    store.register(typesys.get_types_from_msg(LIVOX, "livox_ros_driver/msg/CustomMsg"))
    return store


def custom_message(store: Any, points: np.ndarray) -> Any:
    point = store.types["livox_ros_driver/msg/CustomPoint"]
    return store.types["livox_ros_driver/msg/CustomMsg"](
        header=store.types["std_msgs/msg/Header"](**header_of(store)), timebase=7, point_num=len(points), lidar_id=1,
        rsvd=np.zeros(3, np.uint8),
        points=[
            point(offset_time=k, x=x, y=y, z=z, reflectivity=9, tag=1, line=2) for k, (x, y, z) in enumerate(points)
        ],
    )  # fmt: skip


def write_bag(path: Path, kind: str, topics: dict[str, list[Any]], store: Any) -> Path:
    """A bag of messages 0.1 s apart; for SQLite and MCAP the path of the storage file."""
    if kind == "ros1":
        writer = pytest.importorskip("rosbags.rosbag1").Writer(path)
    else:
        rosbag2 = pytest.importorskip("rosbags.rosbag2")
        plugin = rosbag2.StoragePlugin.MCAP if kind == "mcap" else rosbag2.StoragePlugin.SQLITE3
        writer = rosbag2.Writer(path, version=9, storage_plugin=plugin)
    with writer:
        for topic, messages in topics.items():
            connection = writer.add_connection(topic, messages[0].__msgtype__, typestore=store)
            for k, message in enumerate(messages):
                serialize = store.serialize_ros1 if kind == "ros1" else store.serialize_cdr
                writer.write(connection, 10**9 + k * 10**8, serialize(message, message.__msgtype__))
    return (
        path if kind == "ros1" else next(each for each in path.iterdir() if each.suffix in (".db3", ".mcap"))
    )


@pytest.fixture(scope="module")
def typesys() -> Any:
    return pytest.importorskip("rosbags.typesys")


@pytest.mark.parametrize("kind", ["ros1", "sqlite", "mcap"])
def test_bags_of_every_kind(kind: str, typesys: Any, tmp_path: Path) -> None:
    store = livox_store(typesys, 1 if kind == "ros1" else 2)
    layouts = ["plain", "shuffled", "big", "rows"]
    topics = {
        "/points": [cloud_message(store, HUNDRED + k, layout) for k, layout in enumerate(layouts)],
        "/livox/lidar": [custom_message(store, HUNDRED - 1.0)],
    }
    path = write_bag(tmp_path / ("a.bag" if kind == "ros1" else "a"), kind, topics, store)
    for k in range(4):
        found = read_recorded(path, Selection(topic="/points", index=k))
        np.testing.assert_array_equal(found.points, HUNDRED + k, err_msg=layouts[k])
    np.testing.assert_array_equal(hr.read(path, topic="/livox/lidar").points, HUNDRED - 1.0)
    np.testing.assert_array_equal(hr.read(path, topic="/points", index=-1).points, HUNDRED + 3)
    np.testing.assert_array_equal(hr.read(path, topic="/points", at=0.15).points, HUNDRED + 2)
    two = hr.read(path, topic="/points", index=1, accumulate=2).points
    np.testing.assert_array_equal(two, np.vstack([HUNDRED + 1, HUNDRED + 2]))
    if kind != "ros1":  # the folder of a bag is one too
        np.testing.assert_array_equal(hr.read(path.parent, topic="/points").points, HUNDRED)
    for wrong, word in (
        ({}, r"clouds of 2 topics: /livox/lidar \(1\), /points \(4\)"),
        ({"topic": "/scan"}, r"no clouds of the topic '/scan'; it has /livox/lidar \(1\), /points \(4\)"),
        (
            {"topic": "/points", "index": 4},
            "holds 4 clouds of this topic, index 4 was asked for; choose from 0 to 3",
        ),
        ({"topic": "/points", "index": 2, "accumulate": 3}, "index 2 and 2 after it"),
        (
            {"topic": "/points", "at": 9.0},
            r"holds 0 clouds of this topic from 9 s on, 1 were .*it lasts 0\.3 s",
        ),
    ):
        with pytest.raises(ValueError, match=word):
            hr.read(path, **wrong)  # type: ignore[arg-type]


def test_missing_returns_of_a_driver_are_left_out_and_counted(typesys: Any, tmp_path: Path) -> None:
    store = livox_store(typesys, 1)
    holed = np.vstack([HUNDRED, np.full((40, 3), np.nan), np.zeros((60, 3))])
    path = write_bag(tmp_path / "a.bag", "ros1", {"/points": [cloud_message(store, holed)]}, store)
    cloud = hr.read(path)
    np.testing.assert_array_equal(cloud.points, HUNDRED)
    assert cloud.dropped == 100


def test_a_bag_without_clouds_says_what_it_holds(typesys: Any, tmp_path: Path) -> None:
    store = livox_store(typesys, 1)
    text = store.types["std_msgs/msg/String"](data="hello")
    with pytest.raises(ValueError, match="holds no clouds, but std_msgs/msg/String"):
        hr.read(write_bag(tmp_path / "a.bag", "ros1", {"/chat": [text]}, store))


@pytest.mark.parametrize("cdr", [False, True])
@pytest.mark.parametrize("frame", ["", "livox_frame", "abc"])
def test_livox_messages_of_any_frame_name(typesys: Any, cdr: bool, frame: str) -> None:
    store = livox_store(typesys, 2 if cdr else 1)
    message = custom_message(store, HUNDRED)
    message.header.frame_id = frame
    serialize = store.serialize_cdr if cdr else store.serialize_ros1
    raw = bytes(serialize(message, message.__msgtype__))
    np.testing.assert_array_equal(livox_message.points(raw, cdr=cdr, name="m"), HUNDRED)
    for cut in (3, 20, len(raw) - 40):
        with pytest.raises(ValueError, match="Livox message"):
            livox_message.points(raw[:cut], cdr=cdr, name="m")


# --- E57


@pytest.fixture
def stations(tmp_path: Path) -> tuple[Path, list[np.ndarray], list[np.ndarray]]:
    """An E57 file of two scans by pye57, their points in its frame, and the scanners' poses."""
    pye57 = pytest.importorskip("pye57")
    path = tmp_path / "site.e57"
    poses = [
        se3.from_rt(
            se3.rotation_about(np.array([0.1, 0.2, k + 0.5])), np.array([500_000.0 + 9 * k, 20.0, 3.0])
        )
        for k in range(2)
    ]
    file = pye57.E57(str(path), mode="w")
    for k, T in enumerate(poses):
        q = se3_quaternion(T)
        x, y, z = (HUNDRED + k).T
        data = {"cartesianX": x, "cartesianY": y, "cartesianZ": z}
        if k == 1:  # of the second scan ten points have no range
            data["cartesianInvalidState"] = (np.arange(100) < 10).astype(np.int8)
        file.write_scan_raw(data, rotation=q, translation=T[:3, 3])
    file.close()
    return path, [se3.apply(poses[0], HUNDRED), se3.apply(poses[1], HUNDRED + 1)[10:]], poses


def se3_quaternion(T: np.ndarray) -> np.ndarray:
    from scipy.spatial.transform import Rotation

    x, y, z, w = Rotation.from_matrix(T[:3, :3]).as_quat()
    return np.array([w, x, y, z])


def test_e57_scans_lie_at_their_poses_and_tell_their_places(stations: Any) -> None:
    path, wanted, poses = stations
    recorded = read_recorded(path)
    np.testing.assert_allclose(recorded.points, np.vstack(wanted), atol=1e-5)
    np.testing.assert_allclose(recorded.places, [T[:3, 3] for T in poses])
    assert np.bincount(recorded.of_point).tolist() == [100, 90]
    cloud = hr.read(path)
    assert cloud.seen.words == "as its file says"
    np.testing.assert_allclose(cloud.seen.places + cloud.offset, [T[:3, 3] for T in poses])
    one = hr.read(path, index=1)
    np.testing.assert_allclose(one.points + one.offset, wanted[1], atol=1e-5)
    np.testing.assert_allclose(one.viewpoint + one.offset, poses[1][:3, 3])
    assert hr.read(path, viewpoint="none").viewpoint is None
    with pytest.raises(ValueError, match="holds 2 scans, index 2 was asked for; choose from 0 to 1"):
        hr.read(path, index=2)


# --- tables, meshes


@pytest.mark.parametrize("ending", ["feather", "arrow", "parquet"])
def test_tables_of_arrow(ending: str, tmp_path: Path) -> None:
    pa = pytest.importorskip("pyarrow")
    table = pa.table(
        {"intensity": np.zeros(100), **dict(zip("xyz", HUNDRED.astype(np.float16).T, strict=True))}
    )
    path = tmp_path / f"sweep.{ending}"
    if ending == "parquet":
        pytest.importorskip("pyarrow.parquet").write_table(
            pa.table({a: HUNDRED[:, k] for k, a in enumerate("xyz")}), path
        )
    else:
        pytest.importorskip("pyarrow.feather").write_feather(table, path)
    np.testing.assert_allclose(read_points(path), HUNDRED, atol=0.0 if ending == "parquet" else 0.02)
    with pytest.raises(ValueError, match="holds one cloud"):
        hr.read(path, index=0)


def test_a_parquet_table_with_names_of_surveyors(tmp_path: Path) -> None:
    pa, parquet = pytest.importorskip("pyarrow"), pytest.importorskip("pyarrow.parquet")
    names = ("Northing", "Easting", "Code", "Elevation")
    columns = (HUNDRED[:, 1], HUNDRED[:, 0], np.zeros(100), HUNDRED[:, 2])
    parquet.write_table(pa.table(dict(zip(names, columns, strict=True))), tmp_path / "a.parquet")
    np.testing.assert_array_equal(read_points(tmp_path / "a.parquet"), HUNDRED)


@pytest.mark.parametrize("ending", ["obj", "stl", "off", "glb"])
def test_a_mesh_becomes_points_of_its_surface(ending: str, tmp_path: Path) -> None:
    trimesh = pytest.importorskip("trimesh")
    box = trimesh.creation.box(extents=(4.0, 3.0, 2.0))
    box.export(tmp_path / f"box.{ending}")
    cloud = hr.read(tmp_path / f"box.{ending}")
    assert np.allclose(np.abs(cloud.points / [2.0, 1.5, 1.0]).max(axis=1), 1.0)
    up = np.isclose(cloud.points[:, 2], 1.0)
    assert up.mean() == pytest.approx(12.0 / 52.0, abs=0.01)
    assert cloud.viewpoint is None
    assert "no sensor saw" in cloud.seen.words
    np.testing.assert_array_equal(cloud.points, hr.read(tmp_path / f"box.{ending}").points)


@pytest.mark.parametrize("ending", ["glb", "obj"])
def test_points_without_faces_are_taken_as_they_are(ending: str, tmp_path: Path) -> None:
    trimesh = pytest.importorskip("trimesh")
    if ending == "glb":
        trimesh.Scene(trimesh.PointCloud(HUNDRED)).export(tmp_path / "a.glb")
    else:
        (tmp_path / "a.obj").write_text("".join(f"v {x!r} {y!r} {z!r}\n" for x, y, z in HUNDRED.tolist()))
    np.testing.assert_allclose(read_points(tmp_path / f"a.{ending}"), HUNDRED, atol=1e-5)


def gltf(tmp_path: Path, kind: str, *, ending: str = "glb") -> Path:
    """A hundred points, by hand after glTF 2.0: as floats, as whole numbers under a scale, in two parts, or
    said to be compressed."""
    exact = HUNDRED.astype("<f4")
    body, scale, extra = exact.tobytes(), 1.0, {}
    views = [{"buffer": 0, "byteOffset": 0, "byteLength": len(body)}]
    accessor: dict[str, Any] = {"bufferView": 0, "componentType": 5126, "count": 100, "type": "VEC3"}
    if kind in ("whole", "normalized"):
        most = float(np.abs(HUNDRED).max())
        whole = np.zeros((100, 4), "<i2")  # rows begin at multiples of four bytes
        whole[:, :3] = np.round(HUNDRED / most * 32767)
        body, scale = whole.tobytes(), most / (32767 if kind == "whole" else 1)
        views = [{"buffer": 0, "byteOffset": 0, "byteLength": len(body), "byteStride": 8}]
        accessor |= {"componentType": 5122} | ({"normalized": True} if kind == "normalized" else {})
        extra = {"extensionsRequired": ["KHR_mesh_quantization"]}
    if kind == "sparse":
        part = b"".join(np.uint16(k).tobytes() for k in range(50))
        views = [{"buffer": 0, "byteOffset": k, "byteLength": n} for k, n in ((0, 100), (100, 600))]
        body = part + exact[:50].tobytes()
        where = {"bufferView": 0, "componentType": 5123}
        accessor["sparse"] = {"count": 50, "indices": where, "values": {"bufferView": 1}}
        del accessor["bufferView"]
    if kind.startswith(("EXT", "KHR")):
        extra = {"extensionsRequired": [kind], "extensionsUsed": [kind]}
    document = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, "scale": [scale] * 3}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "mode": 0}]}],
        "accessors": [accessor],
        "bufferViews": views,
        "buffers": [{"byteLength": len(body)}],
        **extra,
    }
    path = tmp_path / f"a.{ending}"
    if ending == "gltf":
        (tmp_path / "a.data").write_bytes(body)
        document["buffers"][0]["uri"] = "a.data"
        path.write_text(json.dumps(document))
        return path
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    head = struct.pack("<4s2I", b"glTF", 2, 28 + len(text) + len(body)) + struct.pack(
        "<I4s", len(text), b"JSON"
    )
    path.write_bytes(head + text + struct.pack("<I4s", len(body), b"BIN\0") + body)
    return path


@pytest.mark.parametrize("ending", ["glb", "gltf"])
def test_positions_of_gltf_that_trimesh_gives_as_other_numbers_are_refused(
    ending: str, tmp_path: Path
) -> None:
    # trimesh 5.2.0 leaves out `normalized` and `sparse` of an accessor: clouds came out 32767 times too large, or with
    # points at the origin.
    pytest.importorskip("trimesh")
    for kind, atol in (("floats", 1e-5), ("whole", 2e-3)):
        points = read_points(gltf(tmp_path, kind, ending=ending))
        np.testing.assert_allclose(points, HUNDRED, atol=atol)
    for kind, cure in (
        ("normalized", "without quantization"),
        ("sparse", "all in one place"),
        ("EXT_meshopt_compression", "without compression"),
        ("EXT_mesh_gpu_instancing", "without instances"),  # of which it gives one
    ):
        with pytest.raises(ValueError, match=rf"a\.{ending}: .*{cure}"):
            read_points(gltf(tmp_path, kind, ending=ending))


def test_points_that_no_surface_holds_are_not_left_out_in_silence(tmp_path: Path) -> None:
    # Of a scan with a marker of axes beside it the marker alone was read.
    trimesh = pytest.importorskip("trimesh")
    trimesh.Scene([trimesh.PointCloud(HUNDRED), trimesh.creation.box()]).export(tmp_path / "a.glb")
    rows = "".join(f"{x!r} {y!r} {z!r}\n" for x, y, z in HUNDRED.tolist())
    vertices = "".join(f"v {row}\n" for row in rows.splitlines())
    (tmp_path / "a.obj").write_text(vertices + "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 101 102 103\n")
    (tmp_path / "a.off").write_text(f"OFF\n100 1 0\n{rows}3 0 1 2\n")
    for ending, loose in (("glb", 100), ("obj", 100), ("off", 97)):
        with pytest.raises(ValueError, match=f"surfaces and {loose} points that belong to none; export only"):
            read_points(tmp_path / f"a.{ending}")


def test_draco_needs_its_decoder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("trimesh")
    monkeypatch.setattr("hybridreg.io.recorded.gltf_positions.find_spec", lambda name: None)
    with pytest.raises(ValueError, match="pip install DracoPy"):
        read_points(gltf(tmp_path, "KHR_draco_mesh_compression"))


# --- Livox Viewer, HeLiPR


def lvx2(kind: int = 1, frames: int = 2) -> bytes:
    """A file of two devices, the second turned by 90 degrees about z and put 2 m up; written from the description."""
    head = b"livox_tech".ljust(16, b"\0") + bytes([2, 0, 0, 0]) + struct.pack("<IIB", 0xAC0EA767, 50, 2)
    for lidar, yaw, z in ((11, 0.0, 0.0), (12, 90.0, 2.0)):
        head += bytes(32) + struct.pack("<IBBB6f", lidar, 0, 9, 1, 0.0, 0.0, yaw, 0.0, 0.0, z)
    body = b""
    for k in range(frames):
        place = len(head) + len(body)
        packages = b""
        for lidar in (11, 12):
            unit, code, tail = (0.001, "<3i", 2) if kind == 1 else (0.01, "<3h", 2)
            rows = b"".join(
                struct.pack(code, *np.round((p + k) / unit).astype(int).tolist()) + bytes(tail)
                for p in HUNDRED
            )
            packages += (
                struct.pack("<BIBBQHBIB", 0, lidar, 0, 0, 0, 0, kind, len(rows), 0).ljust(27, b"\0") + rows
            )
        end = place + 24 + len(packages) if k + 1 < frames else 0
        body += struct.pack("<QQQ", place, end, k) + packages
    return head + body


@pytest.mark.parametrize("kind, off", [(1, 0.0006), (2, 0.006)])
def test_lvx2(tmp_path: Path, kind: int, off: float) -> None:
    path = tmp_path / "a.lvx2"
    path.write_bytes(lvx2(kind))
    cloud = hr.read(path)
    turned = HUNDRED @ np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]).T + [0.0, 0.0, 2.0]
    np.testing.assert_allclose(cloud.points, np.vstack([HUNDRED, turned]), atol=off)
    np.testing.assert_allclose(cloud.seen.places, [[0.0, 0.0, 0.0], [0.0, 0.0, 2.0]])
    assert len(hr.read(path, index=0, accumulate=2)) == 400
    np.testing.assert_allclose(hr.read(path, index=1).points[:100], HUNDRED + 1, atol=off)
    with pytest.raises(ValueError, match="holds 2 frames, index 5"):
        hr.read(path, index=5)


@pytest.mark.parametrize("length", [8, 20, 40, 150, 200, 300, 1500, -1])
def test_damaged_lvx2_is_refused_by_name(tmp_path: Path, length: int) -> None:
    path = tmp_path / "a.lvx2"
    data = lvx2()
    path.write_bytes(data[:length] if length > 0 else data[:24] + b"\xff" * 300 + data[324:])
    with pytest.raises(ValueError, match="a.lvx2: "):
        hr.read(path)


@pytest.mark.parametrize("sensor, stamp, rest", [
    ("Ouster", 10**18, 14), ("Velodyne", 10**18, 10), ("Avia", 10**18, 7), ("Aeva", 10**18, 13),
    ("Aeva", 17 * 10**17, 17),
])  # fmt: skip
def test_helipr_by_name(tmp_path: Path, sensor: str, stamp: int, rest: int) -> None:
    path = tmp_path / "LiDAR" / sensor / f"{stamp}.bin"
    path.parent.mkdir(parents=True)
    rows = [p.astype("<f4").tobytes() + bytes(range(1, rest + 1)) for p in HUNDRED]
    path.write_bytes(b"".join(rows))
    np.testing.assert_array_equal(read_points(path), HUNDRED)
    path.write_bytes(b"".join(rows)[:-3])
    with pytest.raises(ValueError, match=f"no multiple of {rest + 12}, a point of HeLiPR's {sensor}"):
        read_points(path)


# --- what is not what it says, what is not installed, what cannot be chosen


def test_e57_without_its_pages_is_told_so(stations: Any) -> None:
    # As whitebox-workflows 2.0.6 writes them, without checksums: no copy of such a file can be opened.
    path = stations[0]
    whole = path.read_bytes()
    assert len(whole) % 1024 == 0
    bare = b"".join(whole[k : k + 1020] for k in range(0, len(whole), 1024))[:-7]
    for data in (bare, whole[:-500]):
        path.write_bytes(data)
        with pytest.raises(
            ValueError, match=rf"this file {len(data)} bytes.*export it as LAS or PLY instead"
        ):
            read_points(path)
    path.write_bytes(whole[:2000] + b"?" + whole[2001:])  # pages there, damaged
    with pytest.raises(ValueError, match="copy, download or export it again$"):
        read_points(path)


@pytest.mark.parametrize("ending", ["e57", "bag", "db3", "mcap", "parquet", "feather", "glb", "lvx2"])
def test_other_content_never_reaches_other_peoples_readers(tmp_path: Path, ending: str) -> None:
    path = tmp_path / f"a.{ending}"
    for data, word in (
        (b"", "0 bytes"),
        (b"nothing of the kind", "does not begin as"),
        (b"ply\nformat", "PLY file"),
    ):
        path.write_bytes(data)
        with pytest.raises(ValueError, match=word):
            read_points(path)


@pytest.mark.parametrize("name, extra", [
    ("a.bag", "ros"), ("a.e57", "e57"), ("a.parquet", "arrow"), ("a.feather", "arrow"), ("a.stl", "mesh"),
    ("a.glb", "mesh"),
])  # fmt: skip
def test_what_is_not_installed_says_which_extra(
    tmp_path: Path, name: str, extra: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    import sys

    for module in (
        "rosbags",
        "rosbags.highlevel",
        "pye57",
        "pyarrow",
        "pyarrow.parquet",
        "pyarrow.feather",
        "trimesh",
    ):
        monkeypatch.setitem(sys.modules, module, None)
    start = {
        "bag": b"#ROSBAG V2.0\n",
        "e57": b"ASTM-E57",
        "parquet": b"PAR1",
        "feather": b"ARROW1",
        "glb": b"glTF",
        "stl": b"solid",
    }
    (tmp_path / name).write_bytes(start[name.partition(".")[2]])
    with pytest.raises(ImportError, match=rf"hybridreg\[{extra}\]"):
        read_points(tmp_path / name)


@pytest.mark.parametrize("wrong", [
    {"index": 1, "at": 2.0}, {"index": 1.5}, {"index": True}, {"at": -1.0}, {"at": np.nan}, {"accumulate": 0},
    {"accumulate": 1.5},
])  # fmt: skip
def test_no_choice(wrong: dict[str, Any]) -> None:
    with pytest.raises(ValueError, match=next(iter(wrong))):
        Selection(**wrong)


def test_the_command_line_chooses_for_both_or_each(
    monkeypatch: pytest.MonkeyPatch, typesys: Any, tmp_path: Path
) -> None:
    from typer.testing import CliRunner

    from hybridreg.cli.app import app
    from hybridreg.testing import sample_pair

    store = livox_store(typesys, 1)
    pair, T = sample_pair()
    clouds = {
        "/fan": [cloud_message(store, pair.source.points)] * 2,
        "/rings": [cloud_message(store, pair.target.points)] * 2,
    }
    path = str(write_bag(tmp_path / "run.bag", "ros1", clouds, store))
    done = CliRunner().invoke(app, ["register", path, path, "--topic", "/fan,/rings", "--index", "1,0"])
    assert done.exit_code == 0, done.output
    found = np.array([[float(x) for x in line.split()] for line in done.stdout.splitlines()[1:5]])
    np.testing.assert_allclose(found, T, atol=0.1)
    done = CliRunner().invoke(app, ["register", path, path])
    assert done.exit_code == 2
    assert "--topic" in done.stderr
    done = CliRunner().invoke(app, ["register", path, path, "--topic", "/fan", "--index", "1,2,3"])
    assert done.exit_code == 2
    assert "--index 1,2,3" in done.stderr


def test_compressed_pcd_is_the_same_with_and_without_its_wheel(monkeypatch: pytest.MonkeyPatch) -> None:
    imagecodecs = pytest.importorskip("imagecodecs")
    from hybridreg.io.formats import lzf

    data = np.repeat(HUNDRED.astype("<f4"), 3).tobytes() * 4
    packed = bytes(imagecodecs.lzf_encode(data))
    called = SimpleNamespace(n=0)

    def counted(*args: Any, **kwargs: Any) -> Any:
        called.n += 1
        return decode(*args, **kwargs)

    decode = imagecodecs.lzf_decode
    monkeypatch.setattr(imagecodecs, "lzf_decode", counted)
    assert lzf.lzf_decompress(packed, len(data)) == data
    assert called.n == 1
    for size, part in ((len(data) - 1, packed), (len(data) + 1, packed), (len(data), packed[:-5])):
        with pytest.raises(ValueError, match="bytes"):
            lzf.lzf_decompress(part, size)
    monkeypatch.setattr(lzf, "_by_imagecodecs", lambda *_: (_ for _ in ()).throw(ImportError()))
    assert lzf.lzf_decompress(packed, len(data)) == data


def write_foxglove(path: Path, clouds: list[np.ndarray], poses: list[np.ndarray], kind: str = "f4") -> Path:
    """An MCAP file as Foxglove's own tools write it: clouds 0.1 s apart on /lidar, and a log on /log."""
    writer = pytest.importorskip("mcap_protobuf.writer").Writer
    schemas = pytest.importorskip("foxglove_schemas_protobuf")
    import importlib

    of = {
        name: getattr(importlib.import_module(f"{schemas.__name__}.{name}_pb2"), name)
        for name in ("PointCloud", "Log")
    }
    code = {"i2": 4, "f4": 7, "f8": 8}[kind]
    size = np.dtype(kind).itemsize
    with path.open("wb") as file, writer(file) as out:
        for k, (cloud, T) in enumerate(zip(clouds, poses, strict=True)):
            message = of["PointCloud"](frame_id="lidar", point_stride=4 * size)
            for row, name in enumerate(("intensity", "z", "y", "x")):
                message.fields.add(name=name, offset=row * size, type=code)
            message.data = (
                np.column_stack([np.zeros(len(cloud)), cloud[:, ::-1]]).astype(f"<{kind}").tobytes()
            )
            p, q = message.pose.position, message.pose.orientation
            p.x, p.y, p.z = T[:3, 3]
            if not np.array_equal(T, np.eye(4)):
                q.x, q.y, q.z, q.w = Rotation.from_matrix(T[:3, :3]).as_quat()
            when = 10**9 + k * 10**8
            out.write_message("/lidar", message, log_time=when, publish_time=when)
        out.write_message("/log", of["Log"](message="stop"), log_time=when, publish_time=when)
    return path


@pytest.mark.parametrize("kind", ["i2", "f4", "f8"])
def test_clouds_of_foxglove(kind: str, tmp_path: Path) -> None:
    clouds = [np.round(HUNDRED) + k for k in range(3)]
    path = write_foxglove(tmp_path / "a.mcap", clouds, [np.eye(4)] * 3, kind)
    for k in range(3):
        found = read_recorded(path, Selection(index=k))
        np.testing.assert_array_equal(found.points, clouds[k])
        assert found.guess is None
    np.testing.assert_array_equal(hr.read(path, topic="/lidar", at=0.15).points, clouds[2])
    np.testing.assert_array_equal(hr.read(path, index=1, accumulate=2).points, np.vstack(clouds[1:]))


def test_a_cloud_of_foxglove_comes_to_its_frame_with_its_viewpoint(tmp_path: Path) -> None:
    T = se3.from_rt(se3.rotation_about(np.array([0.1, 0.2, 0.5])), np.array([1.0, -2.0, 1.6]))
    holed = np.vstack([HUNDRED, np.zeros((30, 3))])  # as drivers write missing returns
    path = write_foxglove(tmp_path / "a.mcap", [holed, HUNDRED], [T, np.eye(4)], "f8")
    one = hr.read(path)
    np.testing.assert_allclose(one.points, se3.apply(T, HUNDRED), atol=1e-9)
    assert one.dropped == 30
    np.testing.assert_allclose(read_recorded(path, ANY).guess, T[:3, 3])
    both = read_recorded(path, Selection(accumulate=2))
    np.testing.assert_allclose(both.points[130:], HUNDRED, atol=1e-9)
    assert both.guess is None


@pytest.mark.parametrize(
    "asked, told",
    [
        (Selection(topic="/radar"), r"no clouds of the topic '/radar'; it has /lidar \(2\)"),
        (Selection(index=2), "holds 2 clouds of this topic, index 2 was asked for; choose from 0 to 1"),
        (Selection(at=60.0), "holds 0 clouds of this topic from 60 s on, 1 were asked for; it lasts 0.1 s"),
    ],
)
def test_what_a_file_of_foxglove_lacks_is_told(asked: Selection, told: str, tmp_path: Path) -> None:
    path = write_foxglove(tmp_path / "a.mcap", [HUNDRED, HUNDRED], [np.eye(4)] * 2)
    with pytest.raises(ValueError, match=told):
        read_recorded(path, asked)


def test_an_mcap_file_without_clouds_or_cut_off_says_so(tmp_path: Path) -> None:
    writer = pytest.importorskip("mcap.writer").Writer
    path = tmp_path / "a.mcap"
    with path.open("wb") as file:
        out = writer(file)
        out.start(profile="", library="test")
        schema = out.register_schema("sensor_msgs/msg/Imu", "ros2msg", b"")
        channel = out.register_channel("/imu", "cdr", schema)
        out.add_message(channel, 0, b"", 0)
        out.finish()
    with pytest.raises(ValueError, match="holds no clouds, but sensor_msgs/msg/Imu in cdr"):
        read_recorded(path, ANY)
    whole = write_foxglove(tmp_path / "b.mcap", [HUNDRED], [np.eye(4)]).read_bytes()
    (tmp_path / "cut.mcap").write_bytes(whole[: len(whole) // 2])
    with pytest.raises(ValueError, match=r"cut\.mcap: cannot be read as an MCAP file"):
        read_recorded(tmp_path / "cut.mcap", ANY)
    with (tmp_path / "C.MCAP").open("wb") as file:
        out = writer(file, use_statistics=False)
        out.start(profile="", library="test")
        out.finish()
    with pytest.raises(ValueError, match="has no index; write it to its end"):
        read_recorded(tmp_path / "C.MCAP", ANY)
