# SPDX-License-Identifier: MIT
"""Two clouds in, one pose out."""

from __future__ import annotations

from typing import Any, Literal

from hybridreg.geometry.viewpoint import Given
from hybridreg.pair import Gravity, Pair
from hybridreg.pipeline import Pipeline
from hybridreg.presets import DEFAULT
from hybridreg.result import RegistrationResult


def register(
    source: Any,
    target: Any,
    image: Any = None,
    *,
    preset: str = DEFAULT,
    voxel: float | None = None,
    seed: int = 0,
    nonfinite: Literal["raise", "drop"] = "raise",
    source_viewpoint: Given = "auto",
    target_viewpoint: Given = "auto",
    gravity: Gravity = "known",
) -> RegistrationResult:
    """Align two point clouds with the preset `default`, or with another preset.

    Parameters
    ----------
    source, target : path, array, table, tensor or object that holds points (`PointCloud.of`), in any mix
        Metres. The source moves, the target stays.
    image : path, (H, W[, C]) array or None
        A camera image of the common view; no calibration. Stages that use no image ignore it.
    voxel : float or None
        Metres; None derives it from the clouds' extents.
    seed : int
        Fixes every random choice.
    nonfinite : "raise" or "drop"
        What to do with missing points: not finite, masked, or, where many are, exactly at the origin (dropped, or
        reported by a warning); the number dropped is in the result's notes.
    source_viewpoint, target_viewpoint : "auto", "none", (3,), (N, 3), or ((k, 3), (N,))
        Where each sensor stood, in the coordinates of its points; see `PointCloud.of`. Give it for maps, merged clouds
        and vehicle frames: without it free space cannot be tested.
    gravity : "known" or "unknown"
        "unknown" where one cloud may be upside down; otherwise a pose that turns the world upside down is never "ok".

    Returns
    -------
    RegistrationResult
        Read `verdict` and `reasons` before `transformation`.

    Raises
    ------
    ValueError
        For input that no pose can be computed from; the message names the cloud, the number and a cure.
    FileNotFoundError
        For a path that does not exist.
    KeyError
        For a preset that does not exist.
    """
    pipeline = Pipeline.preset(preset, voxel=voxel)
    pair = Pair.of(
        source,
        target,
        image,
        nonfinite=nonfinite,
        source_viewpoint=source_viewpoint,
        target_viewpoint=target_viewpoint,
        gravity=gravity,
    )
    return pipeline.run(pair, seed=seed)
