# SPDX-License-Identifier: MIT
"""Two sensors on one drive: any folders with poses, HeLiPR, TIERS."""

from __future__ import annotations

import shutil
from pathlib import Path

import loader_trees
import numpy as np
import pytest
from loader_trees import T_CAMERA_LIDAR, relative, scan, way, write_bin, write_cloud, write_poses

from hybridreg.data import CrossLidar, HeLiPr, Tiers
from hybridreg.geometry import se3


def keyframes(root: Path) -> np.ndarray:
    """KITTI-CrossSource's form: a reconstruction of some frames in the camera's axes, against LiDAR scans."""
    poses = way(24)
    for frame in range(0, 24, 4):
        seen = se3.apply(T_CAMERA_LIDAR, scan(poses[frame], fan=True))
        write_cloud(root / "recon" / f"{frame:06d}.ply", seen)
    for frame in range(24):
        write_bin(root / "scans64" / "velodyne" / f"{frame:06d}.bin", scan(poses[frame]))
    cameras = poses @ se3.inverse(T_CAMERA_LIDAR)
    for name in ("recon", "scans64"):
        write_poses(root / name / "poses.txt", cameras)
    row = " ".join(map(str, T_CAMERA_LIDAR[:3].ravel()))
    (root / "calib.txt").write_text(f"Tr: {row}\n")
    return poses


def test_a_reconstruction_against_scans(tmp_path: Path) -> None:
    poses = keyframes(tmp_path)
    pairs = CrossLidar(tmp_path, "recon", "scans64", min_dist=5.0, target_calib="calib.txt")
    assert pairs.ids == ("recon-0/scans64-6", "recon-8/scans64-14", "recon-16/scans64-22")
    for labelled, i, j in zip(pairs, (0, 8, 16), (6, 14, 22), strict=True):
        truth = relative(poses, i, j) @ se3.inverse(T_CAMERA_LIDAR)
        assert np.allclose(labelled.T_target_source, truth, atol=1e-6)


def test_frames_of_one_number(tmp_path: Path) -> None:
    keyframes(tmp_path)
    pairs = CrossLidar.from_text(f"{tmp_path}#recon,scans64,min_dist=0,target_calib=calib.txt")
    assert pairs.ids[:2] == ("recon-0/scans64-0", "recon-4/scans64-4")
    assert len(pairs[1].pair.source) > 0


def test_a_forgotten_calibration_shows_in_the_direction_check(tmp_path: Path) -> None:
    keyframes(tmp_path)
    right = CrossLidar(tmp_path, "recon", "scans64", min_dist=0.0, target_calib="calib.txt")
    wrong = CrossLidar(tmp_path, "recon", "scans64", min_dist=0.0)
    from hybridreg.data.lists.direction import measured

    assert measured(right).as_given > 2 * measured(wrong).as_given


def test_world_to_sensor_poses_are_refused(tmp_path: Path) -> None:
    tree = loader_trees.helipr(tmp_path)
    for name in ("Avia", "Ouster"):
        file = tree.root / name / "poses.txt"
        poses = np.tile(np.eye(4), (24, 1, 1))
        poses[:, :3] = np.loadtxt(file).reshape(-1, 3, 4)
        write_poses(file, np.stack([se3.inverse(T) for T in poses]))
    with pytest.raises(ValueError, match="the poses' lines must be T_world_sensor"):
        HeLiPr(tree.root)[0]


def test_other_sensors_and_distances(tmp_path: Path) -> None:
    tree = loader_trees.helipr(tmp_path)
    pairs = HeLiPr.from_text(f"{tree.root}#Ouster,Avia,min_dist=4")
    assert pairs.ids[0] == "Ouster-0/Avia-4"
    assert pairs[0].pair.source.sensor == "Ouster"


@pytest.mark.parametrize(
    ("lost", "told"),
    [
        ("Avia", "the folder of the sensor Avia is missing; it must be the folder"),
        ("Avia/poses.txt", "the poses of the sensor Avia is missing; it must lie at"),
        ("Avia/velodyne/000003.bin", "1 of 24 clouds of the sensor Avia are missing; the first must lie at"),
    ],
)
def test_what_is_missing_is_told(lost: str, told: str, tmp_path: Path) -> None:
    tree = loader_trees.helipr(tmp_path)
    place = tree.root / lost
    shutil.rmtree(place) if place.is_dir() else place.unlink()
    with pytest.raises(FileNotFoundError, match=told) as caught:
        HeLiPr(tree.root)
    assert str(place).removesuffix(".bin") in str(caught.value)


def test_more_clouds_than_poses(tmp_path: Path) -> None:
    tree = loader_trees.helipr(tmp_path)
    file = tree.root / "Avia" / "poses.txt"
    file.write_text("".join(file.read_text().splitlines(keepends=True)[:20]))
    with pytest.raises(ValueError, match=r"20 poses, but .* has a frame 23"):
        HeLiPr(tree.root)


def test_no_pairs_is_an_error(tmp_path: Path) -> None:
    tree = loader_trees.helipr(tmp_path)
    with pytest.raises(ValueError, match="it gives no pairs"):
        HeLiPr(tree.root, min_dist=1000.0)


def test_tiers_leaves_out_09_and_what_hardly_overlaps(tmp_path: Path) -> None:
    tree = loader_trees.tiers(tmp_path)
    pairs = Tiers(tree.root)
    assert {name.partition("/")[0] for name in pairs.ids} == {"tiers_indoor06"}
    shares = [labelled.overlap for labelled in pairs]
    assert all(share is not None and share >= 0.3 for share in shares)
    least = sorted(share for share in shares if share is not None)[-1]
    assert len(Tiers(tree.root, min_overlap=least)) < len(pairs) or len(set(shares)) == 1
    assert len(list(tree.root.glob("hybridreg-overlaps-*.json"))) == 1
