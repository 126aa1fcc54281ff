# SPDX-License-Identifier: MIT
"""`hybridreg together`: files of a tour into one frame, cut off and gone on with, in every form of poses."""

from __future__ import annotations

import csv
import json
import re
import xml.etree.ElementTree as ElementTree
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from typer.testing import CliRunner

from hybridreg.cli.app import app
from hybridreg.data.hard import box_world
from hybridreg.geometry import se3
from hybridreg.io import read_points, write_points
from hybridreg.many import link_search
from hybridreg.many.together_run import files_of
from hybridreg.output.pose_files import pose_files
from hybridreg.runtime.open3d import load_open3d


@pytest.fixture(scope="module")
def tour(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, np.ndarray, int]:
    """A folder of five scans along a made street, numbered 8 to 12, their poses in the first one's frame, and the
    number of points."""
    try:
        load_open3d()
    except ImportError as error:
        pytest.skip(str(error))
    folder = tmp_path_factory.mktemp("tour")
    rng = np.random.default_rng(11)
    world = box_world.street(rng, crossing=True)
    poses = [
        box_world.sensor_pose(x, rng.uniform(-2, 2), 1.8, rng.uniform(-180, 180), rng.normal(0, 1))
        for x in np.linspace(-14, 14, 5)
    ]
    count = 0
    for k, T in enumerate(poses):
        scan = box_world.scan(world, ("rings32", "rings64")[k % 2], T, rng, density=0.8)
        write_points(folder / f"s{8 + k}.pcd", scan)
        count += len(scan)
    return folder, np.array([se3.inverse(poses[0]) @ T for T in poses]), count


def call(folder: Path, out: Path, *more: str) -> Any:
    return CliRunner().invoke(app, ["together", str(folder / "s*.pcd"), "--out", str(out), *more])


def table(path: Path) -> dict[str, dict[str, str]]:
    with open(path, newline="") as file:
        return {row["id"]: row for row in csv.DictReader(file)}


def test_a_folder_of_scans_into_one_frame(tour: Any, tmp_path: Path) -> None:
    folder, truth, count = tour
    done = call(folder, tmp_path, "--merged", str(tmp_path / "all.ply"))
    assert done.exit_code == 0, done.output
    assert re.match(r"ok: 5 of 5 clouds in the frame of s8, (\d+) of \d+ links agree", done.stdout)
    rows = table(tmp_path / "poses.csv")
    assert list(rows) == ["s8", "s9", "s10", "s11", "s12"]  # as counted, not as spelt
    for k, row in enumerate(rows.values()):
        assert row["placed"] == "yes"
        assert int(row["links"]) >= 2
        T = np.loadtxt(tmp_path / "poses" / f"s{8 + k}.txt")
        np.testing.assert_allclose(T[:3, 3], truth[k, :3, 3], atol=0.1)
        np.testing.assert_array_equal([float(row[axis]) for axis in "xyz"], T[:3, 3])
        turn = Rotation.from_quat([float(row[f"q{axis}"]) for axis in "xyzw"]).as_matrix()
        np.testing.assert_allclose(turn, T[:3, :3], atol=1e-12)
    told = json.loads((tmp_path / "alignment.json").read_text())
    with open(tmp_path / "links.csv", newline="") as file:
        links = list(csv.DictReader(file))
    assert [(each["source"], each["role"]) for each in links] == [
        (each["source"], each["role"]) for each in told["links"]
    ]
    assert {each["verdict"] for each in links} <= {"ok", "doubtful", "failed"}
    merged = read_points(tmp_path / "all.ply")
    assert len(merged) == count
    last = se3.apply(np.array(told["poses"]["s12"]), read_points(folder / "s12.pcd"))
    np.testing.assert_allclose(merged[-len(last) :], last, atol=1e-5)


def test_what_was_cut_off_goes_on_to_the_same_poses(
    tour: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder, _, _ = tour
    fast = ("--preset", "birdseye-gicp")
    assert call(folder, tmp_path, *fast).exit_code == 0
    wanted = (tmp_path / "poses.csv").read_bytes(), (tmp_path / "links.csv").read_bytes()
    path = tmp_path / "links.jsonl"
    lines = path.read_bytes().splitlines(keepends=True)
    path.write_bytes(b"".join(lines[:4]) + lines[4][:50])  # killed while it wrote the fourth
    ran = []
    linked = link_search._linked
    monkeypatch.setattr(link_search, "_linked", lambda *job: ran.append(job[:2]) or linked(*job))
    done = call(folder, tmp_path, *fast, "--reference", "s8.pcd")
    assert done.exit_code == 0, done.output
    assert len(ran) == len(lines) - 4
    assert ((tmp_path / "poses.csv").read_bytes(), (tmp_path / "links.csv").read_bytes()) == wanted
    assert path.read_bytes() == b"".join(lines)
    ran.clear()
    # Another frame and another form need no registration.
    done = call(folder, tmp_path, *fast, "--reference", "s10", "--format", "tum")
    assert done.exit_code == 0, done.output
    assert "in the frame of s10" in done.stdout
    assert ran == []
    assert "0.0" in (tmp_path / "poses.tum.txt").read_text()
    # A scan that changed is registered anew, the others are not.
    (folder / "s12.pcd").write_bytes((folder / "s12.pcd").read_bytes())  # its time is another
    assert call(folder, tmp_path, *fast).exit_code == 0
    assert not (tmp_path / "poses.tum.txt").exists()  # of another reference
    assert ran
    assert all(4 in pair for pair in ran)
    done = call(folder, tmp_path, *fast, "--seed", "1")
    assert done.exit_code == 2
    assert "--overwrite" in done.stderr
    path.write_text("{}\n{}\n")
    done = call(folder, tmp_path, *fast)
    assert done.exit_code == 2
    assert "damaged" in done.stderr


def test_workers_change_nothing_and_a_bad_cloud_is_told_by_its_name(tour: Any, tmp_path: Path) -> None:
    folder, _, _ = tour
    fast = ("--preset", "birdseye-gicp", "--unordered")
    for workers in ("1", "2"):
        assert call(folder, tmp_path / workers, *fast, "--workers", workers).exit_code == 0
    assert (tmp_path / "1" / "poses.csv").read_bytes() == (tmp_path / "2" / "poses.csv").read_bytes()
    (tmp_path / "bad.pcd").write_bytes(b"nothing")
    done = CliRunner().invoke(
        app, ["together", str(folder / "s8.pcd"), str(tmp_path / "bad.pcd"), "--out", str(tmp_path / "o")]
    )
    assert done.exit_code == 2
    assert "bad.pcd" in done.stderr


def test_what_cannot_be_is_refused(tmp_path: Path) -> None:
    for name in ("a", "b"):
        write_points(tmp_path / f"{name}.ply", np.random.default_rng(1).normal(size=(300, 3)))
    a, b = str(tmp_path / "a.ply"), str(tmp_path / "b.ply")
    for arguments, word in (
        ([a], "one cloud, two or more"), ([str(tmp_path / "*.las")], "no file fits"), ([a, b, a], "a.ply: named twice"),
        ([a, b, "--format", "euler"], "--format euler"), ([a, b, "--merged", "x.obj"], "x.obj"),
        ([a, b, "--merged", b], "b.ply: is one of the clouds that are read"),
        ([a, b, "--reference", "c"], "reference 'c': is none of the clouds; they are a, b"),
        ([a, b, "--viewpoint", "1,2"], "--viewpoint 1,2"),
    ):  # fmt: skip
        done = CliRunner().invoke(app, ["together", *arguments, "--out", str(tmp_path / "out")])
        assert done.exit_code == 2, arguments
        assert word in done.stderr
    assert not (tmp_path / "out").exists()


def test_two_clouds_of_nothing_in_common_end_with_three(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    for name in ("a", "b"):
        write_points(tmp_path / f"{name}.ply", rng.normal(size=(2000, 3)) * 10.0)
    (tmp_path / "out" / "poses").mkdir(parents=True)
    (tmp_path / "out" / "poses" / "b.txt").write_text("of an earlier run")
    done = CliRunner().invoke(app, ["together", str(tmp_path / "*.ply"), "--out", str(tmp_path / "out")])
    assert done.exit_code == 3, done.output
    assert "b is not placed: nothing ties it to a" in done.stdout
    assert table(tmp_path / "out" / "poses.csv")["b"]["x"] == ""
    assert not (tmp_path / "out" / "poses" / "b.txt").exists()


def test_the_order_of_files(tmp_path: Path) -> None:
    for name in ("s10.ply", "s9.ply", "s1.ply"):
        (tmp_path / name).write_bytes(b"")
    found = [Path(file).stem for file in files_of([str(tmp_path / "s*.ply")])]
    assert found == ["s1", "s9", "s10"]
    given = [str(tmp_path / "s10.ply"), str(tmp_path / "s1.ply")]
    assert files_of(given) == given


# --- forms of poses

POSES = np.array([
    np.eye(4),
    se3.from_rt(se3.rotation_about(np.array([0.3, -1.2, 2.5])), np.array([4.0, -5.5, 0.25])),
    np.full((4, 4), np.nan),
    se3.from_rt(se3.rotation_about(np.array([0.0, np.pi / 2, 0.0])), np.array([5e5, 4e6, 100.0])),
])  # fmt: skip
NAMES = ["a", 'b & "c"', "lost", "d e"]


def test_every_form_tells_the_placed_and_marks_the_lost() -> None:
    for form in ("matrix", "cloudcompare"):
        files = pose_files(NAMES, POSES, 0, form)
        assert list(files) == ["poses/a.txt", "poses/b____c_.txt", "poses/d_e.txt"]
        np.testing.assert_array_equal(np.loadtxt(files["poses/d_e.txt"].splitlines()), POSES[3])
    kitti = np.loadtxt(pose_files(NAMES, POSES, 0, "kitti")["poses.kitti.txt"].splitlines())
    np.testing.assert_array_equal(kitti.reshape(4, 3, 4), POSES[:, :3])
    tum = np.loadtxt(pose_files(NAMES, POSES, 0, "tum")["poses.tum.txt"].splitlines())
    np.testing.assert_array_equal(tum[:, 0], [0.0, 1.0, 3.0])
    np.testing.assert_allclose(Rotation.from_quat(tum[1, 4:]).as_matrix(), POSES[1, :3, :3], atol=1e-12)
    plain = pose_files(NAMES, POSES, 0, "quaternion")["poses.quaternion.txt"].splitlines()
    assert [line.split(" ", 7)[7] for line in plain] == ["a", 'b & "c"', "d e"]
    script = pose_files(NAMES, POSES, 0, "ros-tf")["poses.ros-tf.sh"]
    assert script.count("static_transform_publisher") == 2
    assert "--frame-id a --child-frame-id 'd e' &\n" in script
    robot = ElementTree.fromstring(pose_files(NAMES, POSES, 0, "urdf")["poses.urdf"])
    assert [link.get("name") for link in robot.iter("link")] == ["a", 'b & "c"', "d e"]
    joint = robot.findall("joint")[1]
    assert [each.get("link") for each in joint[:2]] == ["a", "d e"]
    assert joint[2].get("xyz") == "500000.0 4000000.0 100.0"
    with pytest.raises(ValueError, match="format='euler'"):
        pose_files(NAMES, POSES, 0, "euler")


def test_names_of_one_file_name_keep_files_of_their_own() -> None:
    files = pose_files(["x/a", "y/a", "y/A"], np.array([np.eye(4)] * 3), 0, "matrix")
    assert list(files) == ["poses/0000-a.txt", "poses/0001-a.txt", "poses/0002-A.txt"]
