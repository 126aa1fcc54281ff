# SPDX-License-Identifier: MIT
"""Cross3DReg's archive with everything that is not known about it: names, sensors, direction, images."""

from __future__ import annotations

import pickle
import shutil
import warnings
from pathlib import Path
from typing import Any

import loader_trees
import numpy as np
import pytest

from hybridreg.data import Cross3DReg
from hybridreg.geometry import se3


@pytest.fixture(scope="session")
def written(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return loader_trees.cross3dreg(tmp_path_factory.mktemp("archive")).root


@pytest.fixture
def archive(written: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(written, tmp_path / "Cross3DReg"))


def relist(archive: Path, change: Any, split: str = "test") -> None:
    """Write the list again with every row changed."""
    rows = pickle.loads((archive / "metadata" / "test.pkl").read_bytes())
    loader_trees.write_pickle(archive / "metadata" / f"{split}.pkl", [change(dict(row)) for row in rows])


def renamed(row: dict[str, Any], **names: str) -> dict[str, Any]:
    return {names.get(key, key): value for key, value in row.items()}


def same_pairs(pairs: Cross3DReg) -> bool:
    return all(
        np.allclose(found.T_target_source, true.T_target_source)
        and np.allclose(found.pair.source.points, true.pair.source.points, atol=1e-6)
        and np.allclose(found.pair.target.points, true.pair.target.points, atol=1e-6)
        for found, true in zip(pairs, loader_trees.simulated(), strict=True)
    )


def test_expected_form(archive: Path) -> None:
    pairs = Cross3DReg(archive)
    assert same_pairs(pairs)
    assert pairs.fields == ("seq_id", "frame0", "frame1", "transform", "pcd0", "pcd1")
    assert {labelled.pair.source.sensor for labelled in pairs} == {"array"}


def test_the_folder_above_will_do(archive: Path) -> None:
    assert same_pairs(Cross3DReg(archive.parent))


@pytest.mark.parametrize(
    "names",
    [
        {"seq_id": "sequence", "pcd0": "ref", "pcd1": "src", "transform": "gt"},
        {"seq_id": "seq", "pcd0": "tgt", "pcd1": "source", "frame0": "tgt_frame", "frame1": "src_frame"},
        {"transform": "T", "pcd0": "target_path", "pcd1": "source_path"},
    ],
)
def test_fields_by_alias(names: dict[str, str], archive: Path) -> None:
    relist(archive, lambda row: renamed(row, **names))
    assert same_pairs(Cross3DReg(archive))


def test_rotation_and_translation_apart(archive: Path) -> None:
    def split(row: dict[str, Any]) -> dict[str, Any]:
        T = row.pop("transform")
        return {**row, "rot": T[:3, :3], "trans": T[:3, 3:]}

    relist(archive, split)
    assert same_pairs(Cross3DReg(archive))


def test_paths_of_the_authors_machine(archive: Path) -> None:
    def elsewhere(row: dict[str, Any]) -> dict[str, Any]:
        there = {
            "pcd0": "/home/someone/Cross3DReg/" + row["pcd0"],
            "pcd1": "D:\\data\\" + row["pcd1"].replace("/", "\\"),
        }
        return {**row, **there}

    relist(archive, elsewhere)
    assert same_pairs(Cross3DReg(archive))


def test_clouds_of_another_format(archive: Path) -> None:
    relist(archive, lambda row: {**row, "pcd0": row["pcd0"].replace(".ply", ".npy")})
    assert same_pairs(Cross3DReg(archive))


@pytest.mark.parametrize("swapped", [False, True])
def test_frames_alone_leave_the_sensors_to_geometry(swapped: bool, tmp_path: Path) -> None:
    root = loader_trees.cross3dreg(tmp_path, named=False).root
    if swapped:
        drive = root / "sequences" / "08"
        (drive / "lidar").rename(drive / "other")
        (drive / "array").rename(drive / "lidar")
        (drive / "other").rename(drive / "array")
    assert same_pairs(Cross3DReg(root))


def test_no_fan_is_told(tmp_path: Path) -> None:
    root = loader_trees.cross3dreg(tmp_path, named=False).root
    drive = root / "sequences" / "08"
    for file in (drive / "lidar").iterdir():
        shutil.copy(file, drive / "array" / file.name)
    with pytest.raises(ValueError, match=r"neither lidar nor array of .* is a fan; name the clouds"):
        Cross3DReg(root)


def test_image_goes_by_the_sources_frame(archive: Path) -> None:
    pairs = Cross3DReg(archive)
    for found, true in zip(pairs, loader_trees.simulated(), strict=True):
        assert found.pair.image is not None
        difference = np.abs(found.pair.image.astype(float) - true.pair.image)
        assert difference.mean() < 6.0  # it went through JPEG once more
    images = archive / "sequences" / "08" / "image"
    (images / "000001.jpg").rename(images / "000001.png")  # whatever it is called
    (images / "000002.jpg").unlink()
    pairs = Cross3DReg(archive)
    assert pairs[1].pair.image is not None
    assert pairs[2].pair.image is None


def test_image_of_the_target_where_the_source_has_none(archive: Path) -> None:
    drive = archive / "sequences" / "08"
    for kind in (drive / "array", drive / "image"):
        (kind / f"000001{'.ply' if kind.name == 'array' else '.jpg'}").rename(
            kind / ("000051.ply" if kind.name == "array" else "000001.jpg")
        )
    relist(archive, lambda row: {**row, "pcd1": row["pcd1"].replace("000001", "000051")})
    pairs = Cross3DReg(archive)
    assert pairs.ids[1] == "08/000051-000001"
    assert pairs.entries[1].image == drive / "image" / "000001.jpg"


def test_listed_image_wins(archive: Path) -> None:
    relist(archive, lambda row: {**row, "img": "sequences/08/image/000002.png"})
    assert {entry.image.name for entry in Cross3DReg(archive).entries if entry.image} == {"000002.jpg"}


def test_inverted_poses_are_refused_until_told(archive: Path) -> None:
    relist(archive, lambda row: {**row, "transform": se3.inverse(row["transform"])})
    with pytest.raises(ValueError, match="map target to source, open the data set with inverted=yes"):
        Cross3DReg(archive)[0]
    assert same_pairs(Cross3DReg(archive, inverted=True))
    assert same_pairs(Cross3DReg.from_text(f"{archive}#inverted=yes"))


def test_needless_inversion_is_refused_too(archive: Path) -> None:
    with pytest.raises(ValueError, match="inverted=no"):
        Cross3DReg(archive, inverted=True)[0]


def test_a_spinning_source_is_warned_of(archive: Path) -> None:
    def other_way(row: dict[str, Any]) -> dict[str, Any]:
        return {**row, "pcd0": row["pcd1"], "pcd1": row["pcd0"], "transform": se3.inverse(row["transform"])}

    with warnings.catch_warnings():
        warnings.simplefilter("error")
        Cross3DReg(archive)[0]
    relist(archive, other_way)
    with pytest.warns(UserWarning, match="source spins and its target is a fan"):
        Cross3DReg(archive)[0]


def test_missing_list_is_told(archive: Path) -> None:
    with pytest.raises(
        FileNotFoundError, match="list of the pairs of train is missing; it must lie at"
    ) as caught:
        Cross3DReg(archive, split="train")
    assert str(archive / "metadata" / "train.pkl") in str(caught.value)


def test_rows_without_what_is_needed(archive: Path) -> None:
    for lost, told in (("seq_id", "sequence"), ("pcd1", "neither|fields"), ("transform", "transform")):
        relist(
            archive, lambda row, lost=lost: {k: v for k, v in row.items() if k not in (lost, "frame1")}, "val"
        )
        with pytest.raises(ValueError, match=told) as caught:
            Cross3DReg(archive, split="val")
        assert "val.pkl, pair 0" in str(caught.value)


def test_the_same_pair_twice_is_refused(archive: Path) -> None:
    rows = pickle.loads((archive / "metadata" / "test.pkl").read_bytes())
    loader_trees.write_pickle(archive / "metadata" / "test.pkl", rows + rows[:1])
    with pytest.raises(ValueError, match="'08/000000-000000' 2 times"):
        Cross3DReg(archive)


def test_lost_clouds_are_counted(archive: Path) -> None:
    shutil.rmtree(archive / "sequences" / "08" / "lidar")
    with pytest.raises(
        FileNotFoundError, match=r"3 of 9 files that .* names are missing; the first must lie at"
    ):
        Cross3DReg(archive)
