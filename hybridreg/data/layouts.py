# SPDX-License-Identifier: MIT
"""Which data set a folder is, by its content."""

from __future__ import annotations

from pathlib import Path

# The most specific first: every pattern of a line must match. Cross3DReg uses KITTI's folder names.
_MARKS: tuple[tuple[str, tuple[str, ...]], ...] = (
    ("folder", ("*/meta.json",)),
    ("cross3dreg", ("metadata/*.pkl", "sequences/*/array")),
    ("cross3dreg", ("Cross3DReg/metadata/*.pkl",)),
    ("kitti", ("sequences/*/velodyne",)),
    ("kitti", ("dataset/sequences/*/velodyne",)),
    ("kitti", ("metadata/*.pkl", "downsampled")),
    ("3dmatch", ("metadata/3DMatch.pkl",)),
    ("3dmatch", ("*_info.pkl",)),
    ("3dcsr", ("kinect_lidar",)),
    ("3dcsr", ("kinect_sfm",)),
    ("tiers", ("tiers_*/*/scans",)),
    ("pandaset", ("*/lidar/poses.json", "*/lidar/*.pkl.gz")),
    ("dair-v2x", ("cooperative/data_info.json", "infrastructure-side", "vehicle-side")),
    ("dair-v2x", ("cooperative-vehicle-infrastructure/cooperative/data_info.json",)),
    ("helipr", ("Avia/velodyne", "Ouster/velodyne")),
    ("cross-lidar", ("source", "target")),
)


def layout_of(root: Path) -> str | None:
    """Name of the loader that takes a folder; None where no layout fits."""
    fitting = (name for name, marks in _MARKS if all(any(root.glob(mark)) for mark in marks))
    return next(fitting, None)
