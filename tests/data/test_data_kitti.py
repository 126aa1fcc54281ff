# SPDX-License-Identifier: MIT
"""KITTI's protocol: published lists as they are, own lists composed on the right side, and told which."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import loader_trees
import numpy as np
import pytest
from loader_trees import Tree, relative, way

from hybridreg.data import Kitti
from hybridreg.data.lists import kitti_list
from hybridreg.data.lists.kitti_drives import Drive
from hybridreg.geometry import se3
from hybridreg.io import read_points


@pytest.fixture(scope="session")
def written(tmp_path_factory: pytest.TempPathFactory) -> Tree:
    return loader_trees.kitti(tmp_path_factory.mktemp("kitti"))


@pytest.fixture
def tree(written: Tree, tmp_path: Path) -> Tree:
    return Tree(Path(shutil.copytree(written.root, tmp_path / "dataset")), "", written.truth)


@pytest.fixture
def drifting(tree: Tree) -> Tree:
    """Its camera poses off by a decimetre and half a degree, as odometry's are."""
    rng = np.random.default_rng(4)
    for number, turn in TURNS.items():
        off = [se3.exp(np.append(rng.normal(0, 0.004, 3), rng.normal(0, 0.05, 3))) for _ in range(23)]
        cameras = way(23, turn_deg=turn) @ np.stack(off) @ se3.inverse(loader_trees.T_CAMERA_LIDAR)
        loader_trees.write_poses(tree.root / "poses" / f"{number:02d}.txt", cameras)
    return tree


TURNS = {6: 1.5, 7: -1.0}


def truth_of(number: int, source: int, target: int) -> np.ndarray:
    return relative(way(23, turn_deg=TURNS[number]), source, target)


def error(T: np.ndarray, truth: np.ndarray) -> tuple[float, float]:
    difference = se3.inverse(truth) @ T
    return se3.angle_deg(difference[:3, :3]), float(np.linalg.norm(difference[:3, 3]))


def test_odometry_is_carried_from_camera_to_lidar(tree: Tree) -> None:
    assert np.allclose(Drive(tree.root, 6).motion(0, 10), relative(way(23), 0, 10), atol=1e-7)


def test_the_folder_above_will_do(tree: Tree) -> None:
    assert Kitti(tree.root.parent, "val").ids == Kitti(tree.root, "val").ids


def test_icp_is_composed_on_the_left(drifting: Tree) -> None:
    for number, source, target in kitti_list.walk(drifting.root, "val"):
        truth = truth_of(number, source, target)
        drive = Drive(drifting.root, number)
        M = drive.motion(source, target)
        listed = kitti_list.refined(drive, source, target)
        T = np.array(listed.T)
        correction = T @ se3.inverse(M)
        rre, rte = error(T, truth)
        assert rre < 0.02
        assert rte < 0.01
        # What the lineage does with the same correction, and what it started from, are both worse.
        assert error(M @ correction, truth)[1] > 5 * rte
        assert error(M, truth)[1] > 5 * rte
        assert listed.icp_deg == pytest.approx(se3.angle_deg(correction[:3, :3]))
        assert listed.composition == "T_icp @ M"


def test_own_list_is_written_and_read_back(drifting: Tree) -> None:
    file = kitti_list.write(drifting.root, "val")
    assert json.loads(file.read_text())["composition"] == "T_icp @ M"
    pairs = Kitti(drifting.root, "val")
    assert pairs.poses == "own"  # better than the odometry that lies there too
    for labelled in pairs:
        number, source, target = (int(word) for word in labelled.pair.id.replace("/", "-").split("-"))
        assert error(labelled.T_target_source, truth_of(number, source, target))[1] < 0.01
        assert labelled.pair.meta == {"poses": "T_icp @ M"}
    assert Kitti(drifting.root, "val", "odometry").fingerprint() != pairs.fingerprint()


def test_own_list_is_the_same_on_two_workers(drifting: Tree) -> None:
    one = kitti_list.write(drifting.root, "val").read_bytes()
    assert kitti_list.write(drifting.root, "val", workers=2).read_bytes() == one


@pytest.mark.parametrize("content", ["", "{}", '{"pairs": [{"drive": 6}]}', '{"pairs": 3}'])
def test_damaged_own_list(content: str, tree: Tree) -> None:
    file = kitti_list.place(tree.root, "val")
    file.parent.mkdir()
    file.write_text(content)
    with pytest.raises(ValueError, match=r"hybridreg-val\.json: is damaged"):
        Kitti(tree.root, "val")


def test_predators_poses_are_taken_as_they_are(tree: Tree) -> None:
    (tree.root / "icp").mkdir()
    for name, T in tree.truth.items():
        number, _, frames = name.partition("/")
        np.save(tree.root / "icp" / f"{int(number)}_{frames.replace('-', '_')}.npy", T)
    pairs = Kitti(tree.root, "val")
    assert pairs.poses == "icp"
    for labelled in pairs:
        assert np.allclose(labelled.T_target_source, tree.truth[labelled.pair.id])
        assert labelled.pair.meta["poses"] == "M @ T_icp"
    (tree.root / "icp" / "6_0_10.npy").unlink()
    with pytest.raises(FileNotFoundError, match=r"must lie at .*icp/6_0_10\.npy"):
        Kitti(tree.root, "val")


def test_predators_poses_are_not_unpickled(tree: Tree) -> None:
    (tree.root / "icp").mkdir()
    np.save(tree.root / "icp" / "6_0_10.npy", np.array([{"T": 1}], dtype=object), allow_pickle=True)
    with pytest.raises(ValueError, match=r"6_0_10\.npy: cannot be read"):
        Kitti(tree.root, "val")


def test_published_list_is_not_inverted(tmp_path: Path) -> None:
    tree = loader_trees.kitti_published(tmp_path)
    pairs = Kitti(tree.root)
    assert pairs.poses == "published"
    assert pairs.entries[0].source.name == "000000.npy"  # cloud 1
    assert np.allclose(pairs[0].T_target_source, relative(way(21), 0, 9))


def test_published_list_over_kittis_own_scans(tmp_path: Path) -> None:
    tree = loader_trees.kitti_published(tmp_path)
    loader_trees.write_kitti(tree.root, 8, way(21))
    shutil.rmtree(tree.root / "downsampled")
    pairs = Kitti(tree.root)
    assert pairs.entries[0].source == tree.root / "sequences" / "08" / "velodyne" / "000000.bin"
    assert np.allclose(pairs[1].T_target_source, tree.truth["08/10-19"])


def test_the_bad_pair_is_left_out(tmp_path: Path) -> None:
    # Steps such that 15 is the first frame beyond 10 m from frame 0, and 59 the first from 15.
    steps = np.concatenate([np.full(15, 10.1 / 15), np.full(44, 10.1 / 44), np.full(20, 1.0)])
    poses = np.tile(np.eye(4), (80, 1, 1))
    poses[1:, 0, 3] = np.cumsum(steps)
    for number in (8, 9, 10):
        loader_trees.write_poses(tmp_path / "poses" / f"{number:02d}.txt", poses)
        folder = tmp_path / "sequences" / f"{number:02d}" / "velodyne"
        folder.mkdir(parents=True)
        for frame in range(80):
            (folder / f"{frame:06d}.bin").touch()
    pairs = list(kitti_list.walk(tmp_path, "test"))
    assert (9, 15, 58) in pairs
    assert (8, 15, 58) not in pairs
    assert (8, 0, 14) in pairs


def test_a_scan_too_few_is_refused(tree: Tree) -> None:
    (tree.root / "sequences" / "06" / "velodyne" / "000022.bin").unlink()
    with pytest.raises(ValueError, match="23 poses, but 22 scans numbered 0 to 21"):
        Kitti(tree.root, "val")


@pytest.mark.parametrize("lost", ["calib.txt", "velodyne"])
def test_what_odometry_needs_is_told(lost: str, tree: Tree) -> None:
    place = tree.root / "sequences" / "07" / lost
    shutil.rmtree(place) if place.is_dir() else place.unlink()
    with pytest.raises(FileNotFoundError, match=r"of KITTI's sequence 07 is missing|are missing") as caught:
        Kitti(tree.root, "val")
    assert str(place) in str(caught.value)


def test_unknown_words(tree: Tree) -> None:
    with pytest.raises(ValueError, match="split='all' must be one of train, val, test"):
        Kitti(tree.root, "all")
    with pytest.raises(ValueError, match="poses='best'"):
        Kitti(tree.root, "val", "best")
    with pytest.raises(ValueError, match="split='all'"):
        kitti_list.write(tree.root, "all")


def test_icp_on_kitti_itself(real_data: Path, tmp_path: Path) -> None:
    """From a start as wrong as KITTI's odometry, ICP comes to the pose that two other methods agree on."""
    pair = real_data / "kitti-odo-5-to-0"
    truth = np.array(json.loads((pair / "meta.json").read_text())["T_target_source"])
    off = se3.exp(np.array([0.002, -0.003, 0.004, 0.06, -0.05, 0.04]))
    poses = np.stack([np.eye(4), off @ truth])  # T_world_sensor of the target, then of the source
    for frame, name in ((0, "target"), (1, "source")):
        scan = read_points(pair / f"{name}.npz")
        loader_trees.write_bin(tmp_path / "sequences" / "06" / "velodyne" / f"{frame:06d}.bin", scan)
    loader_trees.write_poses(tmp_path / "poses" / "06.txt", poses @ se3.inverse(loader_trees.T_CAMERA_LIDAR))
    row = " ".join(map(str, loader_trees.T_CAMERA_LIDAR[:3].ravel()))
    (tmp_path / "sequences" / "06" / "calib.txt").write_text(f"Tr: {row}\n")
    listed = kitti_list.refined(Drive(tmp_path, 6), 1, 0)
    rre, rte = error(np.array(listed.T), truth)
    # The truth of that pair is good to 0.1 deg and 0.03 m.
    assert rre < 0.15
    assert rte < 0.05
