# SPDX-License-Identifier: MIT
"""Lists of pairs, poses as text, and data sets spelled as one text."""

from __future__ import annotations

import inspect
import pickle
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hybridreg.data import Cross3DReg, Kitti, ThreeDMatch
from hybridreg.data.lists import dataset_options, pair_records, trajectories
from hybridreg.geometry import se3


def some_pose(seed: int = 0) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return se3.from_rt(se3.random_rotation(rng), rng.normal(size=3) * 10)


def written(path: Path, content: Any) -> Path:
    path.write_bytes(pickle.dumps(content))
    return path


def test_rows_and_columns_are_the_same_list(tmp_path: Path) -> None:
    poses = [some_pose(n) for n in range(3)]
    rows = [{"src": f"{n}.pth", "rot": T[:3, :3], "trans": T[:3, 3:]} for n, T in enumerate(poses)]
    columns = {key: [row[key] for row in rows] for key in rows[0]}
    wrapped = {"metadata": rows}
    for content in (rows, tuple(rows), columns, wrapped):
        read = pair_records.read_records(written(tmp_path / "list.pkl", content))
        assert [pair_records.find(row, pair_records.SOURCE) for row in read] == ["0.pth", "1.pth", "2.pth"]
        for row, T in zip(read, poses, strict=True):
            assert np.allclose(pair_records.transform_of(row, "pair"), T)


@pytest.mark.parametrize(
    ("content", "told"),
    [
        ([], "lists 0 pairs"),
        ({}, "unequal length"),
        ({"src": [], "rot": []}, "lists 0 pairs"),
        ({"src": ["a", "b"], "rot": [np.eye(3)]}, "src: 2, rot: 1"),
        ("text", "not a list of dictionaries"),
        ([1, 2], "not a list of dictionaries"),
        (None, "not a list of dictionaries"),
        ({"src": 3}, "unequal length"),
    ],
)
def test_lists_that_are_none(content: Any, told: str, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=told) as caught:
        pair_records.read_records(written(tmp_path / "test.pkl", content))
    assert "test.pkl" in str(caught.value)


def test_empty_file_is_told(tmp_path: Path) -> None:
    (tmp_path / "test.pkl").write_bytes(b"")
    with pytest.raises(ValueError, match=r"test\.pkl: is empty"):
        pair_records.read_records(tmp_path / "test.pkl")


@pytest.mark.parametrize("name", pair_records.TRANSFORM)
def test_pose_by_any_name(name: str) -> None:
    assert np.allclose(pair_records.transform_of({name: some_pose().tolist()}, "pair"), some_pose())


@pytest.mark.parametrize(
    ("record", "told"),
    [
        ({"pcd0": "a"}, "none of the fields transform"),
        ({"rot": np.eye(3)}, "none of the fields translation"),
        ({"rot": np.eye(4), "trans": np.zeros(3)}, r"shape \(4, 4\)"),
        ({"transform": np.diag([2.0, 2, 2, 1])}, "remove scale"),
        ({"transform": np.diag([1.0, 1, -1, 1])}, "determinant -1"),
        ({"transform": np.full((4, 4), np.nan)}, "not finite"),
        ({"transform": some_pose().T}, "transposed"),
    ],
)
def test_poses_that_are_none(record: dict[str, Any], told: str) -> None:
    with pytest.raises(ValueError, match=told) as caught:
        pair_records.transform_of(record, "list.pkl, pair 3")
    assert "list.pkl, pair 3" in str(caught.value)


@given(seed=st.integers(0, 50), digits=st.integers(4, 9))
def test_rounded_poses_become_rotations_again(seed: int, digits: int) -> None:
    T = some_pose(seed)
    exact = trajectories.rigid(np.round(T, digits), "pose")
    assert np.allclose(exact[:3, :3] @ exact[:3, :3].T, np.eye(3), atol=1e-12)
    assert np.allclose(exact, T, atol=2 * 10.0**-digits)


@pytest.mark.parametrize(
    ("value", "number"),
    [(8, 8), ("08", 8), (np.int64(3), 3), (8.0, 8), ("seq_10", 10), ("08/000123.ply", 123)],
)
def test_numbers_however_written(value: Any, number: int) -> None:
    assert pair_records.number({"seq": value}, pair_records.SEQUENCE, "pair") == number


@pytest.mark.parametrize(
    "value", ["", "a", None, [8], {}, -1, 8.5, 1.5e300, float("nan"), float("inf"), "9" * 40]
)
def test_numbers_that_are_none(value: Any) -> None:
    with pytest.raises(ValueError, match="pair"):
        pair_records.number({"seq": value}, pair_records.SEQUENCE, "pair")


@pytest.mark.parametrize("value", ["half", [0.5], -0.1, 1.5, float("nan")])
def test_overlaps_that_are_none(value: Any) -> None:
    with pytest.raises(ValueError, match="it is a share between 0 and 1"):
        pair_records.overlap({"overlap": value}, "pair")


JUNK = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=9) | st.binary(max_size=9),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=4), inner, max_size=3),
    max_leaves=8,
)
NAMES = ["seq_id", "frame0", "frame1", "pcd0", "pcd1", "transform", "rot", "trans", "overlap", "image"]


@pytest.mark.parametrize("loader", [Cross3DReg, Kitti, ThreeDMatch])
@given(row=st.dictionaries(st.sampled_from(NAMES), JUNK), data=st.data())
@settings(max_examples=60)
def test_rows_of_junk_are_told_as_such(loader: Any, row: dict[str, Any], data: st.DataObject) -> None:
    sound = {"seq_id": 8, "frame0": 0, "frame1": 9, "pcd0": "a.ply", "pcd1": "b.ply", "transform": np.eye(4)}
    kept = {name: value for name, value in sound.items() if data.draw(st.booleans(), label=name)}
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "metadata").mkdir()
        for split in ("test", "3DMatch"):
            written(Path(folder) / "metadata" / f"{split}.pkl", [{**row, **kept}])
        with pytest.raises((ValueError, FileNotFoundError)) as caught:
            loader(folder)
        assert folder in str(caught.value)


def test_poses_of_a_file(tmp_path: Path) -> None:
    poses = np.stack([some_pose(n) for n in range(4)])
    np.savetxt(tmp_path / "poses.txt", poses[:, :3].reshape(4, 12))
    assert np.allclose(trajectories.read_poses(tmp_path / "poses.txt"), poses)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("", "holds no pose"),
        ("1 0 0 0 0 1 0 0 0 0 1 0\n1 0 0\n", "line 2: has 3 numbers, not 12"),
        ("1 0 0 0 0 one 0 0 0 0 1 0\n", "line 1: is not all numbers"),
        ("9 0 0 0 0 1 0 0 0 0 1 0\n", "line 1: the upper left 3x3 block is not a rotation"),
        ("1 0 0 nan 0 1 0 0 0 0 1 0\n", "line 1: the matrix is not finite"),
    ],
)
def test_trajectories_that_are_none(text: str, told: str, tmp_path: Path) -> None:
    (tmp_path / "poses.txt").write_text(text)
    with pytest.raises(ValueError, match=told):
        trajectories.read_poses(tmp_path / "poses.txt")


def test_binary_trajectory_is_told(tmp_path: Path) -> None:
    (tmp_path / "poses.txt").write_bytes(b"\xff\xfe\x00\x81")
    with pytest.raises(ValueError, match="is not text"):
        trajectories.read_poses(tmp_path / "poses.txt")


def test_calibration_of_both_names_and_none(tmp_path: Path) -> None:
    T, file = some_pose(), tmp_path / "calib.txt"
    numbers = " ".join(map(str, T[:3].ravel()))
    for key in ("Tr", "Tr_velo_to_cam"):
        file.write_text(f"P0: 1 2 3\n{key}: {numbers}\n")
        assert np.allclose(trajectories.read_calibration(file), T)
    file.write_text("P0: 1 2 3\n")
    with pytest.raises(ValueError, match="no line `Tr:`"):
        trajectories.read_calibration(file)


def loader(root: str, split: str = "test", min_dist: float = 10.0, inverted: bool = False) -> None: ...


@pytest.mark.parametrize(
    ("text", "options"),
    [
        ("/data", {}),
        ("/data#", {}),
        ("/data#val", {"split": "val"}),
        ("/data#val,5", {"split": "val", "min_dist": 5.0}),
        ("/data#min-dist=2.5", {"min_dist": 2.5}),
        ("/data#inverted,train", {"split": "train", "inverted": True}),
        ("/data#inverted=no, split = train", {"split": "train", "inverted": False}),
    ],
)
def test_spelled_options(text: str, options: dict[str, Any]) -> None:
    assert dataset_options.parse(text, inspect.signature(loader)) == ("/data", options)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        (
            "/data#colour=red",
            "'colour=red' is not an option; there are split=test, min_dist=10.0, inverted=False",
        ),
        ("/data#val,5,6", "'6' is not an option"),
        ("/data#min_dist=far", "min_dist='far' must be a number such as 10.0"),
        ("/data#inverted=perhaps", "must be yes or no"),
    ],
)
def test_misspelled_options(text: str, told: str) -> None:
    with pytest.raises(ValueError, match=told):
        dataset_options.parse(text, inspect.signature(loader))


def test_a_folder_may_have_a_hash_in_its_name(tmp_path: Path) -> None:
    folder = tmp_path / "run#3"
    folder.mkdir()
    assert dataset_options.parse(str(folder), inspect.signature(loader)) == (str(folder), {})
