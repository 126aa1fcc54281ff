# SPDX-License-Identifier: MIT
"""A pose from a command of ROS, or a line of a launch file, that publishes it: `static_transform_publisher`."""

from __future__ import annotations

import re
from itertools import groupby, pairwise

import numpy as np
from numpy.typing import NDArray

from hybridreg.io.faults import fault
from hybridreg.io.poses.pose_numbers import EXPECTED, ONE_POSE, number_of, pose_of_angles, pose_of_numbers

PUBLISHER = "static_transform_publisher"
# What each option is where it is left out, as tf2_ros has it.
_POSITION = {"x": 0.0, "y": 0.0, "z": 0.0}
_QUATERNION = {"qx": 0.0, "qy": 0.0, "qz": 0.0, "qw": 1.0}
_ANGLES = {"roll": 0.0, "pitch": 0.0, "yaw": 0.0}
_OPTIONS = (*_POSITION, *_QUATERNION, *_ANGLES)
# Numbers without options, as ROS 1 and the ROS 2 of before Humble have them: x y z yaw pitch roll, or qx qy qz qw.
_BY_ANGLES, _BY_QUATERNION = 6, 7
_QUOTES = str.maketrans("\"'=,[]", "      ")


def pose_of_publisher(text: str, name: str) -> NDArray[np.float64]:
    """The pose (4, 4) of the child in its parent's frame.

    Raises
    ------
    ValueError
        Several poses, none, or both a quaternion and angles.
    """
    words = text.translate(_QUOTES).split()
    found = {each: [b for a, b in pairwise(words) if a == f"--{each}"] for each in _OPTIONS}
    several = max(len(values) for values in found.values())
    if several > 1:
        raise fault(name, f"holds {several} poses", ONE_POSE)
    if several == 0:
        return _in_order(words, name)
    told = {each: number_of(values[0], name) for each, values in found.items() if values}
    turned = [each for each in told if each in _ANGLES]
    if turned and any(each in told for each in _QUATERNION):
        raise fault(name, f"its {PUBLISHER} has a quaternion and --{turned[0]}", "keep one of them")
    position = [told.get(each, value) for each, value in _POSITION.items()]
    if turned:
        return pose_of_angles(position, [told.get(each, value) for each, value in _ANGLES.items()])
    turn = [told.get(each, value) for each, value in _QUATERNION.items()]
    return pose_of_numbers([*position, *turn], name, ordered=True)


def _in_order(words: list[str], name: str) -> NDArray[np.float64]:
    # Frames, and in ROS 1 a period, stand behind them.
    runs = [[float(word) for word in run] for number, run in groupby(words, _is_number) if number]
    poses = [run for run in runs if len(run) in (_BY_ANGLES, _BY_QUATERNION)]
    if len(poses) != 1:
        what = (
            f"holds {len(poses)} poses"
            if poses
            else f"its {PUBLISHER} has no --x, and no 6 or 7 numbers in a row"
        )
        raise fault(name, what, ONE_POSE if poses else EXPECTED)
    numbers = poses[0]
    if len(numbers) == _BY_QUATERNION:
        return pose_of_numbers(numbers, name, ordered=True)
    return pose_of_angles(numbers[:3], numbers[:2:-1])


def _is_number(word: str) -> bool:
    return re.fullmatch(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?", word) is not None
