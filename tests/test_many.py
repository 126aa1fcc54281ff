# SPDX-License-Identifier: MIT
"""Many clouds: against a prepared target, in a batch, and all into one frame."""

from __future__ import annotations

import csv
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

import hybridreg as hr
from hybridreg.classical import voxel
from hybridreg.cli.app import app
from hybridreg.data.hard import box_world
from hybridreg.geometry import se3
from hybridreg.geometry.voxel_cells import voxel_centroids
from hybridreg.io import write_points
from hybridreg.many import batch_run, kept_rows
from hybridreg.many.jobs import jobs_of


@pytest.fixture(scope="module")
def town() -> Any:
    """A map of a made street (N, 3), scans from it, and their poses in the map."""
    rng = np.random.default_rng(5)
    world = box_world.street(rng, crossing=True)
    poses = [
        box_world.sensor_pose(x, rng.uniform(-2, 2), 1.8, rng.uniform(-180, 180)) for x in (-30, -10, 8, 25)
    ]
    scans = [box_world.scan(world, "rings32", T, rng) for T in poses]
    stands = [box_world.sensor_pose(x, 0.0, 1.8, 0.0) for x in np.linspace(-45, 45, 10)]
    views = [se3.apply(T, box_world.scan(world, "rings64", T, rng, density=1.5)) for T in stands]
    return np.vstack(views), scans, poses


def near(T: np.ndarray, truth: np.ndarray) -> bool:
    step = se3.inverse(T) @ truth
    return se3.angle_deg(step[:3, :3]) < 0.5 and float(np.linalg.norm(step[:3, 3])) < 0.1


def test_a_prepared_target_gives_the_same_and_its_points_are_gone_through_once(
    town: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    world, scans, poses = town
    write_points(tmp_path / "map.ply", world)
    target = hr.Target(tmp_path / "map.ply", viewpoint="none")
    assert len(target) == len(world)
    gone_through: list[int] = []

    def counted(points: np.ndarray, cell: float, *name: str) -> np.ndarray:
        gone_through.append(len(points))
        return voxel_centroids(points, cell, *name)

    monkeypatch.setattr(voxel, "voxel_centroids", counted)
    for again in (False, True):
        gone_through.clear()
        hr.register(scans[0], tmp_path / "map.ply", target_viewpoint="none")
        assert len(world) in gone_through
        gone_through.clear()
        target.register(scans[0])
        assert (len(world) not in gone_through) == again
    independent = hr.register(scans[1], tmp_path / "map.ply", target_viewpoint="none")
    assert near(target.register(scans[1]).transformation, poses[1])
    assert near(independent.transformation, poses[1])


def test_what_is_kept_changes_no_bit(town: Any) -> None:
    world, scans, _ = town
    target = hr.Target(world[::4], viewpoint="none")
    first = [target.register(scan).transformation for scan in scans[:2]]
    again = [target.register(scan).transformation for scan in scans[:2]]
    fresh = hr.Target(world[::4], viewpoint="none").register(scans[1]).transformation
    np.testing.assert_array_equal(first, again)
    np.testing.assert_array_equal(first[1], fresh)


@pytest.fixture
def folder(town: Any, tmp_path: Path) -> Path:
    world, scans, _ = town
    write_points(tmp_path / "map.ply", world[::5])
    (tmp_path / "scans").mkdir()
    for k, scan in enumerate(scans[:3]):
        write_points(tmp_path / "scans" / f"s{k}.pcd", scan)
    return tmp_path


def test_a_batch_against_a_map_goes_on_where_it_was_cut_off(town: Any, folder: Path) -> None:
    _, _, poses = town
    (folder / "scans" / "bad.pcd").write_bytes(b"nothing")
    call = [
        "batch",
        str(folder / "scans" / "*.pcd"),
        "--target",
        str(folder / "map.ply"),
        "--out",
        str(folder / "out"),
    ]
    call += ["--target-viewpoint", "none"]
    done = CliRunner().invoke(app, call)
    assert done.exit_code == 0, done.output
    assert "4 pairs: 3 ok, 0 doubtful, 1 failed" in done.output
    assert "bad.pcd" in done.output
    with open(folder / "out" / "poses.csv", newline="") as file:
        table = {row["id"]: row for row in csv.DictReader(file)}
    assert table["bad"]["x"] == ""
    assert [table[name]["scale"] for name in ("bad", "s0")] == ["", "1"]
    assert "bad.pcd" in table["bad"]["why"]
    for k in range(3):
        assert np.allclose([float(table[f"s{k}"][axis]) for axis in "xyz"], poses[k][:3, 3], atol=0.1)
    path = folder / "out" / "rows.jsonl"
    lines = path.read_text().splitlines(keepends=True)
    path.write_text("".join(lines[:3]) + lines[3][:40])  # killed while it wrote a row
    again = CliRunner().invoke(app, call)
    assert again.exit_code == 0, again.output
    kept = [json.loads(line) for line in path.read_text().splitlines()[1:]]
    assert kept[0] == json.loads(lines[2])  # s0; the bad one was tried again
    assert sorted(row["id"] for row in kept) == ["bad", "s0", "s1", "s2"]
    write_points(folder / "scans" / "bad.pcd", town[1][3])
    mended = CliRunner().invoke(app, call)
    assert "4 pairs: 4 ok, 0 doubtful, 0 failed" in mended.output
    assert [json.loads(line) for line in path.read_text().splitlines()[1:4]] == [
        r for r in kept if not r["error"]
    ]
    # A scan that is another one now is registered anew.
    (folder / "scans" / "s1.pcd").write_bytes((folder / "scans" / "s2.pcd").read_bytes())
    assert CliRunner().invoke(app, call).exit_code == 0
    with open(folder / "out" / "poses.csv", newline="") as file:
        table = {row["id"]: row for row in csv.DictReader(file)}
    assert table["s1"]["x"] == table["s2"]["x"]
    (folder / "scans" / "s1.pcd").unlink()
    other = CliRunner().invoke(app, [*call, "--seed", "1"])
    assert other.exit_code == 2
    assert "--overwrite" in other.stderr


def test_a_list_names_pairs_and_workers_change_nothing(town: Any, folder: Path) -> None:
    rows = "source,target,id\nscans/s0.pcd,map.ply,one\nscans/s1.pcd,,two\n"
    (folder / "list.csv").write_text(rows)
    call = [
        "batch",
        str(folder / "list.csv"),
        "--target",
        str(folder / "scans" / "s2.pcd"),
        "--preset",
        "birdseye-gicp",
    ]
    for workers in ("1", "2"):
        done = CliRunner().invoke(app, [*call, "--out", str(folder / workers), "--workers", workers])
        assert done.exit_code == 0, done.output
    poses = []
    for workers in ("1", "2"):
        rows_of = [
            json.loads(line) for line in (folder / workers / "rows.jsonl").read_text().splitlines()[1:]
        ]
        poses.append({row["id"]: row["T_target_source"] for row in rows_of})
    assert poses[0] == poses[1]
    assert set(poses[0]) == {"one", "two"}


@pytest.mark.parametrize("content, word", [
    ("source\na.ply\n", "row 2 names no target"),
    ("target\nb.ply\n", "row 2 names no source"),
    ("source,target\n", "holds no rows"),
    ("source,target,id\na.ply,b.ply,x\nc.ply,b.ply,x\n", "two pairs are called 'x'"),
    ("source;target;id\na,1.ply;b.ply;x\nc.ply;b.ply;x\n", "two pairs are called 'x'"),
    ("source\ttarget\na.ply\t\n", "row 2 names no target"),
    ("source,target\na,1.ply,b.ply\n", "row 2 has more cells than the first row has columns"),
    ("x,y,z\n1,2,3\n", "if it is a cloud and no list of pairs, name it by a pattern"),
])  # fmt: skip
def test_a_list_that_is_none_tells_its_row(tmp_path: Path, content: str, word: str) -> None:
    (tmp_path / "list.csv").write_text(content)
    done = CliRunner().invoke(app, ["batch", str(tmp_path / "list.csv"), "--out", str(tmp_path / "out")])
    assert done.exit_code == 2
    assert word in done.stderr
    assert not (tmp_path / "out").exists()


def test_columns_that_a_list_does_not_have_are_told(tmp_path: Path) -> None:
    (tmp_path / "list.csv").write_text("Source, target,ID,init,image,\na.ply,b.ply,one,start.txt,a.jpg,,,\n")
    with pytest.warns(
        UserWarning, match="list.csv: init, image: not read; a list gives source, target and id"
    ):
        jobs = jobs_of([str(tmp_path / "list.csv")], None)
    assert [(job.id, job.source) for job in jobs] == [("one", str(tmp_path / "a.ply"))]


def test_a_pattern_that_fits_nothing_and_one_without_a_target(tmp_path: Path) -> None:
    (tmp_path / "a.ply").write_bytes(b"")
    for arguments, word in (
        (["nowhere/*.ply"], "no file fits"), ([str(tmp_path / "*.ply")], "--target"),
        ([str(tmp_path / "*.ply"), "--target", str(tmp_path / "a.ply")], "fits the target alone"),
        (["gone.csv"], "no such list"), ([str(tmp_path / "*.csv")], "no file fits this pattern"),
        ([str(tmp_path / "a.ply"), "--target", "gone.las"], "gone.las: no such target"),
        ([str(tmp_path), "--target", str(tmp_path / "a.ply")], "is a folder; give a pattern of its files"),
        (["pairs.json"], "save a list of pairs as .csv"),
    ):  # fmt: skip
        done = CliRunner().invoke(app, ["batch", *arguments, "--out", str(tmp_path / "out")])
        assert done.exit_code == 2
        assert word in done.stderr
    (tmp_path / "out").write_text("")
    arguments = [str(tmp_path / "*.ply"), "--target", str(Path(__file__))]
    done = CliRunner().invoke(app, ["batch", *arguments, "--out", str(tmp_path / "out")])
    assert done.exit_code == 2
    assert "a file of this name is in the way" in done.stderr


@pytest.mark.parametrize("command", ["batch", "together"])
def test_nothing_that_is_read_is_written_over(tmp_path: Path, command: str) -> None:
    table = tmp_path / "poses.csv"
    table.write_text("source,target\na.ply,b.ply\n")
    (tmp_path / "a.ply").touch()
    given = [str(table), str(tmp_path / "a.ply")] if command == "together" else [str(table)]
    done = CliRunner().invoke(app, [command, *given, "--out", str(tmp_path / "." / "x" / "..")])
    assert done.exit_code == 2
    told = " ".join(done.output.split())
    assert "poses.csv: is read, and would be written over; choose another --out" in told
    assert table.read_text().startswith("source,target")


def test_clouds_of_a_batch_are_named_one_by_one_or_by_patterns(tmp_path: Path) -> None:
    for name in ("s10.csv", "s9.csv", "s[1].csv", "map.ply"):
        (tmp_path / name).write_bytes(b"")
    (tmp_path / "s folder").mkdir()
    (tmp_path / "s.bag").mkdir()
    (tmp_path / "s.bag" / "metadata.yaml").write_text("")
    pattern, target = str(tmp_path / "s*"), tmp_path / "map.ply"
    assert [job.id for job in jobs_of([pattern], target)] == ["s9", "s10", "s", "s[1]"]
    assert [job.id for job in jobs_of([pattern + ".csv"], target)] == ["s9", "s10", "s[1]"]
    named = [str(tmp_path / "s[1].csv"), str(tmp_path / "s10.csv")]
    assert [job.source for job in jobs_of(named, target)] == named


def test_a_map_that_was_written_anew_is_read_anew_in_one_process(tmp_path: Path) -> None:
    path, settings = str(tmp_path / "map.npy"), json.dumps({"nonfinite": "raise", "target_viewpoint": "none"})
    rng = np.random.default_rng(0)
    read = []
    for n in (300, 400):
        np.save(path, rng.uniform(-9.0, 9.0, (n, 3)))
        read.append(batch_run._target(path, kept_rows.looks(path), settings))
    assert read[0] is not read[1]
    assert batch_run._target(path, kept_rows.looks(path), settings) is read[1]
