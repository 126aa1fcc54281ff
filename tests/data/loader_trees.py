# SPDX-License-Identifier: MIT
"""Small trees in the layout of each published data set, and the truth of every pair in them."""

from __future__ import annotations

import pickle
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hybridreg.geometry import se3
from hybridreg.io import write_points
from hybridreg.pair import LabelledPair

Array = NDArray[np.float64]

# KITTI's axes: the camera looks along z with x to the right, the LiDAR along x with z up.
T_CAMERA_LIDAR = se3.from_rt(
    np.array([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]]), np.array([-0.01, -0.08, -0.27])
)


@dataclass(frozen=True)
class Tree:
    """A tree that was written: how it is opened, and true poses by pair id."""

    root: Path
    spelled: str
    truth: dict[str, Array]


@cache
def street(seed: int = 0) -> Array:
    """Points on the walls of boxes along a way of 70 m, and on its ground."""
    rng = np.random.default_rng(seed)
    parts = [np.column_stack([rng.uniform(-25, 70, 3000), rng.uniform(-15, 15, 3000), np.full(3000, -1.7)])]
    for _ in range(60):
        centre, size = rng.uniform([-25, -15], [70, 15]), rng.uniform(0.5, 4.0, 3)
        u, v, side = rng.uniform(-0.5, 0.5, 90), rng.uniform(0, 1, 90), rng.choice([-0.5, 0.5], 90)
        flat = rng.random(90) < 0.5
        x, y = np.where(flat, u, side), np.where(flat, side, u)
        parts.append(np.column_stack([centre[0] + size[0] * x, centre[1] + size[1] * y, size[2] * v - 1.7]))
    return np.vstack(parts)


def way(n: int, step: float = 1.0, turn_deg: float = 1.5) -> Array:
    """T_world_sensor (n, 4, 4) of a curved drive."""
    poses = [np.eye(4)]
    for _ in range(n - 1):
        poses.append(poses[-1] @ se3.from_rt(se3.yaw(turn_deg)[:3, :3], np.array([step, 0.0, 0.0])))
    return np.stack(poses)


def scan(T_world_sensor: Array, reach: float = 22.0, fan: bool = False) -> Array:
    """What of the street a sensor sees, in its frame; the front alone where it is a fan."""
    points = se3.apply(se3.inverse(T_world_sensor), street())
    seen = np.linalg.norm(points, axis=1) < reach
    if fan:
        seen &= np.abs(np.degrees(np.arctan2(points[:, 1], points[:, 0]))) < 60.0
    return points[seen]


def write_bin(path: Path, points: Array) -> None:
    """KITTI's float32 x, y, z, intensity."""
    path.parent.mkdir(parents=True, exist_ok=True)
    rows = np.column_stack([points, np.linspace(0, 1, len(points))])
    path.write_bytes(rows.astype("<f4").tobytes())


def write_cloud(path: Path, points: Array) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    write_points(path, points)


def write_poses(path: Path, poses: Array) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    np.savetxt(path, poses[:, :3].reshape(-1, 12), fmt="%.9e")


def write_pickle(path: Path, content: Any, protocol: int = 4) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(pickle.dumps(content, protocol=protocol))


def write_kitti(base: Path, number: int, poses: Array) -> None:
    """One sequence of KITTI odometry: scans, camera poses, calibration."""
    folder = base / "sequences" / f"{number:02d}"
    for frame, pose in enumerate(poses):
        write_bin(folder / "velodyne" / f"{frame:06d}.bin", scan(pose))
    write_poses(base / "poses" / f"{number:02d}.txt", poses @ se3.inverse(T_CAMERA_LIDAR))
    row = " ".join(f"{value:.12e}" for value in T_CAMERA_LIDAR[:3].ravel())
    (folder / "calib.txt").write_text(f"P0: {' '.join(['0'] * 12)}\nTr: {row}\n")


def relative(poses: Array, source: int, target: int) -> Array:
    return se3.inverse(poses[target]) @ poses[source]


def kitti(root: Path) -> Tree:
    """Split val (06, 07), poses by odometry; 11 is the first frame beyond 10 m from 0, and 22 from 11."""
    truth = {}
    for number, turn in ((6, 1.5), (7, -1.0)):
        poses = way(23, turn_deg=turn)
        write_kitti(root, number, poses)
        for i, j in ((0, 10), (11, 21)):
            truth[f"{number:02d}/{i}-{j}"] = relative(poses, i, j)
    return Tree(root, f"kitti:{root}#val", truth)


def kitti_published(root: Path) -> Tree:
    """GeoTransformer's archive: clouds in `.npy`, cloud 0 the target, the transform from 1 to 0."""
    poses, rows, truth = way(21), [], {}
    for source, target in ((0, 9), (10, 19)):
        for frame in (source, target):
            file = root / "downsampled" / "08" / f"{frame:06d}.npy"
            file.parent.mkdir(parents=True, exist_ok=True)
            np.save(file, scan(poses[frame]).astype(np.float32))
        T = truth[f"08/{source}-{target}"] = relative(poses, source, target)
        names = {f"pcd{k}": f"downsampled/08/{frame:06d}.npy" for k, frame in ((0, target), (1, source))}
        rows.append({"seq_id": 8, "frame0": target, "frame1": source, "transform": T, **names})
    write_pickle(root / "metadata" / "test.pkl", rows)
    return Tree(root, f"kitti:{root}", truth)


def helipr(root: Path) -> Tree:
    """Avia and Ouster on one vehicle, half a metre apart."""
    avia = way(24)
    ouster = avia @ se3.from_rt(se3.yaw(20.0)[:3, :3], np.array([-0.5, 0.1, 0.2]))
    for name, poses in (("Avia", avia), ("Ouster", ouster)):
        for frame, pose in enumerate(poses):
            write_bin(root / name / "velodyne" / f"{frame:06d}.bin", scan(pose, fan=name == "Avia"))
        write_poses(root / name / "poses.txt", poses)
    truth = {f"Avia-{i}/Ouster-{j}": se3.inverse(ouster[j]) @ avia[i] for i, j in ((0, 11), (11, 22))}
    return Tree(root, f"helipr:{root}", truth)


def tiers(root: Path) -> Tree:
    """Two sequences, of which 09 is to be left out."""
    poses = way(6, step=1.1)
    for number in ("06", "09"):
        for sensor in ("vel16", "os0_128"):
            for frame, pose in enumerate(poses):
                place = root / f"tiers_indoor{number}" / sensor / "scans" / f"{frame:06d}.pcd"
                write_cloud(place, scan(pose, reach=12.0))
            write_poses(root / f"tiers_indoor{number}" / sensor / "poses_kitti.txt", poses)
    truth = {f"tiers_indoor06/vel16-{i}/os0_128-{i + 2}": relative(poses, i, i + 2) for i in (0, 2)}
    return Tree(root, f"tiers:{root}", truth)


def three_dcsr(root: Path) -> Tree:
    """One pair with a LiDAR, one of each difficulty with SfM; T_gt maps the other sensor to Kinect."""
    poses, truth = way(4), {}
    for n, place in enumerate(("kinect_lidar/scene1/pair3", "kinect_sfm/easy/1", "kinect_sfm/hard/2")):
        folder, other = root / place, "lidar" if "lidar" in place else "sfm"
        write_cloud(folder / "kinect.ply", scan(poses[n], reach=9.0))
        write_cloud(folder / f"{other}.ply", scan(poses[n + 1], reach=12.0))
        truth[place] = relative(poses, n, n + 1)
        np.savetxt(folder / "T_gt.txt", se3.inverse(truth[place]), fmt="%.8f")
    return Tree(root, f"3dcsr:{root}", truth)


def three_dmatch(root: Path) -> Tree:
    """GeoTransformer's archive: fragments that PyTorch saved."""
    import torch

    poses, rows, truth = way(4), [], {}
    for n, pose in enumerate(poses):
        file = root / "data" / "test" / "kitchen" / f"cloud_bin_{n}.pth"
        file.parent.mkdir(parents=True, exist_ok=True)
        torch.save(scan(pose, reach=10.0).astype(np.float32), file)
    for target, source in ((0, 1), (1, 3)):
        T = truth[f"kitchen/{source}-{target}"] = relative(poses, source, target)
        names = {f"pcd{k}": f"test/kitchen/cloud_bin_{n}.pth" for k, n in ((0, target), (1, source))}
        ids = {"scene_name": "kitchen", "frag_id0": target, "frag_id1": source, "overlap": 0.5}
        rows.append({**ids, **names, "rotation": T[:3, :3], "translation": T[:3, 3]})
    write_pickle(root / "metadata" / "3DMatch.pkl", rows)
    return Tree(root, f"3dmatch:{root}", truth)


@cache
def simulated(n: int = 3) -> tuple[LabelledPair, ...]:
    """A fan and a spinning LiDAR with a camera image."""
    from hybridreg.data import simulate

    return tuple(simulate.pair("near", seed=3, index=k, voxel=0.4) for k in range(n))


def cross3dreg(root: Path, inverted: bool = False, named: bool = True) -> Tree:
    """The archive's folders with simulated pairs; `named` tells whether the list names the clouds."""
    import cv2

    rows, truth = [], {}
    for frame, labelled in enumerate(simulated()):
        pair, folder = labelled.pair, root / "sequences" / "08"
        write_cloud(folder / "lidar" / f"{frame:06d}.ply", pair.target.points)
        write_cloud(folder / "array" / f"{frame:06d}.ply", pair.source.points)
        (folder / "image").mkdir(exist_ok=True)
        assert pair.image is not None
        cv2.imwrite(str(folder / "image" / f"{frame:06d}.jpg"), pair.image[..., ::-1])
        T = truth[f"08/{frame:06d}-{frame:06d}"] = labelled.T_target_source
        listed = se3.inverse(T) if inverted else T
        clouds = {"pcd0": "lidar", "pcd1": "array"} if named else {}
        names = {key: f"sequences/08/{sensor}/{frame:06d}.ply" for key, sensor in clouds.items()}
        rows.append({"seq_id": 8, "frame0": frame, "frame1": frame, "transform": listed, **names})
    write_pickle(root / "metadata" / "test.pkl", rows)
    return Tree(root, f"cross3dreg:{root}", truth)


ALL: dict[str, Callable[[Path], Tree]] = {
    "kitti": kitti,
    "kitti-published": kitti_published,
    "helipr": helipr,
    "tiers": tiers,
    "3dcsr": three_dcsr,
    "3dmatch": three_dmatch,
    "cross3dreg": cross3dreg,
}
