# SPDX-License-Identifier: MIT
"""Two clouds to align, without and with their true pose."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from hybridreg.cloud import PointCloud
from hybridreg.geometry import se3
from hybridreg.geometry.placement import Placement
from hybridreg.geometry.pose_bounds import PoseBounds
from hybridreg.geometry.viewpoint import Given
from hybridreg.io.camera_image import CameraImage

Array = NDArray[np.float64]
Gravity = Literal["known", "unknown"]

# Rows and columns of a grey image, at least: a pose or points in its place would pass for a small one.
_FEWEST_PIXELS = 8
_ELSEWHERE = (
    "a rough pose is given as init=, a preset by its name as preset=, and a pipeline of your own is called: "
    "pipe(source, target)"
)


@dataclass(frozen=True, eq=False, kw_only=True)
class Pair:
    """What a pipeline receives. It has no field for the true pose, so that no stage can see it.

    Attributes
    ----------
    source, target : PointCloud
        The source moves, the target stays.
    image : (H, W, 3) uint8 or None
        A camera image of the common view, uncalibrated, RGB. Given as a path, it is decoded on first access;
        `has_image` does not decode it.
    id : str
        Seeds the pair's random generator together with the run's seed.
    meta : mapping
        Anything that reports should show. Never the pose.
    gravity : "known" or "unknown"
        "known": both clouds have the same side of the ground up, so that a pose that turns the world upside down is
        wrong. "unknown": they may not (an object that was turned over between two scans).
    placed : Placement or None
        Where the clouds were put before the search (`hybridreg.prior`); results are told in the user's coordinates.
    bounds : PoseBounds or None
        Which poses are possible at all.
    drawn : bool
        Walls and floor were drawn into both flat scans (`hybridreg.flat_scans`).
    """

    source: PointCloud
    target: PointCloud
    image: NDArray[np.uint8] | None = CameraImage()  # type: ignore[assignment]  # noqa: RUF009
    id: str = "pair"
    meta: Mapping[str, Any] = field(default_factory=dict)
    gravity: Gravity = "known"
    placed: Placement | None = None
    bounds: PoseBounds | None = None
    drawn: bool = False

    def allows(self, T: Array) -> bool:
        """Whether a pose (4, 4) between the clouds' frames lies within the bounds, where there are some."""
        return self.bounds is None or self.bounds.allow(T)

    def with_clouds(self, source: PointCloud, target: PointCloud) -> Pair:
        """The same pair with other clouds."""
        return self.replaced(source=source, target=target)

    def replaced(self, **changes: Any) -> Pair:
        """The same pair with some fields changed; an image that was not decoded yet stays undecoded."""
        return replace(self, **{"image": CameraImage.held_by(self), **changes})

    @property
    def has_image(self) -> bool:
        """Whether there is an image."""
        return CameraImage.held_by(self) is not None

    @classmethod
    def of(
        cls,
        source: Any,
        target: Any,
        image: Any = None,
        *,
        id: str = "pair",
        meta: Mapping[str, Any] | None = None,
        nonfinite: Literal["raise", "drop"] = "raise",
        source_viewpoint: Given = "auto",
        target_viewpoint: Given = "auto",
        gravity: Gravity = "known",
    ) -> Pair:
        """Build a pair from anything `PointCloud.of` takes, and a path or what `hybridreg.io.as_image` takes."""
        if gravity not in ("known", "unknown"):
            raise ValueError(f'gravity={gravity!r} must be "known" or "unknown"')
        return cls(
            source=PointCloud.of(source, name="source", nonfinite=nonfinite, viewpoint=source_viewpoint),
            target=PointCloud.of(target, name="target", nonfinite=nonfinite, viewpoint=target_viewpoint),
            image=None if image is None else _image(image),
            id=id,
            meta=dict(meta or {}),
            gravity=gravity,
        )


@dataclass(frozen=True, eq=False, kw_only=True)
class LabelledPair:
    """A pair with its true pose: for training and evaluation only.

    Attributes
    ----------
    pair : Pair
    T_target_source : (4, 4) float64
        Maps source points, as the user gave them, to target points.
    overlap : float or None
        Share of source points that the target's sensor saw too, where the data set gives it.
    """

    pair: Pair
    T_target_source: Array
    overlap: float | None = None

    def __post_init__(self) -> None:
        se3.check(self.T_target_source, f"pair {self.pair.id}: T_target_source")


def _image(image: Any) -> Any:
    from hybridreg.io import as_image, check_image
    from hybridreg.io.meaning.image_objects import pixels_in

    if not isinstance(image, (str, os.PathLike)):
        pixels = pixels_in(image, "image")
        shape = pixels.shape
        if not shape:
            raise ValueError(f"image: is a {type(image).__name__}, no array and no path; {_elsewhere(image)}")
        if len(shape) == 2 and 0 < min(shape) < _FEWEST_PIXELS:
            size = " x ".join(map(str, shape))
            raise ValueError(f"image: an array of {size} is no camera image; {_ELSEWHERE}")
        return as_image(pixels)
    check_image(image)
    return Path(image)


def _elsewhere(image: Any) -> str:
    # What may be an encoded image: bytes, an open file, a sensor_msgs/CompressedImage.
    encoded = isinstance(image, (bytes, bytearray)) or hasattr(image, "read") or hasattr(image, "format")
    return "write its bytes to a file, and give the path" if encoded else _ELSEWHERE
