# SPDX-License-Identifier: MIT
"""A rotation's nine numbers before three of a translation, of whatever shape: what is advised gives the pose."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from hybridreg.geometry import se3
from hybridreg.io.poses.pose_file import read_pose
from hybridreg.prior.prior import Prior

T = se3.from_rt(
    Rotation.from_euler("ZYX", [30, 10, -5], degrees=True).as_matrix(), np.array([5.0, -2.0, 0.5])
)
R, t = T[:3, :3], T[:3, 3]


@pytest.mark.parametrize("down", [False, True])
@pytest.mark.parametrize("kind", ["one row", "two rows", "json", "npy"])
def test_nine_and_three_in_a_file_are_told_and_what_is_advised_gives_the_pose(
    tmp_path: Path, kind: str, down: bool
) -> None:
    # As klampt 0.10.1 saves a RigidTransform; they were read as three rows of four, "remove scale or reflection".
    nine = (R.T if down else R).ravel()
    path = tmp_path / {"json": "pose.json", "npy": "pose.npy"}.get(kind, "pose.txt")
    if kind == "json":
        path.write_text(json.dumps({"T": [*nine, *t]}))
    elif kind == "npy":
        np.save(path, np.concatenate([nine, t]))
    else:
        words = [" ".join(map(repr, part.tolist())) for part in (nine, t)]
        path.write_text((" " if kind == "one row" else "\n").join(words))
    with pytest.raises(
        ValueError, match="nine numbers of a rotation .*; write three rows of four.* transpose"
    ):
        read_pose(path)
    rotation = nine.reshape(3, 3).T if down else nine.reshape(3, 3)
    np.savetxt(tmp_path / "cured.txt", np.column_stack([rotation, t]))
    np.testing.assert_allclose(read_pose(tmp_path / "cured.txt"), T, rtol=0, atol=1e-12)


@pytest.mark.parametrize("place", [(0.0, -1.0, 7.0), (0.0, 0.0, 0.0), (3.0, 2.0, 1.0)])
def test_three_rows_of_four_in_one_line_stay_a_pose(tmp_path: Path, place: tuple[float, ...]) -> None:
    # The first nine of the first are a rotation's too.
    pose = se3.from_rt(np.eye(3), np.array(place))
    (tmp_path / "pose.txt").write_text(" ".join(map(str, pose[:3].ravel())))
    np.testing.assert_array_equal(read_pose(tmp_path / "pose.txt"), pose)


@pytest.mark.parametrize(
    "given", [(R, t), [R.tolist(), t.tolist()], (R, t[None]), (R.ravel().tolist(), list(t))]
)
def test_the_cure_for_a_pair_of_both_gives_the_pose(given: Any) -> None:
    # Of nine numbers in a list "numpy.column_stack([R, t])" raised.
    with pytest.raises(ValueError, match="of a rotation and a translation: ") as refusal:
        Prior(init=given)
    cure, *more = str(refusal.value).split("of a rotation and a translation: ")[1].split("; ")
    assert bool(more) == (np.ndim(given[0]) == 1)  # only there may the nine run down the columns
    np.testing.assert_allclose(eval(cure, {"numpy": np, "init": given}), T, rtol=0, atol=1e-12)


def test_the_cure_for_twelve_numbers_gives_the_pose_in_either_order() -> None:
    for given, which in ((T[:3].ravel(), 0), (np.concatenate([R.ravel(), t]), 1)):
        with pytest.raises(ValueError, match="rows of R and t in turn: .* before t: ") as refusal:
            Prior(init=given)
        cure = str(refusal.value).split("; ")[1 + which].split(": ", 1)[1]
        np.testing.assert_allclose(eval(cure, {"numpy": np, "T": given}), T, rtol=0, atol=1e-12)


class Coordinates:
    """As scikit-robot 0.4.7's: `transformation` is of another one."""

    def transformation(self, c2: Any, wrt: str = "local") -> Any:
        raise AssertionError(wrt)

    def T(self) -> Any:
        return T


def test_a_method_that_asks_for_another_pose_is_no_cure() -> None:
    with pytest.raises(ValueError, match=r"; give its T\(\)$"):
        Prior(init=Coordinates())
