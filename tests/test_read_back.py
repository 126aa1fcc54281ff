# SPDX-License-Identifier: MIT
"""What is written for other tools, read back by them: PCL's and CloudCompare's programs where they are installed
(Debian's `pcl-tools`, `cloudcompare`), wheels where they are."""

from __future__ import annotations

import io
import os
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hybridreg.geometry import se3
from hybridreg.io import read_points, write_points
from hybridreg.output.pose_files import pose_files
from hybridreg.output.pose_text import pose_text
from hybridreg.runtime.open3d import load_open3d

# float32 holds these to the last bit.
HUNDRED = np.random.default_rng(3).integers(-4000, 4000, (100, 3)) / 64.0
NAMES = ["base", "front lidar", "rear"]
POSES = np.array([
    np.eye(4),
    se3.from_rt(se3.rotation_about(np.array([0.3, -1.2, 2.5])), np.array([4.0, -5.5, 0.25])),
    se3.from_rt(se3.rotation_about(np.array([0.0, np.pi / 2, 0.0])), np.array([500.0, -40.0, 100.0])),
])  # fmt: skip


def program(name: str, *arguments: str) -> str:
    """What a program prints; the test is skipped where it is not installed."""
    if shutil.which(name) is None:
        pytest.skip(f"{name} is not installed")
    environment = {**os.environ, "QT_QPA_PLATFORM": "offscreen"}
    done = subprocess.run(
        [name, *arguments], capture_output=True, text=True, timeout=120, env=environment, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout + done.stderr


def by_pcl(path: Path) -> np.ndarray:
    if path.suffix == ".ply":
        program("pcl_ply2pcd", str(path), str(path.with_suffix(".of_ply.pcd")))
        path = path.with_suffix(".of_ply.pcd")
    out = path.with_suffix(".ascii.pcd")
    program("pcl_convert_pcd_ascii_binary", str(path), str(out), "0")
    return np.loadtxt(out, skiprows=11)


def by_cloudcompare(path: Path, *between: str) -> np.ndarray:
    out = path.with_suffix(".asc")
    how = ("-SILENT", "-AUTO_SAVE", "OFF", "-C_EXPORT_FMT", "ASC", "-PREC", "8", "-O", str(path))
    program("CloudCompare", *how, *between, "-SAVE_CLOUDS", "FILE", str(out))
    return np.loadtxt(out)[:, :3]


def by_open3d(path: Path) -> np.ndarray:
    try:
        open3d = load_open3d()
    except ImportError as error:
        pytest.skip(str(error))
    return np.asarray(open3d.io.read_point_cloud(str(path)).points)


def by_pypcd4(path: Path) -> np.ndarray:
    cloud = pytest.importorskip("pypcd4").PointCloud.from_path(path)
    assert tuple(cloud.metadata.viewpoint) == (0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)
    return np.asarray(cloud.numpy(("x", "y", "z")))


def by_plyfile(path: Path) -> np.ndarray:
    vertex = pytest.importorskip("plyfile").PlyData.read(str(path))["vertex"]
    return np.column_stack([vertex[axis] for axis in "xyz"])


def by_trimesh(path: Path) -> np.ndarray:
    return np.asarray(pytest.importorskip("trimesh").load(path).vertices)


READERS: dict[str, list[Callable[[Path], np.ndarray]]] = {
    "pcd": [by_pcl, by_open3d, by_pypcd4],  # Debian's CloudCompare has no plugin for it
    "ply": [by_pcl, by_cloudcompare, by_open3d, by_plyfile, by_trimesh],
}


@pytest.mark.parametrize("dtype", [None, "float32", "float64"])
@pytest.mark.parametrize(
    "ending, reader", [(ending, reader) for ending, readers in READERS.items() for reader in readers]
)
def test_clouds(ending: str, reader: Callable[[Path], np.ndarray], dtype: Any, tmp_path: Path) -> None:
    if (ending, dtype) == ("pcd", "float64") and reader is by_open3d:
        pytest.skip("Open3D reads zeros; the reason why PCD is written as float32")
    path = tmp_path / f"a.{ending}"
    write_points(path, HUNDRED, dtype=dtype)
    np.testing.assert_allclose(reader(path), HUNDRED, rtol=1e-6)  # seven digits in PCL's text


def test_cloudcompare_moves_the_source_as_the_pose_does(tmp_path: Path) -> None:
    write_points(tmp_path / "a.ply", HUNDRED)
    for T in POSES[1:]:
        (tmp_path / "T.txt").write_text(pose_text(T, "cloudcompare") + "\n")
        moved = by_cloudcompare(tmp_path / "a.ply", "-APPLY_TRANS", str(tmp_path / "T.txt"))
        np.testing.assert_allclose(moved, se3.apply(T, HUNDRED), atol=1e-4)


def test_what_cloudcompare_and_pcl_write_is_read(tmp_path: Path) -> None:
    write_points(tmp_path / "a.ply", HUNDRED)
    for form, ending in (("PLY", "ply"), ("ASC", "asc")):
        out = tmp_path / f"out.{ending}"
        how = ("-SILENT", "-AUTO_SAVE", "OFF", "-C_EXPORT_FMT", form, "-O", str(tmp_path / "a.ply"))
        program("CloudCompare", *how, "-SAVE_CLOUDS", "FILE", str(out))
        np.testing.assert_allclose(read_points(out), HUNDRED, atol=1e-5, err_msg=form)
    write_points(tmp_path / "a.pcd", HUNDRED)
    for kind, name in enumerate(("ascii", "binary", "compressed")):
        out = tmp_path / f"{name}.pcd"
        program("pcl_convert_pcd_ascii_binary", str(tmp_path / "a.pcd"), str(out), str(kind))
        np.testing.assert_allclose(read_points(out), HUNDRED, rtol=1e-6, err_msg=name)


# --- poses


@pytest.mark.parametrize("T", POSES)
def test_evo_reads_one_pose(T: np.ndarray, tmp_path: Path) -> None:
    evo = pytest.importorskip("evo.tools.file_interface")
    for form in ("kitti", "tum"):
        (tmp_path / form).write_text(pose_text(T, form) + "\n")
    np.testing.assert_array_equal(evo.read_kitti_poses_file(tmp_path / "kitti").poses_se3[0], T)
    np.testing.assert_allclose(evo.read_tum_trajectory_file(tmp_path / "tum").poses_se3[0], T, atol=1e-12)


def test_evo_reads_the_trajectories_of_many(tmp_path: Path) -> None:
    evo = pytest.importorskip("evo.tools.file_interface")
    for form in ("kitti", "tum"):
        (text,) = pose_files(NAMES, POSES, 0, form).values()
        (tmp_path / form).write_text(text)
    kitti, tum = (
        evo.read_kitti_poses_file(tmp_path / "kitti"),
        evo.read_tum_trajectory_file(tmp_path / "tum"),
    )
    for found in (kitti, tum):
        np.testing.assert_allclose(found.poses_se3, POSES, atol=1e-12)
        assert found.check()[0]
    np.testing.assert_array_equal(tum.timestamps, [0.0, 1.0, 2.0])


def robot(T: np.ndarray) -> str:
    """A robot around the origin that a pose is written as."""
    joint = f'<joint name="j" type="fixed"><parent link="base"/><child link="rear"/>{pose_text(T, "urdf")}</joint>'
    return f'<robot name="r"><link name="base"/><link name="rear"/>{joint}</robot>'


def test_yourdfpy_places_every_link(tmp_path: Path) -> None:
    URDF = pytest.importorskip("yourdfpy").URDF
    (text,) = pose_files(NAMES, POSES, 0, "urdf").values()
    found = URDF.load(io.StringIO(text))
    for name, T in zip(NAMES, POSES, strict=True):
        np.testing.assert_allclose(found.get_transform(name, "base"), T, atol=1e-12)
    for T in POSES:
        placed = URDF.load(io.StringIO(robot(T))).get_transform("rear", "base")
        np.testing.assert_allclose(placed, T, atol=1e-12)


def test_the_parser_of_ros_reads_every_joint() -> None:
    URDF = pytest.importorskip("urdf_parser_py.urdf").URDF
    (text,) = pose_files(NAMES, POSES, 0, "urdf").values()
    found = URDF.from_xml_string(text.encode())
    assert [joint.child for joint in found.joints] == NAMES[1:]
    for joint, T in zip(found.joints, POSES[1:], strict=True):
        roll, pitch, yaw = joint.origin.rpy
        turn = se3.rotation_about(np.array([0.0, 0.0, yaw])) @ se3.rotation_about(np.array([0.0, pitch, 0.0]))
        turn = turn @ se3.rotation_about(np.array([roll, 0.0, 0.0]))
        np.testing.assert_allclose(turn, T[:3, :3], atol=1e-12)
        np.testing.assert_array_equal(joint.origin.xyz, T[:3, 3])


@pytest.mark.parametrize("T", POSES)
def test_the_command_for_ros_turns_as_its_messages_do(T: np.ndarray) -> None:
    # ROS itself has no wheel: the quaternion goes through a message as tf2 broadcasts it, and through Open3D's own
    # conversion, which puts w first.
    typesys = pytest.importorskip("rosbags.typesys")
    store = typesys.get_typestore(typesys.Stores.ROS2_HUMBLE)
    words = pose_text(T, "ros-tf").split()
    numbers = dict(zip(words[4:18:2], map(float, words[5:18:2]), strict=True))
    given = {name.removeprefix("--"): value for name, value in numbers.items()}
    assert list(given) == ["x", "y", "z", "qx", "qy", "qz", "qw"]
    kind = "geometry_msgs/msg/Transform"
    message = store.types[kind](
        translation=store.types["geometry_msgs/msg/Vector3"](given["x"], given["y"], given["z"]),
        rotation=store.types["geometry_msgs/msg/Quaternion"](
            given["qx"], given["qy"], given["qz"], given["qw"]
        ),
    )
    read = store.deserialize_cdr(store.serialize_cdr(message, kind), kind)
    try:
        turn = load_open3d().geometry.get_rotation_matrix_from_quaternion
    except ImportError as error:
        pytest.skip(str(error))
    q = read.rotation
    np.testing.assert_allclose(turn(np.array([q.w, q.x, q.y, q.z])), T[:3, :3], atol=1e-12)
    assert [read.translation.x, read.translation.y, read.translation.z] == T[:3, 3].tolist()


@pytest.mark.parametrize("T", POSES)
def test_open3d_takes_the_matrix(T: np.ndarray, tmp_path: Path) -> None:
    write_points(tmp_path / "a.ply", HUNDRED)
    try:
        cloud = load_open3d().io.read_point_cloud(str(tmp_path / "a.ply"))
    except ImportError as error:
        pytest.skip(str(error))
    cloud.transform(np.loadtxt(pose_text(T, "matrix").splitlines()))
    np.testing.assert_allclose(np.asarray(cloud.points), se3.apply(T, HUNDRED), atol=1e-9)
