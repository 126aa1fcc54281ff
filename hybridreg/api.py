# SPDX-License-Identifier: MIT
"""Two clouds in, one pose out."""

from __future__ import annotations

import os
from typing import Any, Literal

from hybridreg.cloud import PointCloud
from hybridreg.geometry.viewpoint import Given
from hybridreg.io.recorded.recording import Selection
from hybridreg.pair import Pair
from hybridreg.pipeline import Pipeline
from hybridreg.presets import DEFAULT, names
from hybridreg.prior.prior import Prior
from hybridreg.result import RegistrationResult


def read(
    path: str | os.PathLike[str],
    *,
    topic: str | None = None,
    index: int | None = None,
    at: float | None = None,
    accumulate: int = 1,
    nonfinite: Literal["raise", "drop"] = "raise",
    viewpoint: Given = "auto",
) -> PointCloud:
    """Read a cloud of any supported file, and choose one where it holds several.

    Parameters
    ----------
    topic : str or None
        Of a bag; None takes its only topic of clouds.
    index : int or None
        Counted from 0, negative from the end: the message of a bag, the frame of an LVX2 file, the scan of an E57 file
        (of which all are read together if it is not given).
    at : float or None
        Seconds after a bag's first message.
    accumulate : int
        So many clouds that follow one another are laid together: for a sensor that stood still.
    nonfinite, viewpoint : as for `PointCloud.of`

    Raises
    ------
    FileNotFoundError, ValueError, ImportError
        As `PointCloud.of`; a choice that the file does not offer, with those that it does; no path.
    """
    if not isinstance(path, (str, os.PathLike)):
        held = type(path).__name__
        raise ValueError(
            f"path: is a {held}, no path of a file; give it to register or PointCloud.of as it is"
        )
    select = Selection(topic=topic, index=index, at=at, accumulate=accumulate)
    return PointCloud.of(path, name=os.fspath(path), nonfinite=nonfinite, viewpoint=viewpoint, select=select)


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
    init: Any = None,
    max_translation: float | None = None,
    max_rotation: float | None = None,
    gravity: Any = "known",
    crop: Any = None,
    scale: bool = False,
) -> RegistrationResult:
    """Align two point clouds with the preset `default`, or with another preset.

    Parameters
    ----------
    source, target : path, array, table, tensor or object that holds points (`PointCloud.of`), in any mix
        Metres. The source moves, the target stays.
    image : path, (H, W[, C]) array, tensor, image of Pillow, sensor_msgs/Image, or None
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
    init : (4, 4), path of a pose in any form that `result.format` writes, in .npy or .json, or None
        A rough pose, source to target; searched around first.
    max_translation, max_rotation : float or None
        Metres that the middle of the source may lie away from where `init` (or nothing) puts it; degrees that the pose
        may turn away from it. Poses beyond are neither found nor rivals.
    gravity : "known", "unknown", "up", (3,), or ((3,), (3,))
        "unknown" where one cloud may be upside down; else a pose that turns the world upside down is never "ok". "up"
        where z points up in both clouds; a vector where another axis does (one for both, or the source's and the
        target's).
    crop : float, six numbers, mapping, or None
        What of the clouds counts: a box of the target (lowest x, y, z, then highest), `{"source": box, "target": box}`,
        or a radius around where `init` puts the source. Rows in the result count the points that are left.
    scale : bool
        Estimate the source's size too: `result.scale`, with `result.scale_verdict`.

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
    if isinstance(image, str) and image in names():
        raise ValueError(f"image: {image!r} is the name of a preset; give it as preset={image!r}")
    if isinstance(preset, Pipeline):
        raise ValueError(
            "preset: takes a name; a pipeline of your own is called: pipe(source, target); what is known "
            "beforehand it takes by pipe.swap(prior={'max_rotation': 30}), a viewpoint with its cloud: "
            "PointCloud.of(source, viewpoint=...)"
        )
    pipeline = Pipeline.preset(preset, voxel=voxel)
    prior = Prior(
        init=init,
        max_translation=max_translation,
        max_rotation=max_rotation,
        gravity=gravity,
        crop=crop,
        scale=scale,
    )
    if prior != Prior():
        pipeline = pipeline.swap(prior=prior)
    pair = Pair.of(
        source,
        target,
        image,
        nonfinite=nonfinite,
        source_viewpoint=source_viewpoint,
        target_viewpoint=target_viewpoint,
    )
    return pipeline.run(pair, seed=seed)
