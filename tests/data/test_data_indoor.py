# SPDX-License-Identifier: MIT
"""3DCSR, and 3DMatch in its two forms."""

from __future__ import annotations

import pickle
import shutil
from pathlib import Path

import loader_trees
import numpy as np
import pytest

from hybridreg.data import ThreeDCsr, ThreeDMatch, open_dataset
from hybridreg.geometry import se3


def test_kinect_is_the_source(tmp_path: Path) -> None:
    tree = loader_trees.three_dcsr(tmp_path)
    for labelled in ThreeDCsr(tree.root):
        assert labelled.pair.source.sensor == "kinect"
        listed = np.loadtxt(tree.root / labelled.pair.id / "T_gt.txt")
        assert np.allclose(labelled.T_target_source, se3.inverse(listed), atol=1e-6)


def test_parts_of_3dcsr(tmp_path: Path) -> None:
    tree = loader_trees.three_dcsr(tmp_path)
    assert len(ThreeDCsr(tree.root)) == 3
    assert ThreeDCsr(tree.root, "kinect_sfm/hard").ids == ("kinect_sfm/hard/2",)
    assert ThreeDCsr.from_text(f"{tree.root}#kinect_lidar").ids == ("kinect_lidar/scene1/pair3",)
    shutil.rmtree(tree.root / "kinect_sfm")
    assert len(ThreeDCsr(tree.root)) == 1
    with pytest.raises(FileNotFoundError, match="pairs of 3DCSR below kinect_sfm/ are missing"):
        ThreeDCsr(tree.root, "kinect_sfm")


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("", "holds 0 numbers; a pose has sixteen"),
        ("1 0 0 0\n0 1 0 0\n", "holds 8 numbers"),
        ("2 0 0 0 0 2 0 0 0 0 2 0 0 0 0 1", "remove scale"),
    ],
)
def test_poses_of_3dcsr_that_are_none(text: str, told: str, tmp_path: Path) -> None:
    tree = loader_trees.three_dcsr(tmp_path)
    (tree.root / "kinect_lidar/scene1/pair3/T_gt.txt").write_text(text)
    with pytest.raises(ValueError, match=told) as caught:
        ThreeDCsr(tree.root)
    assert "pair3" in str(caught.value)


def test_missing_pose_of_3dcsr(tmp_path: Path) -> None:
    tree = loader_trees.three_dcsr(tmp_path)
    (tree.root / "kinect_sfm/easy/1/T_gt.txt").unlink()
    with pytest.raises(FileNotFoundError, match=r"it must lie at .*kinect_sfm/easy/1/T_gt\.txt"):
        ThreeDCsr(tree.root)


def predators(root: Path) -> Path:
    """The same pairs as Predator publishes them: columns, paths from the archive's root."""
    rows = pickle.loads((root / "metadata" / "3DMatch.pkl").read_bytes())
    columns = {
        "src": [row["pcd1"] for row in rows],
        "tgt": [row["pcd0"] for row in rows],
        "rot": np.stack([row["rotation"] for row in rows]),
        "trans": np.stack([row["translation"][:, None] for row in rows]),
        "overlap": np.array([row["overlap"] for row in rows]),
    }
    shutil.rmtree(root / "metadata")
    (root / "data" / "test").rename(root / "test")
    (root / "data").rmdir()
    loader_trees.write_pickle(root / "3DMatch_info.pkl", columns)
    return root


def test_both_forms_give_the_same_pairs(tmp_path: Path) -> None:
    tree = loader_trees.three_dmatch(tmp_path)
    one = {labelled.pair.id: labelled for labelled in ThreeDMatch(tree.root)}
    two = {labelled.pair.id: labelled for labelled in open_dataset(predators(tree.root))}
    assert one.keys() == two.keys() == tree.truth.keys()
    for name, labelled in one.items():
        assert np.allclose(labelled.T_target_source, two[name].T_target_source)
        assert np.array_equal(labelled.pair.source.points, two[name].pair.source.points)
        assert labelled.overlap == two[name].overlap == 0.5


def test_lomatch_is_another_list_of_the_same_archive(tmp_path: Path) -> None:
    tree = loader_trees.three_dmatch(tmp_path)
    rows = pickle.loads((tree.root / "metadata" / "3DMatch.pkl").read_bytes())
    loader_trees.write_pickle(tree.root / "metadata" / "3DLoMatch.pkl", rows[1:])
    assert open_dataset(f"3dmatch:{tree.root}#3DLoMatch").ids == ("kitchen/3-1",)
    assert open_dataset(f"{tree.root}#part=3DLoMatch").ids == ("kitchen/3-1",)


def test_missing_list_of_3dmatch_names_both_forms(tmp_path: Path) -> None:
    tree = loader_trees.three_dmatch(tmp_path)
    with pytest.raises(FileNotFoundError, match=r"metadata/val\.pkl or .*val_info\.pkl"):
        ThreeDMatch(tree.root, "val")


def test_a_damaged_fragment_is_named(tmp_path: Path) -> None:
    tree = loader_trees.three_dmatch(tmp_path)
    file = tree.root / "data" / "test" / "kitchen" / "cloud_bin_3.pth"
    file.write_bytes(file.read_bytes()[:200])
    pairs = ThreeDMatch(tree.root)
    assert len(pairs[0].pair.source) > 0
    with pytest.raises(ValueError, match=r"cloud_bin_3\.pth"):
        pairs[1]
