# SPDX-License-Identifier: MIT
from __future__ import annotations

import re
from collections import UserList
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from hybridreg.geometry import se3

vectors = arrays(np.float64, 3, elements=st.floats(-3.1, 3.1))
seeds = st.integers(0, 2**32 - 1)


def random_motion(seed: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return se3.from_rt(se3.random_rotation(rng), rng.normal(size=3) * 50)


@given(seeds)
def test_inverse_undoes(seed: int) -> None:
    T = random_motion(seed)
    assert np.allclose(se3.inverse(T) @ T, np.eye(4), atol=1e-12)


@given(seeds, seeds)
def test_apply_composes(a: int, b: int) -> None:
    A, B = random_motion(a), random_motion(b)
    points = np.random.default_rng(a).normal(size=(7, 3))
    assert np.allclose(se3.apply(A @ B, points), se3.apply(A, se3.apply(B, points)), atol=1e-9)


@given(vectors)
def test_rotation_is_proper_and_has_the_angle_of_its_vector(vector: np.ndarray) -> None:
    R = se3.rotation_about(vector)
    assert np.allclose(R @ R.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(R) == pytest.approx(1.0)
    angle = np.degrees(np.linalg.norm(vector)) % 360
    assert se3.angle_deg(R) == pytest.approx(min(angle, 360 - angle), abs=1e-5)


@given(vectors)
def test_log_rotation_inverts(vector: np.ndarray) -> None:
    R = se3.rotation_about(vector)
    assert np.allclose(se3.rotation_about(se3.log_rotation(R)), R, atol=1e-9)


@pytest.mark.parametrize("degrees", [0.0, 1e-7, 1e-3, 0.1, 90.0, 179.9999, 180.0])
def test_angle_keeps_its_digits_at_both_ends(degrees: float) -> None:
    assert se3.angle_deg(se3.yaw(degrees)[:3, :3]) == pytest.approx(degrees, rel=1e-9, abs=1e-12)


@given(arrays(np.float64, (3, 3), elements=st.floats(-10, 10)))
def test_project_gives_a_rotation_for_any_matrix(M: np.ndarray) -> None:
    R = se3.project(M)
    assert np.allclose(R @ R.T, np.eye(3), atol=1e-9)
    assert np.linalg.det(R) == pytest.approx(1.0)


def test_project_keeps_a_rotation_and_repairs_a_drifted_one() -> None:
    R = random_motion(3)[:3, :3]
    assert np.allclose(se3.project(R), R, atol=1e-12)
    assert se3.angle_deg(se3.project(R * 1.01) @ R.T) < 1e-6


@given(seeds)
def test_random_rotation_is_proper(seed: int) -> None:
    R = se3.random_rotation(np.random.default_rng(seed))
    assert np.allclose(R @ R.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(R) == pytest.approx(1.0)


@pytest.mark.parametrize(
    "T, words",
    [
        (np.eye(3), "shape"),
        (np.full((4, 4), np.nan), "not finite"),
        (np.diag([1.0, 1.0, -1.0, 1.0]), "not a rotation"),
        (np.diag([2.0, 2.0, 2.0, 1.0]), "not a rotation"),
        (se3.from_rt(np.eye(3), np.ones(3)).T, "transposed"),
    ],
)
def test_check_refuses(T: np.ndarray, words: str) -> None:
    with pytest.raises(ValueError, match=words):
        se3.check(T, "T_target_source")


def test_exp_is_linear_near_zero() -> None:
    twist = np.array([1e-8, -2e-8, 3e-8, 0.1, 0.2, 0.3])
    T = se3.exp(twist)
    assert np.allclose(T[:3, :3], np.eye(3) + se3.skew(twist[:3]), atol=1e-14)
    assert np.allclose(T[:3, 3], twist[3:])


@given(st.lists(st.floats(-3.0, 3.0), min_size=9, max_size=9))
def test_a_turn_about_a_place_leaves_it_but_for_the_shift(numbers: list[float]) -> None:
    centre, vector, shift = np.array(numbers).reshape(3, 3)
    T = se3.about(centre, se3.rotation_about(vector), shift)
    assert np.allclose(se3.apply(T, centre[None])[0], centre + shift, atol=1e-12)
    assert np.array_equal(T[:3, :3], se3.rotation_about(vector))


@pytest.mark.parametrize(
    ("shape", "cure"),
    [
        ((3, 4), "append the row"),
        ((16,), "reshape(4, 4)"),
        ((12,), "reshape(3, 4)"),
        ((7,), "from_quat"),
        ((3, 3), "eye(4)"),
    ],
)
def test_a_pose_in_another_shape_is_told_how_to_become_a_matrix(shape: tuple[int, ...], cure: str) -> None:
    with pytest.raises(ValueError, match=f"init: expected shape .*{re.escape(cure)}"):
        se3.check(np.zeros(shape), "init")


PLANE = np.array([[0.8, -0.6, 5.0], [0.6, 0.8, -2.0], [0.0, 0.0, 1.0]])


@pytest.mark.parametrize("M", [PLANE, PLANE[:2], PLANE.astype(np.float32)])
def test_a_pose_in_the_plane_is_not_called_a_rotation(M: np.ndarray) -> None:
    # gtsam 4.3.0's Pose2.matrix(), spatialmath 1.1.18's SE2 and jaxlie 1.5.0's SE2.as_matrix() are 3x3.
    with pytest.raises(ValueError, match=r"in the plane: (.*)$") as refusal:
        se3.check(M, "init")
    told = re.search(r"in the plane: (.*)$", str(refusal.value))
    assert told is not None
    names = {"numpy": np, "init": M}
    exec(told[1], names)
    T = se3.check(names["T"], "init")
    assert np.allclose(T[:2, 3], [5.0, -2.0])
    assert np.allclose(T[:2, :2], [[0.8, -0.6], [0.6, 0.8]])


@pytest.mark.parametrize(
    "R", [np.eye(3), se3.rotation_about(np.array([0.0, 0.0, 0.3])), se3.rotation_about(np.ones(3))]
)
def test_a_rotation_alone_is_still_told(R: np.ndarray) -> None:
    with pytest.raises(ValueError, match="a rotation alone"):
        se3.check(R, "init")


@pytest.mark.parametrize(
    ("row", "words"),
    [
        ([0.0, 0.0, 0.0, 0.5], "a scale"),  # gtsam 4.3.0's Similarity3.matrix()
        ([0.0, 0.0, 0.0, 0.0], "logarithm"),  # pytransform3d 3.17.0's transform_log_from_transform
        ([1.0, 2.0, 3.0, 1.0], "transposed"),
        ([1.0, 0.0, 0.0, 0.0], "transposed"),
    ],
)
def test_a_last_row_tells_what_the_matrix_is(row: list[float], words: str) -> None:
    with pytest.raises(ValueError, match=f"last row .*{words}"):
        se3.check(np.vstack([np.eye(4)[:3], row]), "init")


@pytest.mark.parametrize(("rotation", "translation"), [("rotation", "translation"), ("R", "t")])
@pytest.mark.parametrize("shape", [(3,), (3, 1), (1, 3)])
def test_a_rotation_and_a_translation_apart_are_told_how_to_become_a_matrix(
    rotation: str, translation: str, shape: tuple[int, ...]
) -> None:
    # kiss_matcher 1.0.2's RegistrationSolution
    T = random_motion(3)
    solution = SimpleNamespace(**{rotation: T[:3, :3], translation: T[:3, 3].reshape(shape), "valid": True})
    with pytest.raises(ValueError, match="init: .*; give numpy") as refusal:
        se3.check(solution, "init")
    cure = str(refusal.value).rsplit("; give ", 1)[1]
    assert np.array_equal(se3.check(eval(cure, {"numpy": np, "init": solution}), "init"), T)


class Poses(UserList[np.ndarray]):
    # As spatialmath 1.1.18's SE3 keeps its poses: numpy is given the memory of the first.
    @property
    def __array_interface__(self) -> dict[str, Any]:
        return self.data[0].__array_interface__


def test_an_object_of_several_poses_is_not_taken_for_its_first() -> None:
    first, second = random_motion(1), random_motion(2)
    assert np.array_equal(np.asarray(Poses([first, second])), first)
    assert np.array_equal(se3.check(Poses([first]), "init"), first)
    assert np.array_equal(se3.check(UserList(first.tolist()), "init"), first)
    with pytest.raises(ValueError, match=r"init: holds 2 poses; give one pose, such as init\[0\]"):
        se3.check(Poses([first, second]), "init")
    with pytest.raises(ValueError, match="init: holds 0 poses; give one pose$"):
        se3.check(Poses(), "init")
