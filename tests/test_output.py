# SPDX-License-Identifier: MIT
"""Poses and clouds as other tools read them; results in words, pictures and numbers."""

from __future__ import annotations

import dataclasses
import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from typer.testing import CliRunner

import hybridreg as hr
from hybridreg import testing
from hybridreg.cli.app import app
from hybridreg.config.number_of import number_of
from hybridreg.evidence.covariance import of_information
from hybridreg.geometry import se3
from hybridreg.io import read_points, write_points
from hybridreg.output import pose_text

POSES = [
    np.eye(4),
    se3.from_rt(se3.rotation_about(np.array([0.3, -1.2, 2.5])), np.array([4.0, -5.5, 0.25])),
    se3.from_rt(se3.rotation_about(np.array([np.pi, 0.0, 0.0])), np.array([5e5, 4e6, 100.0])),
    se3.from_rt(se3.rotation_about(np.array([0.0, np.pi / 2, 0.0])), np.zeros(3)),
]


@pytest.fixture(scope="module")
def result() -> tuple[hr.RegistrationResult, hr.Pair, np.ndarray]:
    pair, truth = testing.sample_pair()
    return hr.Pipeline.preset("birdseye-gicp").run(pair), pair, truth


def numbers(text: str) -> np.ndarray:
    return np.array([float(each) for each in text.split()])


@pytest.mark.parametrize("T", POSES)
def test_every_format_holds_the_whole_pose(T: np.ndarray) -> None:
    text = {form: pose_text.pose_text(T, form) for form in pose_text.FORMATS}
    for form in ("matrix", "cloudcompare"):
        np.testing.assert_array_equal(np.loadtxt(text[form].splitlines()), T)
    np.testing.assert_array_equal(numbers(text["kitti"]).reshape(3, 4), T[:3])
    tum, plain = numbers(text["tum"]), numbers(text["quaternion"])
    np.testing.assert_array_equal(tum[1:], plain)
    ros = np.array([float(x) for x in re.findall(r"--q?[xyzw] (\S+)", text["ros-tf"])])
    np.testing.assert_array_equal(ros, plain)
    assert text["ros-tf"].endswith("--frame-id target --child-frame-id source")
    np.testing.assert_array_equal(plain[:3], T[:3, 3])
    np.testing.assert_allclose(Rotation.from_quat(plain[3:]).as_matrix(), T[:3, :3], atol=1e-12)
    xyz, rpy = re.fullmatch(r'<origin xyz="(.*)" rpy="(.*)"/>', text["urdf"]).groups()  # type: ignore[union-attr]
    np.testing.assert_array_equal(numbers(xyz), T[:3, 3])
    np.testing.assert_allclose(Rotation.from_euler("xyz", numbers(rpy)).as_matrix(), T[:3, :3], atol=1e-9)


@pytest.mark.parametrize("T", POSES)
def test_trimesh_reads_the_angles_of_urdf(T: np.ndarray) -> None:
    trimesh = pytest.importorskip("trimesh")
    xyz_rpy = re.findall(r'"([^"]*)"', pose_text.pose_text(T, "urdf"))
    M = trimesh.transformations.euler_matrix(*numbers(xyz_rpy[1]), axes="sxyz")
    np.testing.assert_allclose(M[:3, :3], T[:3, :3], atol=1e-9)


def test_an_unknown_format_lists_the_known() -> None:
    with pytest.raises(ValueError, match="format='euler': a pose is written as matrix, quaternion, ros-tf"):
        pose_text.pose_text(np.eye(4), "euler")


def test_apply_takes_what_register_takes(result: Any, tmp_path: Path) -> None:
    found, pair, _ = result
    points = pair.source.points
    wanted = se3.apply(found.transformation, points)
    np.testing.assert_array_equal(found.apply(points), wanted)
    np.testing.assert_array_equal(found.apply(pair.source), wanted)
    np.testing.assert_array_equal(found.apply(points.T), wanted)
    np.testing.assert_array_equal(found.apply(points[:4].tolist()), wanted[:4])
    holes = np.where(np.arange(len(points))[:, None] % 2, points, np.nan)
    np.testing.assert_array_equal(found.apply(holes)[1::2], wanted[1::2])
    assert len(found.apply(holes)) == len(points)
    np.testing.assert_array_equal(found.apply(np.column_stack([points, points[:, 0]])), wanted)
    np.save(tmp_path / "a.npy", points)
    np.testing.assert_array_equal(found.apply(tmp_path / "a.npy"), wanted)
    far = hr.PointCloud.of(points + [4e6, 3e5, 0.0])
    np.testing.assert_allclose(found.apply(far), found.apply(points + [4e6, 3e5, 0.0]), atol=1e-6)
    np.testing.assert_allclose(dataclasses.replace(found, scale=2.0).apply(points), found.apply(2.0 * points))
    with pytest.raises(ValueError, match=r"points: expected an array of shape \(N, 3\), got \(4,\)"):
        found.apply(np.zeros(4))


def test_apply_keeps_every_row(result: Any, tmp_path: Path) -> None:
    found, pair, _ = result
    few = pair.source.points[:3].copy()
    few[1] = np.nan
    wanted = se3.apply(found.transformation, few)
    np.save(tmp_path / "few.npy", few)
    table = {name: few[:, i] for i, name in enumerate("xyz")}
    records = np.rec.fromarrays(list(few.T), names="x,y,z")
    for cloud in (few, few.tolist(), table, records, tmp_path / "few.npy"):
        np.testing.assert_array_equal(found.apply(cloud), wanted)
    assert found.apply(np.zeros((0, 3))).shape == (0, 3)
    np.testing.assert_array_equal(found.apply(hr.Target(pair.source)), found.apply(pair.source))


def test_words_and_pictures(result: Any) -> None:
    found, pair, _ = result
    text = found.summary()
    assert text.startswith(f"{found.verdict} (confidence")
    for each in (*found.reasons, *found.notes):
        assert each in text
    assert "one standard deviation" in text
    odd = dataclasses.replace(
        found, verdict="failed", reasons=("a < b & c",), scale=2.0, scale_verdict="doubtful"
    )
    page = odd._repr_html_()
    assert "a &lt; b &amp; c" in page
    assert "scale 2 (doubtful)" in page
    assert "one standard deviation" not in odd.summary()
    pytest.importorskip("plotly")
    figure = found.plot()
    clouds = {trace.name: np.column_stack([trace.x, trace.y, trace.z]) for trace in figure.data}
    assert len(clouds["target"]) <= 2 * 50_000
    np.testing.assert_allclose(clouds["source, before"][0], pair.source.points[0], atol=1e-3)
    np.testing.assert_allclose(
        clouds["source, aligned"][0], found.apply(pair.source.points[:1])[0], atol=1e-3
    )


def test_a_stored_result_holds_the_covariance(result: Any) -> None:
    found, _, _ = result
    np.testing.assert_array_equal(json.loads(found.to_json())["covariance"], found.covariance)
    loose = dataclasses.replace(found, information=np.diag([1.0, 1.0, 0.0, 1.0, 1.0, 1.0]))
    told = json.loads(loose.to_json(), parse_constant=lambda word: pytest.fail(f"{word} is no JSON"))
    assert told["covariance"][2][2] is None
    assert told["covariance"][0] == loose.covariance[0].tolist()


def test_covariance_is_that_of_the_information_about_the_centre(result: Any) -> None:
    found, pair, _ = result
    covariance = found.covariance
    assert np.allclose(covariance, covariance.T)
    assert (np.linalg.eigvalsh(covariance) > 0.0).all()
    low, high = pair.target.bounds
    assert ((found.centre >= low) & (found.centre <= high)).all()
    # A map's offset moves the centre, and nothing else.
    shift = np.array([500_000.0, 4_000_000.0, 0.0])
    far = hr.Pipeline.preset("birdseye-gicp")(pair.source.points, pair.target.points + shift)
    np.testing.assert_allclose(far.centre, found.centre + shift, atol=0.1)
    np.testing.assert_allclose(far.covariance, covariance, rtol=0.2, atol=1e-8)


def test_what_nothing_holds_is_infinitely_uncertain() -> None:
    held = np.diag([100.0, 100.0, 100.0, 50.0, 50.0, 0.0])
    covariance = of_information(held)
    assert np.isinf(covariance[5, 5])
    assert np.isfinite(np.delete(np.delete(covariance, 5, 0), 5, 1)).all()
    assert np.isinf(np.diag(of_information(np.zeros((6, 6))))).all()


@pytest.mark.parametrize("ending", ["ply", "pcd"])
def test_the_command_line_writes_clouds(tmp_path: Path, ending: str) -> None:
    pair, truth = testing.sample_pair()
    for name, cloud in (("a", pair.source), ("b", pair.target)):
        write_points(tmp_path / f"{name}.ply", cloud.points)
    aligned, merged = tmp_path / f"aligned.{ending}", tmp_path / f"merged.{ending}"
    call = ["register", str(tmp_path / "a.ply"), str(tmp_path / "b.ply"), "--format", "tum"]
    done = CliRunner().invoke(app, [*call, "--aligned", str(aligned), "--merged", str(merged)])
    assert done.exit_code == 0, done.output
    lines = done.stdout.splitlines()
    pose = numbers(lines[1])
    T = se3.from_rt(Rotation.from_quat(pose[4:]).as_matrix(), pose[1:4])
    assert np.abs(T - truth).max() < 0.1
    np.testing.assert_allclose(read_points(aligned), se3.apply(T, pair.source.points), atol=1e-4)
    assert len(read_points(merged)) == len(pair.source) + len(pair.target)
    for wrong in (["--format", "euler"], ["--aligned", "a.obj"], ["--merged", "a"]):
        done = CliRunner().invoke(app, [*call, *wrong])
        assert done.exit_code == 2
        assert wrong[1] in done.stderr


@pytest.mark.parametrize(
    ("n", "nouns", "told"),
    [
        (0, ("pair",), "0 pairs"),
        (1, ("pair",), "1 pair"),
        (2, ("other pose",), "2 other poses"),
        (1, ("entry", "entries"), "1 entry"),
        (3, ("entry", "entries"), "3 entries"),
    ],
)
def test_a_number_stands_before_its_noun_in_the_right_form(n: int, nouns: tuple[str, ...], told: str) -> None:
    assert number_of(n, *nouns) == told


def test_one_rival_is_no_plural(result: tuple[hr.RegistrationResult, hr.Pair, np.ndarray]) -> None:
    one = dataclasses.replace(result[0], rivals=np.eye(4)[None])
    assert "as well or better: 1 other pose\n" in one.summary()
