# SPDX-License-Identifier: MIT
"""PandaSet's layout: sensors told apart, each in its frame, and no pickle runs what it carries."""

from __future__ import annotations

import gzip
import json
import os
import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pandaset_trees
import pytest

from hybridreg.data import open_dataset
from hybridreg.data.lists import direction
from hybridreg.data.lists.azimuth import coverage
from hybridreg.data.lists.drive_splits import split_of
from hybridreg.data.lists.frame_pickles import read_columns
from hybridreg.data.loaders import pandaset
from hybridreg.data.loaders.folder import load_pair
from hybridreg.data.loaders.pandaset import PandaSet
from hybridreg.geometry import se3


@pytest.fixture(scope="module")
def tree(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Any]:
    root = tmp_path_factory.mktemp("pandaset")
    return root, pandaset_trees.write(root, pack=pandaset_trees.by_old_pandas)


def test_the_forward_sensor_is_the_source_and_the_spinning_one_the_target(tree: tuple[Path, Any]) -> None:
    root, _ = tree
    pairs = open_dataset(f"pandaset:{root}")
    assert pairs.ids == ("005/00-11",)  # type: ignore[attr-defined]
    pair = pairs[0].pair
    assert (pair.source.sensor, pair.target.sensor) == ("Hesai PandarGT", "Hesai Pandar64")
    assert coverage(pair.source.points).role == "limited"
    assert coverage(pair.target.points).role == "spinning"
    # The forward sensor looks along its own y, and stands ahead of the spinning one and below it.
    assert abs(np.median(pair.source.points[:, 0])) < 5.0
    assert np.median(pair.source.points[:, 1]) > 8.0
    assert pair.image is not None
    assert pair.image.shape == (54, 96, 3)
    assert abs(float(pair.image.mean())) < 1.0  # frame 0's
    assert pair.meta["target_frame"] == 11


def test_the_pose_is_the_published_worlds(tree: tuple[Path, Any]) -> None:
    root, car = tree
    labelled = PandaSet(root)[0]
    found = direction.overlap(labelled, 0.05), direction.overlap(labelled, 0.05, inverted=True)
    assert found[0] > 0.5
    assert found[1] < 0.1
    moved = np.linalg.norm(car[11][:3, 3] - car[0][:3, 3])
    assert np.linalg.norm(labelled.T_target_source[:3, 3]) == pytest.approx(moved, abs=0.8)
    assert se3.angle_deg(labelled.T_target_source[:3, :3]) > 150.0


def test_the_own_roof_is_dropped(tree: tuple[Path, Any]) -> None:
    root, car = tree
    target = PandaSet(root)[0].pair.target.points
    assert np.linalg.norm(target, axis=1).min() >= 2.5
    columns = read_columns(root / "005" / "lidar" / "11.pkl.gz")
    spinning = columns["d"] == 0
    world = np.column_stack([columns[axis] for axis in "xyz"])[spinning]
    sensor = se3.inverse(car[11] @ pandaset._CAR_PANDAR64)
    near = np.linalg.norm(se3.apply(sensor, world), axis=1) < 2.5
    assert near.sum() >= 5
    assert len(target) == (~near).sum()


def test_pairs_by_frames_or_metres(tree: tuple[Path, Any]) -> None:
    root, _ = tree
    assert PandaSet(root, frames=3).ids == ("005/00-03", "005/03-06", "005/06-09", "005/09-12")
    assert PandaSet(root, metres=5.0).ids == ("005/00-06", "005/06-12")
    assert len(PandaSet(root, metres=0.0)) == 14
    with pytest.raises(ValueError, match="it gives no pairs"):
        PandaSet(root, metres=500.0)
    with pytest.raises(ValueError, match="frames=-1"):
        PandaSet(root, frames=-1)


def test_the_split_goes_by_the_sequences_number(tree: tuple[Path, Any], tmp_path: Path) -> None:
    root, _ = tree
    names = [f"{n:03d}" for n in range(1, 125)]
    counts = {split: sum(split_of(name) == split for name in names) for split in ("train", "val", "test")}
    assert counts == {"train": 88, "val": 12, "test": 24}
    with pytest.raises(ValueError, match="no sequence is of the split 'val' .*005"):
        PandaSet(root, "val")
    with pytest.raises(ValueError, match="split='dev'"):
        PandaSet(root, "dev")
    assert open_dataset(f"pandaset:{root}#all,frames=3").ids[0] == "005/00-03"  # type: ignore[attr-defined]
    assert PandaSet(root / "005", frames=3).ids[:1] == ("005/00-03",)
    (tmp_path / "pandaset_1").symlink_to(root)  # the archive comes in several folders
    assert PandaSet(tmp_path, frames=3).ids[:1] == ("005/00-03",)


def test_a_folder_of_that_layout_is_known_by_itself(tree: tuple[Path, Any]) -> None:
    assert type(open_dataset(tree[0])).__name__ == "PandaSet"


def test_pandas_of_today_and_of_2020_read_alike(tmp_path: Path) -> None:
    pytest.importorskip("pandas")
    columns = pandaset_trees.columns_of(np.eye(4))
    for name, pack in (("new", pandaset_trees.by_pandas), ("old", pandaset_trees.by_old_pandas)):
        file = tmp_path / f"{name}.pkl.gz"
        file.write_bytes(gzip.compress(pack(columns)))
        read = read_columns(file)
        assert set(read) == set(columns)
        for key, value in columns.items():
            assert np.array_equal(read[key], value), (name, key)


class Rude:
    """What a stranger may put into a pickle."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def __reduce__(self) -> Any:
        return os.mkdir, (str(self.path),)


def test_a_strangers_pickle_runs_nothing(tree: tuple[Path, Any], tmp_path: Path) -> None:
    file = tmp_path / "00.pkl.gz"
    file.write_bytes(gzip.compress(pickle.dumps(Rude(tmp_path / "made"))))
    with pytest.raises(ValueError, match=r"asks for (posix|nt)\.mkdir"):
        read_columns(file)
    assert not (tmp_path / "made").exists()


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"", "ends in the middle"),
        (gzip.compress(b"x" * 100)[:-4], "ends in the middle"),
        (gzip.compress(b"no pickle"), "pickle"),
        (gzip.compress(pickle.dumps({"x": 1})), "no pandas DataFrame"),
        (b"\x80\x04K\x01.", "gzip"),
    ],
    ids=["empty", "cut", "text", "another type", "not compressed"],
)
def test_damaged_frames_are_named(content: bytes, words: str, tmp_path: Path) -> None:
    file = tmp_path / "07.pkl.gz"
    file.write_bytes(content)
    with pytest.raises(ValueError, match=words) as caught:
        read_columns(file)
    assert "07.pkl.gz" in str(caught.value)


def test_what_is_missing_is_told(tree: tuple[Path, Any], tmp_path: Path) -> None:
    root = tmp_path / "set"
    pandaset_trees.write(root, n=12, pack=pandaset_trees.by_old_pandas)
    poses = root / "005" / "lidar" / "poses.json"
    told = json.loads(poses.read_text())
    poses.write_text(json.dumps(told[:5]))
    with pytest.raises(ValueError, match="has 5 poses, but there is a frame 11"):
        PandaSet(root)
    poses.write_text(json.dumps([{"position": {"x": 0}}] * 12))
    with pytest.raises(ValueError, match=r"poses\.json, pose 0: has no position"):
        PandaSet(root)
    poses.unlink()
    with pytest.raises(FileNotFoundError, match="has no NNN/lidar/poses.json"):
        PandaSet(root)
    poses.write_text(json.dumps(told))
    one_sensor = {key: value[:50] for key, value in pandaset_trees.columns_of(np.eye(4)).items()}
    (root / "005" / "lidar" / "00.pkl.gz").write_bytes(
        gzip.compress(pandaset_trees.by_old_pandas(one_sensor))
    )
    with pytest.raises(ValueError, match=r"no points of the Hesai PandarGT \(d = 1\)"):
        PandaSet(root)[0]
    del one_sensor["t"]
    (root / "005" / "lidar" / "00.pkl.gz").write_bytes(
        gzip.compress(pandaset_trees.by_old_pandas({**{k: v for k, v in one_sensor.items() if k != "x"}}))
    )
    with pytest.raises(ValueError, match="has no column 'x'"):
        PandaSet(root)[0]


def test_an_image_that_is_not_there_is_none(tree: tuple[Path, Any], tmp_path: Path) -> None:
    pandaset_trees.write(tmp_path, n=12, pack=pandaset_trees.by_old_pandas)
    (tmp_path / "005" / "camera" / "front_camera" / "00.jpg").unlink()
    assert PandaSet(tmp_path)[0].pair.image is None


def rings(points: np.ndarray, eye: np.ndarray) -> float:
    """How sharply the points lie on cones about the z axis through `eye`, as the beams of a spinning sensor do."""
    away = points - eye
    elevation = np.degrees(np.arctan2(away[:, 2], np.hypot(away[:, 0], away[:, 1])))
    counts, _ = np.histogram(elevation, bins=np.arange(-26.0, 16.0, 0.04))
    return float((counts.astype(float) ** 2).sum()) / len(points) ** 2


@pytest.mark.parametrize("name", ["001-gt-to-p64", "002-gt-to-p64", "002-gt60-to-p64-00"])
def test_the_sensors_stand_where_the_real_pairs_show_them(real_data: Path, name: str) -> None:
    labelled = load_pair(real_data / f"pandaset-{name}")
    if "60" not in name:  # one sweep: the pose is the extrinsic
        np.testing.assert_allclose(labelled.T_target_source, pandaset._PANDAR64_PANDARGT, atol=1e-6)
    points = labelled.pair.target.points
    near = points[(labelled.pair.target.radii > 3.0) & (labelled.pair.target.radii < 25.0)]
    here = rings(near, np.zeros(3))
    assert here > 1.3 * max(rings(near, np.array([0.0, 0.0, z])) for z in (-0.3, 0.3))
    if name.startswith("002"):  # 001 was taken at speed: its sensor moved by most of a metre in a sweep
        assert here > max(rings(near, np.array([x, y, 0.0])) for x in (-0.4, 0.4) for y in (-0.4, 0.4))
    forward = labelled.pair.source.points
    view = np.degrees(np.arctan2(forward[:, 1], forward[:, 0]))
    low, high = np.quantile(view, [0.01, 0.99])
    assert (low + high) / 2.0 == pytest.approx(90.0, abs=1.5)
    assert coverage(forward).role == "limited"
