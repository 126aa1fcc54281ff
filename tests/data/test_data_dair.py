# SPDX-License-Identifier: MIT
"""DAIR-V2X's layout: roadside against car, by way of the world."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from loader_trees import relative, scan, way, write_cloud

from hybridreg.data import DairV2x, open_dataset
from hybridreg.geometry import se3

MAP = np.array([430_000.0, 4_420_000.0, 20.0])  # as far off as real world coordinates are


def told(T: np.ndarray) -> dict[str, Any]:
    return {"rotation": T[:3, :3].tolist(), "translation": T[:3, 3:].tolist()}


def write_json(path: Path, content: Any) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(content))


def make(
    base: Path, *, offset: tuple[float, float] = (0.3, -0.2), named: bool = False
) -> dict[str, np.ndarray]:
    """Four pairs of two drives; the roadside's calibration is wrong by what the offset makes good."""
    import cv2

    poses, rows, frames, truth = way(8), [], [], {}
    for n in range(4):
        road, car = f"{100 + n:06d}", f"{15000 + n:06d}"
        world = np.eye(4)
        world[:3, 3] = MAP
        road_pose, car_pose = world @ poses[n], world @ poses[n + 3]
        write_cloud(base / "infrastructure-side" / "velodyne" / f"{road}.pcd", scan(poses[n], fan=True))
        write_cloud(base / "vehicle-side" / "velodyne" / f"{car}.pcd", scan(poses[n + 3]))
        (base / "infrastructure-side" / "image").mkdir(exist_ok=True)
        cv2.imwrite(
            str(base / "infrastructure-side" / "image" / f"{road}.jpg"), np.full((9, 16, 3), 90, np.uint8)
        )
        shifted = road_pose.copy()
        shifted[:2, 3] -= offset
        write_json(
            base / "infrastructure-side" / "calib" / "virtuallidar_to_world" / f"{road}.json", told(shifted)
        )
        mount = se3.from_rt(se3.yaw(30.0)[:3, :3], np.array([0.5, 0.0, 1.2]))
        calib = base / "vehicle-side" / "calib"
        write_json(calib / "lidar_to_novatel" / f"{car}.json", {"transform": told(mount)})
        write_json(calib / "novatel_to_world" / f"{car}.json", told(car_pose @ se3.inverse(mount)))
        names = {"infrastructure_frame": road, "vehicle_frame": car}
        paths = {
            "infrastructure_pointcloud_path": f"infrastructure-side/velodyne/{road}.pcd",
            "vehicle_pointcloud_path": f"vehicle-side/velodyne/{car}.pcd",
        }
        moved = {"system_error_offset": {"delta_x": offset[0], "delta_y": offset[1]}}
        rows.append({**(names if named else paths), **moved})
        frames.append({"pointcloud_path": f"velodyne/{car}.pcd", "batch_id": str(n // 2 + 4)})
        truth[f"{road}-{car}"] = relative(poses, n, n + 3)
    write_json(base / "cooperative" / "data_info.json", rows)
    write_json(base / "vehicle-side" / "data_info.json", frames)
    return truth


@pytest.mark.parametrize("named", [False, True])
def test_poses_go_by_the_world_and_the_offset(named: bool, tmp_path: Path) -> None:
    truth = make(tmp_path / "cooperative-vehicle-infrastructure", named=named)
    pairs = DairV2x(tmp_path, "all")
    assert dict(zip(pairs.ids, range(4), strict=True)).keys() == truth.keys()
    for labelled in pairs:
        assert np.allclose(labelled.T_target_source, truth[labelled.pair.id], atol=1e-6)
        assert labelled.pair.has_image
        assert labelled.pair.source.sensor.startswith("300-line")


def test_the_split_goes_by_the_cars_drive(tmp_path: Path) -> None:
    truth = make(tmp_path)
    assert DairV2x(tmp_path).ids == tuple(truth)[2:]  # drive 5
    assert DairV2x(tmp_path, "train").ids == tuple(truth)[:2]
    with pytest.raises(ValueError, match="it gives no pairs"):
        DairV2x(tmp_path, "val")
    with pytest.raises(ValueError, match="split='dev'"):
        DairV2x(tmp_path, "dev")
    (tmp_path / "vehicle-side" / "data_info.json").unlink()
    with pytest.raises(FileNotFoundError, match="which the split goes by"):
        DairV2x(tmp_path)
    assert len(DairV2x(tmp_path, "all")) == 4


def test_it_is_known_by_its_folders_and_by_name(tmp_path: Path) -> None:
    make(tmp_path)
    assert type(open_dataset(tmp_path)).__name__ == "DairV2x"
    assert len(open_dataset(f"dair-v2x:{tmp_path}#all,distance=3.01")) == 4
    with pytest.raises(ValueError, match="it gives no pairs"):
        open_dataset(f"dair-v2x:{tmp_path}#all,distance=1")


@pytest.mark.parametrize(
    ("file", "content", "words"),
    [
        ("cooperative/data_info.json", [], "lists 0 pairs"),
        ("cooperative/data_info.json", {"a": 1}, "is no list of pairs"),
        (
            "cooperative/data_info.json",
            [{"vehicle_frame": "015000"}],
            "has no infrastructure_pointcloud_path",
        ),
        ("vehicle-side/calib/novatel_to_world/015000.json", {"rotation": [1, 2]}, "has no rotation of nine"),
        ("vehicle-side/calib/novatel_to_world/015000.json", told(2.0 * np.eye(4)), "015000.json"),
    ],
)
def test_what_is_none_is_named(file: str, content: Any, words: str, tmp_path: Path) -> None:
    make(tmp_path)
    write_json(tmp_path / file, content)
    with pytest.raises(ValueError, match=words):
        DairV2x(tmp_path, "all")


def test_what_is_missing_is_told(tmp_path: Path) -> None:
    make(tmp_path)
    (tmp_path / "vehicle-side" / "velodyne" / "015002.pcd").unlink()
    with pytest.raises(FileNotFoundError, match=r"1 of 12 files .* are missing.*015002\.pcd"):
        DairV2x(tmp_path, "all")
    (tmp_path / "infrastructure-side" / "calib" / "virtuallidar_to_world" / "000101.json").unlink()
    with pytest.raises(FileNotFoundError, match="a calibration of DAIR-V2X is missing"):
        DairV2x(tmp_path, "all")
