# SPDX-License-Identifier: MIT
"""Twenty and more odd trees of Cross3DReg's layout, read right or refused with the cure."""

from __future__ import annotations

import pickle
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import loader_trees
import numpy as np
import pytest

from hybridreg.data import Cross3DReg, open_dataset
from hybridreg.geometry import se3

Row = dict[str, Any]


@pytest.fixture(scope="session")
def written(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return loader_trees.cross3dreg(tmp_path_factory.mktemp("archive")).root


@pytest.fixture
def archive(written: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(written, tmp_path / "Cross3DReg"))


def relist(archive: Path, change: Callable[[Row], Row]) -> None:
    """Write the list again with every row changed."""
    file = archive / "metadata" / "test.pkl"
    loader_trees.write_pickle(file, [change(dict(row)) for row in pickle.loads(file.read_bytes())])


def same_pairs(pairs: Any) -> bool:
    return all(
        np.allclose(found.T_target_source, true.T_target_source)
        and np.allclose(found.pair.source.points, true.pair.source.points, atol=1e-6)
        and np.allclose(found.pair.target.points, true.pair.target.points, atol=1e-6)
        and found.pair.image is not None
        for found, true in zip(pairs, loader_trees.simulated(), strict=True)
    )


def pose(make: Callable[[np.ndarray], Any]) -> Callable[[Row], Row]:
    return lambda row: {**row, "transform": make(row["transform"])}


def tensor(T: np.ndarray) -> Any:
    import torch

    return torch.from_numpy(T)


def split_tensor(row: Row) -> Row:
    import torch

    T = row.pop("transform")
    # Of one storage, transposed: strides and offsets matter.
    return {**row, "rot": torch.from_numpy(T[:3, :3].T.copy()).t(), "trans": torch.from_numpy(T)[:3, 3]}


def files(make: Callable[[str], Any]) -> Callable[[Row], Row]:
    return lambda row: {**row, "pcd0": make(row["pcd0"]), "pcd1": make(row["pcd1"])}


def no_clouds(row: Row) -> Row:
    return {key: value for key, value in row.items() if key not in ("pcd0", "pcd1")}


READ_RIGHT = {
    "3x4": pose(lambda T: T[:3]),
    "twelve numbers": pose(lambda T: T[:3].ravel()),
    "sixteen numbers": pose(lambda T: T.ravel().tolist()),
    "one of a batch": pose(lambda T: T[None]),
    "tuples": pose(lambda T: tuple(tuple(map(float, line)) for line in T)),
    "lists of 3x4": pose(lambda T: T[:3].tolist()),
    "a tensor": pose(tensor),
    "a tensor of twelve": pose(lambda T: tensor(T)[:3].reshape(-1)),
    "rotation and translation as tensors": split_tensor,
    "bare file names": files(lambda name: name.rpartition("/")[2]),
    "bare names of another format": files(lambda name: name.rpartition("/")[2].replace(".ply", ".bin")),
    "paths below the sequence": files(lambda name: "/".join(name.split("/")[-2:])),
    "paths below sequences": files(lambda name: "/".join(name.split("/")[-3:])),
    "paths as objects of numpy": files(np.str_),
    "a sequence in words": lambda row: {**row, "seq_id": "seq_08"},
    "a sequence as a path": lambda row: {**row, "seq_id": "sequences/08"},
    "a sequence as text": lambda row: {**row, "seq_id": "08"},
    "a sequence of numpy": lambda row: {**row, "seq_id": np.int64(8)},
    "frames as text, no clouds": lambda row: no_clouds({**row, "frame0": f"{row['frame0']:06d}"}),
    "an image by its bare name": lambda row: {**row, "image": f"{row['frame1']:06d}.jpg"},
    "an image below the sequence": lambda row: {**row, "img": f"image/{row['frame1']:06d}.png"},
}


@pytest.mark.parametrize("name", READ_RIGHT)
def test_odd_lists_are_read_right(name: str, archive: Path) -> None:
    if "tensor" in name:
        pytest.importorskip("torch")
    relist(archive, READ_RIGHT[name])
    assert same_pairs(Cross3DReg(archive))


def test_sequences_with_names_are_folders_of_that_name(archive: Path) -> None:
    (archive / "sequences" / "08").rename(archive / "sequences" / "campus_east")
    relist(archive, lambda row: no_clouds({**row, "seq_id": "campus_east"}))
    pairs = Cross3DReg(archive)
    assert same_pairs(pairs)
    assert pairs.ids[0] == "campus_east/000000-000000"


def test_each_cloud_goes_by_its_own_frame_number(archive: Path) -> None:
    drive = archive / "sequences" / "08"
    for file in sorted((drive / "array").iterdir()):
        file.rename(file.with_stem(f"{int(file.stem) + 100:06d}"))
    relist(archive, lambda row: no_clouds({**row, "frame1": row["frame1"] + 100}))
    pairs = Cross3DReg(archive)
    assert same_pairs(pairs)
    assert pairs.ids[2] == "08/000102-000002"


def test_swap_makes_cloud_0_the_source(archive: Path) -> None:
    pairs = open_dataset(f"cross3dreg:{archive}#test,swap=yes")
    for found, true in zip(pairs, loader_trees.simulated(), strict=True):
        assert np.allclose(found.T_target_source, se3.inverse(true.T_target_source))
        assert np.allclose(found.pair.source.points, true.pair.target.points, atol=1e-6)
        assert found.pair.source.sensor == "lidar"


def test_a_list_with_cloud_0_as_source_and_poses_from_0_to_1(archive: Path) -> None:
    def other_way(row: Row) -> Row:
        return {**row, "pcd0": row["pcd1"], "pcd1": row["pcd0"]}

    relist(archive, other_way)  # the poses now map cloud 0, the fan, to cloud 1
    assert same_pairs(Cross3DReg(archive, swap=True, inverted=True))


REFUSED = {
    "rows without names": (lambda row: tuple(row.values()), "name its columns: seq_id"),
    "a pose of nine numbers": (pose(lambda T: T[:3, :3]), "transform"),
    "a scaled pose": (pose(lambda T: np.diag([2.0, 2.0, 2.0, 1.0]) @ T), "transform"),
    "a pose of words": (pose(lambda T: "identity"), "where a pose's numbers should be"),
    "a sequence that is none": (lambda row: {**row, "seq_id": ".."}, "name its folder"),
    "clouds that are not there": (files(lambda name: name.replace("08", "09")), "must lie at"),
    "no frames and no clouds": (
        lambda row: {"seq_id": 8, "transform": row["transform"]},
        "has none of the fields frame1",
    ),
}


@pytest.mark.parametrize("name", REFUSED)
def test_others_are_refused_with_the_cure(name: str, archive: Path) -> None:
    change, words = REFUSED[name]
    relist(archive, change)
    with pytest.raises((ValueError, FileNotFoundError), match=words):
        Cross3DReg(archive)


def test_a_tensor_that_reaches_beyond_its_numbers_is_refused(tmp_path: Path) -> None:
    torch = pytest.importorskip("torch")
    from hybridreg.data.lists.pickles import read_pickle

    whole = pickle.dumps(torch.arange(4.0), protocol=2)
    file = tmp_path / "t.pkl"
    file.write_bytes(whole)
    assert read_pickle(file).tolist() == [0.0, 1.0, 2.0, 3.0]
    # The size (4,) in the pickle's own words becomes (99,).
    assert whole.count(b"K\x04\x85") == 1
    file.write_bytes(whole.replace(b"K\x04\x85", b"K\x63\x85"))
    with pytest.raises(ValueError, match=r"t\.pkl"):
        read_pickle(file)
