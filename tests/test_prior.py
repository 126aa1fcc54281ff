# SPDX-License-Identifier: MIT
"""What is known beforehand narrows the search, and the verdict knows it."""

from __future__ import annotations

import json
import re
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

import hybridreg as hr
from hybridreg import testing
from hybridreg.cli.app import app
from hybridreg.data.loaders.folder import load_pair
from hybridreg.geometry import se3
from hybridreg.io import write_matrix, write_points
from hybridreg.io.poses.pose_file import read_pose
from hybridreg.output.pose_files import pose_files
from hybridreg.output.pose_text import FORMATS, pose_text, quaternion, roll_pitch_yaw
from hybridreg.prior.prior import Prior
from hybridreg.runtime.open3d import load_open3d

DEMO = Path(hr.__file__).parent / "data" / "demo"


@pytest.fixture(scope="module")
def demo() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Source and target (N, 3) of the demo pair, and its true pose."""
    labelled = load_pair(DEMO)
    return labelled.pair.source.points, labelled.pair.target.points, labelled.T_target_source


def off(T: np.ndarray, truth: np.ndarray) -> tuple[float, float]:
    """Degrees and metres between two poses."""
    step = se3.inverse(T) @ truth
    return se3.angle_deg(step[:3, :3]), float(np.linalg.norm(step[:3, 3]))


def near(T: np.ndarray, truth: np.ndarray, degrees: float = 1.0, metres: float = 0.2) -> bool:
    turned, moved = off(T, truth)
    return turned < degrees and moved < metres


ROUGH = se3.from_rt(se3.rotation_about(np.radians([2.0, -1.0, 8.0])), np.array([1.0, -0.8, 0.2]))


def test_a_start_is_searched_around_and_bounds_hold(demo: Any) -> None:
    source, target, truth = demo
    result = hr.register(source, target, init=ROUGH @ truth, max_translation=4.0, max_rotation=15.0)
    assert result.verdict == "ok"
    assert near(result.transformation, truth)
    assert "prior" in result.seconds
    assert (result.scale, result.scale_verdict) == (1.0, None)
    assert result.spec["prior"]["max_rotation"] == 15.0
    assert hr.Pipeline.preset("icp")(source, target).verdict != "ok"
    from_start = hr.Pipeline.preset("icp").swap(prior={"init": truth})(source, target)
    assert near(from_start.transformation, truth, 3.0, 0.6)


@pytest.mark.parametrize(
    "bound, word",
    [({"max_translation": 0.5}, "max_translation=0.5"), ({"max_rotation": 5.0}, "max_rotation=5")],
)
def test_a_pose_beyond_the_bounds_is_none(demo: Any, bound: dict[str, float], word: str) -> None:
    source, target, _ = demo
    for preset in ("default", "birdseye-gicp"):
        result = hr.register(source, target, preset=preset, **bound)  # type: ignore[arg-type]
        assert result.verdict == "failed", preset
        assert all(
            np.linalg.norm(T[:3, 3]) < 20.0 and se3.angle_deg(T[:3, :3]) <= 5.01
            for T in result.rivals
            if "max_rotation" in bound
        )
    assert any(word in reason for reason in result.reasons), result.reasons


@pytest.mark.parametrize("preset", ["default", "birdseye-gicp"])
@pytest.mark.parametrize("shift, degrees, bound, away", [
    (0.0, 4.0, 0.3, (0.9, 1.4)),  # a tilted start: its translation is exact
    (500.0, 2.0, 3.0, (17.0, 19.0)),  # the same of a source whose origin lies far away
    (0.0, 0.0, 5.0, (6.7, 7.1)),  # no start at all
])  # fmt: skip
def test_a_pose_that_was_shut_out_is_told_with_its_distance_and_how_it_is_measured(
    demo: Any, preset: str, shift: float, degrees: float, bound: float, away: tuple[float, float]
) -> None:
    source, target, truth = demo
    offset = np.array([shift, 0.0, 0.0])
    T = truth @ se3.from_rt(np.eye(3), -offset)
    tilt = se3.from_rt(se3.rotation_about(np.radians([0.0, degrees, 0.0])), np.zeros(3))
    init = {"init": T @ tilt} if degrees else {}
    result = hr.register(source + offset, target, preset=preset, max_translation=bound, **init)
    assert result.verdict == "failed"
    told = re.search(
        rf"lies ([\d.]+) m from the start, beyond max_translation={bound:g} \(measured at the middle of the "
        r"source, ([\d.]+) m from its origin: a start that is turned by 1 degree lies ([\d.]+) m off there\)",
        " ".join(result.reasons),
    )
    assert told, result.reasons
    moved, arm, each = map(float, told.groups())
    assert away[0] < moved < away[1]
    middle = np.linalg.norm(np.median(source, axis=0) + offset)
    assert arm == pytest.approx(middle, abs=0.6)
    assert each == pytest.approx(np.radians(arm), rel=0.06)
    if preset == "default" and degrees:
        assert any("shut out" in reason for reason in result.reasons)
    lost = [reason for reason in result.reasons if reason.startswith("no pose")]
    assert lost in ([], ["no pose is left: the start was returned"])
    freed = hr.register(source + offset, target, preset=preset, max_translation=away[1] * 1.2, **init)
    assert near(freed.transformation @ se3.from_rt(np.eye(3), offset), truth), freed.reasons


@pytest.mark.parametrize("bound, word", [
    ({"max_rotation": 3.0}, "degrees from the start, beyond max_rotation=3"),
    ({"gravity": ((0, 0, 1), (0, 0.5, 1))}, "with both verticals"),
])  # fmt: skip
def test_other_bounds_tell_what_they_shut_out(demo: Any, bound: dict[str, Any], word: str) -> None:
    source, target, truth = demo
    turned = se3.from_rt(se3.yaw(8.0)[:3, :3], np.zeros(3))
    result = hr.register(source, target, init=truth @ turned, **bound)
    assert result.verdict == "failed"
    assert any("shut out" in reason and word in reason for reason in result.reasons), result.reasons


def test_what_lies_within_the_bounds_is_told_nothing_of_them(demo: Any) -> None:
    source, target, truth = demo
    result = hr.register(source, target, init=truth, max_translation=0.5, max_rotation=2.0)
    assert result.verdict == "ok"
    assert not any("shut out" in reason for reason in result.reasons)


def test_bounds_leave_one_of_two_alike_poses() -> None:
    # A square hall: four quarter turns explain it equally well, and a bound tells which is meant.
    rng = np.random.default_rng(0)
    hall = rng.uniform(-8.0, 8.0, (30_000, 3)) * [1.0, 1.0, 0.25]
    side = rng.integers(0, 6, len(hall))
    for k in range(3):
        hall[side == 2 * k, k], hall[side == 2 * k + 1, k] = -(8.0, 8.0, 2.0)[k], (8.0, 8.0, 2.0)[k]
    truth = se3.from_rt(se3.yaw(20.0)[:3, :3], np.array([0.6, -0.3, 0.1]))
    source, target = se3.apply(se3.inverse(truth), hall[::2]), hall[1::2]
    free = hr.register(source, target)
    bound = hr.register(source, target, max_rotation=40.0)
    assert free.verdict != "ok"
    assert near(bound.transformation, truth)
    assert len(bound.rivals) < len(free.rivals)
    assert bound.confidence > free.confidence
    assert any("the bounds alone tell it from another pose" in reason for reason in bound.reasons)


@pytest.mark.parametrize("gravity", ["up", (0.0, 0.0, 2.0), ((0, 0, 1), (0, 0, 1)), (0.0, 0.0, -9.81)])
def test_gravity_up(demo: Any, gravity: Any) -> None:
    source, target, truth = demo
    result = hr.register(source, target, gravity=gravity)
    assert result.verdict == "ok"
    assert near(result.transformation, truth)


def test_gravity_of_tilted_frames_is_told_and_undone(demo: Any) -> None:
    source, target, truth = demo
    S = se3.from_rt(se3.rotation_about(np.radians([70.0, 10.0, 0.0])), np.array([3.0, 1.0, 0.0]))
    G = se3.from_rt(se3.rotation_about(np.radians([0.0, 90.0, 0.0])), np.zeros(3))
    turned = se3.apply(S, source), se3.apply(G, target)
    wanted = G @ truth @ se3.inverse(S)
    result = hr.register(*turned, gravity=(S[:3, 2], G[:3, 2]))
    assert result.verdict == "ok"
    assert near(result.transformation, wanted)
    # The information lies along the target's own axes: that of the upright clouds, turned.
    upright = hr.register(source, target).information
    turn = np.kron(np.eye(2), G[:3, :3])
    assert np.allclose(
        result.information, turn @ upright @ turn.T, rtol=0.2, atol=0.05 * np.abs(upright).max()
    )
    wrong = hr.register(*turned, gravity=(S[:3, 0], G[:3, 2]))
    assert wrong.verdict == "failed"


def test_a_region_of_a_map(demo: Any) -> None:
    source, target, truth = demo
    far = target + [4_500_000.0, 300_000.0, 0.0]
    wanted = se3.from_rt(np.eye(3), np.array([4_500_000.0, 300_000.0, 0.0])) @ truth
    by_radius = hr.register(source, far, init=wanted, crop=30.0)
    assert near(by_radius.transformation, wanted)
    low, high = far.min(axis=0), far.max(axis=0)
    low[0] += 10.0
    by_box = hr.register(source, far, crop=(*low, *high))
    assert near(by_box.transformation, wanted)
    assert by_box.correspondence_set[:, 1].max() < (far[:, 0] >= low[0]).sum()
    both = hr.register(source, far, crop={"source": (-80, -80, -80, 80, 80, 80), "target": [low, high]})
    assert near(both.transformation, wanted)


def test_scale_is_estimated(demo: Any) -> None:
    source, target, truth = demo
    result = hr.register(source / 1000.0, target, scale=True)
    assert result.verdict == "ok"
    assert result.scale_verdict == "ok"
    assert result.scale == pytest.approx(1000.0, rel=0.003)
    assert near(result.transformation, truth)


@pytest.mark.parametrize(
    "wrong, word",
    [
        ({"init": np.eye(3)}, r"init: expected shape \(4, 4\)"),
        ({"init": np.diag([2.0, 2.0, 2.0, 1.0])}, "init: .*not a rotation"),
        ({"init": "nowhere.txt"}, "nowhere.txt"),
        ({"max_translation": 0.0}, "max_translation=0.0 must be a positive"),
        ({"max_translation": np.nan}, "max_translation=nan"),
        ({"max_rotation": "ten"}, "max_rotation='ten'"),
        ({"max_rotation": True}, "max_rotation=True"),
        ({"gravity": "down"}, "gravity='down' must be"),
        ({"gravity": (0, 0, 0)}, "gravity="),
        ({"gravity": (0, 1)}, "gravity="),
        ({"crop": -3.0}, "crop=-3.0"),
        ({"crop": (1, 2, 3)}, "crop="),
        ({"crop": (5, 5, 5, 1, 1, 1)}, "crop="),
        ({"crop": {"map": (0, 0, 0, 1, 1, 1)}}, "crop="),
        (
            {"crop": (900, 900, 900, 901, 901, 901)},
            r"target: crop: .* holds 0 of its \d+ points, fewer than 20",
        ),
        ({"crop": {"source": (900, 900, 900, 901, 901, 901)}}, "source: crop"),
        ({"scale": 2.0}, "scale=2.0 must be True or False"),
    ],
)
def test_what_is_no_knowledge_is_refused(demo: Any, wrong: dict[str, Any], word: str) -> None:
    source, target, _ = demo
    with pytest.raises((ValueError, FileNotFoundError), match=word):
        hr.register(source, target, **wrong)


def test_rows_of_matches_do_not_go_with_a_region(demo: Any) -> None:
    source, target, _ = demo
    pipe = hr.Pipeline(match="given", estimate="svd", voxel=0.5, prior={"crop": 100.0})
    with pytest.raises(ValueError, match="rows of points do not go with crop"):
        pipe.run(hr.Pair.of(source, target), matches=np.zeros((5, 2), dtype=int))


def test_matches_of_the_user_are_moved_along() -> None:
    pair, truth = testing.sample_pair()
    points = pair.source.points[::50]
    matches = hr.Correspondences.of(points, se3.apply(truth, points))
    pipe = hr.Pipeline(match="given", estimate="svd", refine="none", voxel=0.4, prior={"init": ROUGH @ truth})
    result = pipe.run(pair, matches=matches)
    assert near(result.transformation, truth, 0.01, 0.01)
    assert np.allclose(result.matches.source, points)


def test_a_pose_from_elsewhere_is_judged_and_not_moved(demo: Any) -> None:
    source, target, truth = demo

    def judged(T: np.ndarray) -> hr.RegistrationResult:
        result = hr.register(source, target, preset="verify", init=T)
        assert np.allclose(result.transformation, T, atol=1e-9)
        return result

    assert judged(truth).verdict == "ok"
    for metres, axis in zip((-0.6, 0.6, 0.6), np.eye(3), strict=True):
        assert judged(se3.from_rt(np.eye(3), metres * axis) @ truth).verdict != "ok"
    assert judged(se3.yaw(180.0) @ truth).verdict == "failed"
    as_they_lie = hr.register(source, target, preset="verify")
    assert np.array_equal(as_they_lie.transformation, np.eye(4))
    assert as_they_lie.verdict == "failed"


def test_it_stands_in_files_and_tables(demo: Any, tmp_path: Path) -> None:
    source, target, truth = demo
    pipe = hr.Pipeline.preset("icp").swap(
        prior={"init": truth, "max_rotation": 9, "crop": 60.0, "gravity": "up"}
    )
    pipe.save(tmp_path / "mine.toml")
    again = hr.Pipeline.load(tmp_path / "mine.toml")
    assert again == pipe
    assert near(again(source, target).transformation, truth, 3.0, 0.6)
    write_matrix(tmp_path / "start.txt", truth)
    (tmp_path / "hand.toml").write_text(
        f'[prior]\ninit = "{(tmp_path / "start.txt").as_posix()}"\nscale = false\n'
    )
    assert hr.Pipeline.load(tmp_path / "hand.toml").prior.init == pipe.prior.init
    (tmp_path / "wrong.toml").write_text("[prior]\nmax_tilt = 3\n")
    with pytest.raises(ValueError, match="max_tilt"):
        hr.Pipeline.load(tmp_path / "wrong.toml")
    from hybridreg.changes import build, parse

    assert build({"preset": "icp", **parse(["prior.max_rotation=20"])}).prior.max_rotation == 20


def test_the_command_line(demo: Any, tmp_path: Path) -> None:
    source, target, truth = demo
    write_points(tmp_path / "a.ply", source)
    write_points(tmp_path / "b.ply", target)
    (tmp_path / "start.json").write_text(json.dumps({"transformation": (ROUGH @ truth).tolist()}))
    call = ["register", str(tmp_path / "a.ply"), str(tmp_path / "b.ply")]
    told = [*call, "--init", str(tmp_path / "start.json"), "--max-translation", "4", "--max-rotation", "15"]
    done = CliRunner().invoke(
        app, [*told, "--gravity", "up", "--crop", "80", "--crop-source", "-90,-90,-9,90,90,40"]
    )
    assert done.exit_code == 0, done.output
    T = np.array([[float(x) for x in line.split()] for line in done.stdout.splitlines()[1:5]])
    assert near(T, truth)
    done = CliRunner().invoke(app, [*call, "--preset", "birdseye-gicp", "--max-rotation", "5"])
    assert done.exit_code == 3
    assert "--max-rotation 5" in done.output
    for wrong in (["--crop", "1,2"], ["--gravity", "down"], ["--max-rotation", "-3"], ["--init", "gone.txt"]):
        done = CliRunner().invoke(app, [*call, *wrong])
        assert done.exit_code == 2, wrong
        assert wrong[0] in done.stderr or wrong[1] in done.stderr


TURNED = se3.from_rt(se3.rotation_about(np.array([0.3, -1.2, 0.5])), np.array([4.0, -5.5, 0.25]))
BARE = "\n".join(" ".join(map(str, row)) for row in TURNED)


@pytest.mark.parametrize("form", FORMATS)
def test_every_pose_that_the_library_writes_is_read(tmp_path: Path, form: str) -> None:
    (tmp_path / "pose.txt").write_text(pose_text(TURNED, form) + "\n")
    np.testing.assert_allclose(Prior(init=tmp_path / "pose.txt").init, TURNED, rtol=0, atol=1e-14)


@pytest.mark.parametrize("form", FORMATS)
def test_files_of_many_poses_are_no_start(tmp_path: Path, form: str) -> None:
    for name, text in pose_files(["a", "b", "c"], np.stack([np.eye(4), TURNED, TURNED]), 0, form).items():
        path = tmp_path / Path(name).name
        path.write_text(text)
        if form in ("matrix", "cloudcompare"):
            read_pose(path)
        else:
            with pytest.raises(ValueError, match=rf"{re.escape(str(path))}: holds"):
                read_pose(path)


@pytest.mark.parametrize(
    "text",
    [
        f"# source to target\n{BARE}",
        f"Transformation matrix\n{BARE}\n",
        str(TURNED.tolist()),
        np.array2string(TURNED, precision=17),
        BARE.replace(" ", ","),
        BARE.replace(".", ",").replace(" ", ";"),
        "[" + BARE.replace(" ", ", ").replace("\n", ";\n ") + "]",
        "T = [\n" + BARE.replace(" ", ",").replace("\n", ";") + "\n];\n",
        f"# v1.0, by hand; seen from above\n{BARE.replace('.', ',').replace(' ', ';')}",
        " ".join(BARE.split()),
    ],
)
def test_other_ways_to_write_a_matrix_are_read(tmp_path: Path, text: str) -> None:
    (tmp_path / "pose.txt").write_text(text)
    np.testing.assert_allclose(read_pose(tmp_path / "pose.txt"), TURNED, rtol=0, atol=1e-14)


def test_a_matrix_of_numpy_or_json_is_read(tmp_path: Path) -> None:
    np.save(tmp_path / "T.npy", TURNED)
    (tmp_path / "T.json").write_text(json.dumps({"T": TURNED.tolist()}))
    for name in ("T.npy", "T.json"):
        np.testing.assert_array_equal(read_pose(tmp_path / name), TURNED)


@pytest.mark.parametrize(
    "text, words",
    [
        ("T: [1, 0, 0, 6]", "holds 'T:' where a number of a pose is needed; write a pose as four lines"),
        ("1.0 0 0 0\n0 1 0 0", "holds 8 numbers; write a pose"),
        ("1 2 3 0 0 14", "holds 6 numbers; where they are x y z roll pitch yaw in radians, write <origin"),
        ("1 2 3 0 0 0 9", "have the length 9, a quaternion has 1"),
        (
            "1 0 0\n0 1 0\n0 0 1\n5 6 7",
            "holds four rows of three numbers; write three rows of four, with the last row",
        ),
        ("static_transform_publisher --x 1 --yaw 2 --qw 1", "has a quaternion and --yaw; keep one of them"),
        ("static_transform_publisher --x 1 --qz 1", "have the length 1.414, a quaternion has 1"),
        ("static_transform_publisher --x one", "holds 'one' where a number of a pose is needed"),
        (
            "static_transform_publisher 1 2 3 map lidar",
            "no 6 or 7 numbers in a row; write a pose as four lines",
        ),
        ('<origin xyz="1 2"/>', "its xyz holds 2 numbers"),
        ("PK\x03\x04\x00", "is a zip archive, not a pose"),
    ],
)
def test_text_that_is_no_pose_is_refused_with_what_is_expected(tmp_path: Path, text: str, words: str) -> None:
    (tmp_path / "pose.txt").write_text(text)
    with pytest.raises(ValueError, match=re.escape(words)):
        read_pose(tmp_path / "pose.txt")


@pytest.mark.parametrize(
    "parts",
    [
        {"translation": [1, 2, 3], "rotation": [1, 0, 0, 0]},
        {"position": {"x": 1}, "orientation": {"w": 1}},
        {"R": np.eye(3).tolist(), "t": [1, 2, 3]},
    ],
)
def test_a_pose_in_parts_is_told_in_which_order_they_are_given(tmp_path: Path, parts: dict[str, Any]) -> None:
    path = tmp_path / "pose.json"
    path.write_text(json.dumps(parts))
    with pytest.raises(
        ValueError, match=r'give "T_target_source": \[x, y, z, qx, qy, qz, qw\], w last'
    ) as caught:
        read_pose(path)
    numbers = str(caught.value).split('"T_target_source": ')[1].split("]")[0]
    for word, value in zip(("qx", "qy", "qz", "qw", "x", "y", "z"), (0, 0, 0, 1, 4, 5, 6), strict=True):
        numbers = numbers.replace(word, str(value), 1)
    path.write_text(f'{{"T_target_source": {numbers}]}}')
    np.testing.assert_array_equal(read_pose(path)[:3], [[1, 0, 0, 4], [0, 1, 0, 5], [0, 0, 1, 6]])


@pytest.mark.parametrize("turned", [False, True])
def test_the_cure_for_a_translation_below_the_rotation_gives_the_pose(tmp_path: Path, turned: bool) -> None:
    # "Transpose it" gave the inverse rotation for R with t below.
    R, t = TURNED[:3, :3], TURNED[:3, 3]
    np.savetxt(tmp_path / "pose.txt", np.vstack([R.T if turned else R, t]))
    with pytest.raises(
        ValueError, match=r"at their ends; .*, as in MATLAB's affine3d, transpose the rotation"
    ):
        read_pose(tmp_path / "pose.txt")
    rows = np.loadtxt(tmp_path / "pose.txt")
    rotation = rows[:3].T if turned else rows[:3]
    np.savetxt(tmp_path / "pose.txt", np.column_stack([rotation, rows[3]]))
    np.testing.assert_allclose(read_pose(tmp_path / "pose.txt"), TURNED, rtol=0, atol=1e-12)


@pytest.mark.parametrize("ragged", [[[[1, 2], [3]], [0, 0, 0]], [{"a": 1}, 3], [[], [[]]], ([1, [2]], "x")])
def test_lists_of_anything_are_refused_in_our_words(ragged: Any) -> None:
    with pytest.raises(ValueError, match="init: expected"):
        Prior(init=ragged)


@pytest.mark.parametrize("held", ["transformation", "T_target_source", "homogeneous", "transform_matrix"])
def test_a_result_in_place_of_its_pose_is_told(held: str) -> None:
    with pytest.raises(ValueError, match=f"init: expected numbers .*; give its {held}"):
        Prior(init=SimpleNamespace(**{held: TURNED}))


@pytest.mark.parametrize(
    "held", ["matrix", "as_matrix", "to_mat", "to_homogeneous", "to_homogenous_matrix", "homogeneous_matrix"]
)
def test_a_pose_of_another_library_in_place_of_its_matrix_is_told(held: str) -> None:
    # As gtsam 4.3.0, scipy 1.17, evalio 0.6.1, roma 1.8.0 and symforce 0.12.0 call it.
    with pytest.raises(ValueError, match=rf"init: expected numbers .*; give its {held}\(\)"):
        Prior(init=SimpleNamespace(**{held: lambda: TURNED}))


def test_the_cures_for_tensors_and_matrices_of_vtk_give_the_pose() -> None:
    # Open3D 0.20.0's tensor ICP and VTK 9.7.2's vtkTransform: "give its transformation" and "give its matrix" led to
    # what was refused without a cure.
    torch = pytest.importorskip("torch")
    vtk = pytest.importorskip("vtk")
    try:
        open3d = load_open3d()
    except ImportError as error:
        pytest.skip(str(error))
    transform = vtk.vtkTransform()
    transform.SetMatrix(TURNED.ravel())
    for held in (
        torch.tensor(TURNED, requires_grad=True),
        torch.eye(4, dtype=torch.bfloat16),
        open3d.core.Tensor(TURNED),
        transform.GetMatrix(),
    ):
        with pytest.raises(ValueError, match="init: expected numbers .*; give ") as caught:
            Prior(init=held)
        cure = str(caught.value).split("; give ")[1]
        given = eval(cure if "init" in cure else f"init.{cure[4:]}", {"init": held, "numpy": np})
        expected = np.eye(4) if getattr(held, "dtype", None) is torch.bfloat16 else TURNED
        np.testing.assert_allclose(Prior(init=given).init, expected, rtol=0, atol=1e-12)
    with pytest.raises(ValueError, match="give its matrix"):
        Prior(init=transform)


def test_several_poses_in_place_of_one_are_told() -> None:
    # scipy 1.17's RigidTransform of three was to give its as_matrix(), which is three matrices, refused without a cure.
    transforms = pytest.importorskip("scipy.spatial.transform")
    if not hasattr(transforms, "RigidTransform"):
        pytest.skip("scipy is older than 1.16")
    three = transforms.RigidTransform.from_matrix(np.stack([TURNED] * 3))
    with pytest.raises(ValueError, match=r"of its 3 poses give one, such as init\[0\]\.as_matrix\(\)"):
        Prior(init=three)
    np.testing.assert_allclose(Prior(init=three[0].as_matrix()).init, TURNED, rtol=0, atol=1e-12)
    with pytest.raises(ValueError, match=r"of its 3 poses give one, such as init\[0\]"):
        Prior(init=three.as_matrix())
    with pytest.raises(ValueError, match=r"give its one pose, init\[0\]"):
        Prior(init=TURNED[None])


def test_a_dictionary_whose_attributes_are_its_entries_in_place_of_a_matrix_is_told() -> None:
    class Entries(dict[str, Any]):
        __getattr__ = dict.__getitem__  # what it lacks is a KeyError

    for held, words in ((Entries(R=np.eye(3), t=np.zeros(3)), "R, t"), (Entries(T_est=TURNED), "T_est")):
        with pytest.raises(ValueError, match=f"init: expected numbers .*; give the matrix in it, of {words}"):
            Prior(init=held)


def test_messages_and_parts_in_place_of_a_matrix_are_told() -> None:
    x, y, z, w = quaternion(TURNED[:3, :3])
    turn, place = SimpleNamespace(x=x, y=y, z=z, w=w), SimpleNamespace(x=1.0, y=2.0, z=3.0)
    pose = SimpleNamespace(position=place, orientation=turn)
    for message, words in (
        (pose, "its position"),
        (SimpleNamespace(header=0, pose=pose), "its orientation"),
        (SimpleNamespace(transform=SimpleNamespace(translation=place, rotation=turn)), "its translation"),
        ((TURNED[:3, :3], TURNED[:3, 3]), r"numpy\.column_stack\("),
        ({"T": TURNED, "error": 0.1}, "give the matrix in it, of T, error"),
    ):
        with pytest.raises(ValueError, match=f"init: expected numbers .*; .*{words}"):
            Prior(init=message)


@pytest.mark.parametrize("quoted", [False, True])
@pytest.mark.parametrize("angles", [False, True])
@pytest.mark.parametrize("named", [False, True])
def test_every_way_to_publish_a_pose_in_ros_is_read(
    tmp_path: Path, named: bool, angles: bool, quoted: bool
) -> None:
    roll, pitch, yaw = roll_pitch_yaw(TURNED[:3, :3])
    x, y, z = TURNED[:3, 3]
    turn = [yaw, pitch, roll] if angles else list(quaternion(TURNED[:3, :3]))
    names = ["x", "y", "z", *(("yaw", "pitch", "roll") if angles else ("qx", "qy", "qz", "qw"))]
    values = [repr(float(value)) for value in (x, y, z, *turn)]
    words = [word for pair in zip((f"--{each}" for each in names), values, strict=True) for word in pair]
    words = [*words, "--frame-id", "map"] if named else [*values, "map", "lidar_2", "100"]
    text = f"rosrun tf static_transform_publisher {' '.join(words)}\n"
    if quoted:  # as launch files have it, in Python and in XML
        args = str(words) if named else f'"{" ".join(words)}"'
        text = f"Node(executable='static_transform_publisher', arguments={args})"
    (tmp_path / "pose.txt").write_text(text)
    np.testing.assert_allclose(read_pose(tmp_path / "pose.txt"), TURNED, rtol=0, atol=1e-14)
    (tmp_path / "pose.txt").write_text(text + text)
    with pytest.raises(ValueError, match="holds 2 poses; keep the one from the source to the target"):
        read_pose(tmp_path / "pose.txt")


def test_what_a_published_pose_leaves_out_is_nought(tmp_path: Path) -> None:
    (tmp_path / "pose.txt").write_text("static_transform_publisher --z=1.5 --frame-id a --child-frame-id b")
    np.testing.assert_array_equal(read_pose(tmp_path / "pose.txt"), se3.from_rt(np.eye(3), [0.0, 0.0, 1.5]))


def test_a_pose_of_the_other_direction_is_not_to_be_renamed(tmp_path: Path) -> None:
    (tmp_path / "p.json").write_text(json.dumps({"T_source_target": TURNED.tolist()}))
    with pytest.raises(
        ValueError, match="its T_source_target maps target points to source points; invert it"
    ):
        read_pose(tmp_path / "p.json")


def test_json_without_a_pose_is_refused_by_its_entries(tmp_path: Path) -> None:
    (tmp_path / "p.json").write_text('{"pose": 3}')
    with pytest.raises(ValueError, match=r"has no entry T_target_source .* among 'pose'"):
        read_pose(tmp_path / "p.json")
