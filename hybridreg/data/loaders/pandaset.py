# SPDX-License-Identifier: MIT
"""PandaSet: a forward solid-state LiDAR against a spinning one on one car, with a front camera (Xiao 2021)."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from hybridreg.cloud import PointCloud
from hybridreg.data.lists import drive_splits, required_files
from hybridreg.data.lists.frame_pairs import pairs_across
from hybridreg.data.lists.frame_pickles import read_columns
from hybridreg.data.lists.listed import ListedPairs
from hybridreg.data.lists.pair_files import PairFiles
from hybridreg.geometry import se3
from hybridreg.io import check_image
from hybridreg.io.faults import fault
from hybridreg.io.structured import read_json
from hybridreg.pair import LabelledPair, Pair

Array = NDArray[np.float64]

_SPINNING, _FORWARD = 0, 1  # values of the column d
_SENSORS = {_SPINNING: "Hesai Pandar64", _FORWARD: "Hesai PandarGT"}
# Points of both sensors nearer to the sensor than this, metres, are the car's own roof.
_ROOF = 2.5


def _extrinsic(w: float, x: float, y: float, z: float, t: tuple[float, float, float]) -> Array:
    return se3.from_rt(Rotation.from_quat([x, y, z, w]).as_matrix(), np.array(t))


# `lidar/poses.json` are of the car, y forward on the ground. Where Pandar64 sits on it: estimated by us from the front
# camera's published poses and calibration in one sequence, 001, the camera's lead of 52 ms (at 8, 9 and 12 m/s) taken
# out; good to 1 degree and 5 cm. Nothing published tells it, and no other sequence was at hand to confirm it.
_CAR_PANDAR64 = se3.from_rt(
    Rotation.from_euler("zyx", [-178.15, 0.0, 0.9], degrees=True).as_matrix(), np.array([0.004, 0.83, 1.85])
)
# Of the devkit's static calibration, `front_gt`, read as PandarGT to Pandar64: so its field of view is centred on the
# car's y axis to within 1.5 degrees in sequences 001 and 002. Its height is taken on trust.
_PANDAR64_PANDARGT = _extrinsic(
    0.021475754959,
    -0.002060907279,
    0.011346781815,
    0.999702853428,
    (-0.000451118, -0.605646431, -0.301525235),
)


class PandaSet(ListedPairs):
    """Frame i of the forward PandarGT against frame j of the spinning Pandar64 and the front camera's frame i.

    Both clouds are published in one world frame, so the truth does not hang on any calibration. Each is given in its
    own sensor's frame as far as that is known; an error there moves the viewpoint (free space, up), not the truth:

    - Pandar64 in the car's frame: estimated from sequence 001 alone, by the front camera's poses and calibration, good
      to 1 degree and 5 cm. Put into its frame by that camera, its clouds of sequences 001 (one) and 002 (two) have the
      sharpest rings 0.26, 0.06 and 0.03 m off its origin, 4, 2 and 1 cm of that in height, and upright to 0.05 degrees;
      001 was taken at speed, and its points are moved to one instant.
    - PandarGT on Pandar64: the devkit's calibration, which leaves open what maps to what; the reading used centres the
      field of view (59 to 121 degrees) ahead of the car. Its height cannot be told from the clouds.

    Parameters
    ----------
    root : path
        Holds `NNN/lidar/{FF.pkl.gz,poses.json}` and perhaps `NNN/camera/front_camera/FF.jpg`, or folders of such.
    split : str
        Ours, by the sequence's number: it ends with 0 or 5 in "test", with 9 in "val", else "train"; "all" is each.
    metres : float
        j is the first frame from i on that the car took at least so far from i; the walk goes on at j.
    frames : int
        Where above 0: j = i + frames instead, and the walk goes on at j. Ten frames are a second.

    Raises
    ------
    FileNotFoundError
        Saying what is missing and where it must lie.
    ValueError
        Poses that are none, an unknown split, or no frames that fit the rule.
    """

    def __init__(
        self, root: str | os.PathLike[str], split: str = "test", metres: float = 10.0, frames: int = 0
    ) -> None:
        base = required_files.folder(Path(root), "PandaSet")
        drive_splits.check_split(split, "PandaSet")
        if frames < 0 or not metres >= 0.0:
            raise ValueError(f"frames={frames} and metres={metres} must not be negative")
        drives = sorted(
            file.parent.parent
            for depth in ("", "*/", "*/*/")
            for file in base.glob(f"{depth}lidar/poses.json")
        )
        if not drives:
            raise FileNotFoundError(f"PandaSet is missing: {base} has no NNN/lidar/poses.json")
        chosen = [
            drive
            for drive in drives
            if split in ("all", drive_splits.split_of(drive.resolve().name, without="train"))
        ]
        if not chosen:
            names = ", ".join(drive.resolve().name for drive in drives[:8])
            raise ValueError(
                f"{base}: no sequence is of the split {split!r} (there are {names}); open it with the split 'all'"
            )
        entries = [entry for drive in chosen for entry in _entries(drive, metres, frames)]
        super().__init__(entries, base)

    def read(self, index: int) -> LabelledPair:
        entry = self.entries[index]
        image: Any = entry.image  # decoded when a stage looks at it
        if image is not None:
            check_image(image)
        facts = entry.facts
        pair = Pair(
            source=_cloud(
                entry.source, _FORWARD, np.array(facts["T_sensor_world_source"]), f"{entry.id} source"
            ),
            target=_cloud(
                entry.target, _SPINNING, np.array(facts["T_sensor_world_target"]), f"{entry.id} target"
            ),
            image=image,
            id=entry.id,
            meta={
                "sequence": facts["sequence"],
                "source_frame": facts["source_frame"],
                "target_frame": facts["target_frame"],
            },
        )
        return LabelledPair(pair=pair, T_target_source=entry.T_target_source)


def _entries(drive: Path, metres: float, frames: int) -> Iterator[PairFiles]:
    car = _poses(drive / "lidar" / "poses.json")
    clouds = _frames(drive / "lidar")
    number = drive.resolve().name
    if max(clouds) >= len(car):
        raise fault(
            str(drive / "lidar" / "poses.json"), f"has {len(car)} poses, but there is a frame {max(clouds)}"
        )
    shelf = required_files.Shelf()
    for i, j in _walk(car[:, :3, 3], sorted(clouds), metres, frames):
        source = car[i] @ _CAR_PANDAR64 @ _PANDAR64_PANDARGT
        target = car[j] @ _CAR_PANDAR64
        yield PairFiles(
            id=f"{number}/{i:02d}-{j:02d}",
            source=clouds[i],
            target=clouds[j],
            image=shelf.variant(drive / "camera" / "front_camera" / f"{i:02d}.jpg", required_files.IMAGES),
            T_target_source=se3.inverse(target) @ source,
            source_sensor=_SENSORS[_FORWARD],
            target_sensor=_SENSORS[_SPINNING],
            facts={
                "sequence": number,
                "source_frame": i,
                "target_frame": j,
                "T_sensor_world_source": se3.inverse(source).tolist(),
                "T_sensor_world_target": se3.inverse(target).tolist(),
            },
        )


def _walk(places: Array, there: list[int], metres: float, frames: int) -> list[tuple[int, int]]:
    if not frames:
        return pairs_across(places, places, there, there, metres)
    pairs: list[tuple[int, int]] = []
    for i in there:
        if i + frames in there and (not pairs or i >= pairs[-1][1]):
            pairs.append((i, i + frames))
    return pairs


def _frames(folder: Path) -> dict[int, Path]:
    files = {file.name.partition(".")[0]: file for file in sorted(folder.glob("*.pkl*"))}
    found = {int(name): file for name, file in files.items() if name.isdecimal()}
    if not found:
        raise FileNotFoundError(f"PandaSet's clouds are missing: {folder} has no 00.pkl.gz")
    return found


def _poses(path: Path) -> Array:
    told = read_json(path)
    if not isinstance(told, list) or not told:
        raise fault(str(path), "is no list of poses")
    return np.stack([_pose(each, f"{path}, pose {n}") for n, each in enumerate(told)])


def _pose(told: Any, label: str) -> Array:
    try:
        position = np.array([float(told["position"][axis]) for axis in "xyz"])
        heading = np.array([float(told["heading"][axis]) for axis in "xyzw"])
    except (KeyError, TypeError, ValueError) as error:
        raise fault(label, "has no position x, y, z and heading w, x, y, z") from error
    if not np.isfinite(position).all() or not 0.9 < np.linalg.norm(heading) < 1.1:
        raise fault(label, "is not finite, or its heading is no unit quaternion")
    return se3.from_rt(Rotation.from_quat(heading).as_matrix(), position)


def _cloud(path: Path, sensor: int, T_sensor_world: Array, name: str) -> PointCloud:
    columns = read_columns(path)
    lacking = [key for key in "xyzd" if key not in columns]
    if lacking:
        raise fault(str(path), f"has no column {lacking[0]!r}; its columns are {', '.join(columns)[:200]}")
    of_sensor = np.asarray(columns["d"]) == sensor
    world = np.column_stack([np.asarray(columns[axis], dtype=np.float64)[of_sensor] for axis in "xyz"])
    points = se3.apply(T_sensor_world, world)
    points = points[~(np.linalg.norm(points, axis=1) < _ROOF)]
    if not len(points):
        raise fault(
            str(path), f"has no points of the {_SENSORS[sensor]} (d = {sensor})", "give the whole archive"
        )
    try:
        return PointCloud.of(points, name=name, sensor=_SENSORS[sensor], nonfinite="drop")
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from error
