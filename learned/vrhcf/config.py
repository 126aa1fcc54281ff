# SPDX-License-Identifier: MIT
"""SphereNet's configuration and its sizes by name."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

from hybridreg.config import limits
from hybridreg.config.plain_values import build

# A configuration may come with untrusted weights: absurd sizes are refused before memory is allocated. By hand.
_WIDEST = 4096  # channels
_MOST_CELLS = 512  # along a coordinate
_MOST_POINTS = 100_000


@dataclass(frozen=True, kw_only=True)
class ShellConv:
    """A 3-D convolution without padding along the radius."""

    width: int
    kernel: int = 3

    def __post_init__(self) -> None:
        limits.within(self, 1, _WIDEST, "width")
        limits.within(self, 1, 31, "kernel")


@dataclass(frozen=True, kw_only=True)
class SurfaceConv:
    """A 2-D convolution on the sphere's surface; nothing is ever strided."""

    width: int
    kernel: int = 3
    dilation: int = 1
    norm: bool = True
    relu: bool = True

    def __post_init__(self) -> None:
        limits.within(self, 1, _WIDEST, "width")
        limits.within(self, 1, 31, "kernel")
        limits.within(self, 1, 256, "dilation")


def _shells(*widths: int) -> tuple[ShellConv, ...]:
    return tuple(ShellConv(width=width) for width in widths)


def _surface(*widths: int) -> tuple[SurfaceConv, ...]:
    # module/SphericalCNN.py: what is called stride there doubles the dilation of all layers after it.
    plan = ((3, 1), (3, 2), (3, 2), (3, 4), (2, 4), (2, 8), (2, 16))
    return tuple(
        SurfaceConv(width=width, kernel=kernel, dilation=dilation, norm=i < 6, relu=i < 4)
        for i, (width, (kernel, dilation)) in enumerate(zip(widths, plan, strict=True))
    )


@dataclass(frozen=True, kw_only=True)
class SphereNetConfig:
    """The descriptor; the defaults are the published 3DMatch one with everything as released.

    In four points the released code differs from what is correct. Official weights and published numbers depend on it,
    so the defaults are as released; our own sizes have the correct behaviour.

    ``padding``
        "released": elevation wraps around and azimuth is padded with zeros, because the padding functions were written
        for a tensor with its axes the other way round (script/common.py). "right": azimuth wraps around, elevation is
        padded with zeros, so that a rotation about the axis by whole cells changes nothing.
    ``frames``
        "released": frames are made in batches of ``frame_batch``, and a batch of exactly three gets wrong ones, because
        the cross product there names no dimension. "right": every patch its own.
    ``matching``
        "channels" (released): descriptors are divided by the length of each *channel* over all keypoints
        (module/HCF_module.py). "unit": by their own length. See `hybridreg.learned.vrhcf.keypoint_matching`.
    ``facing``
        "origin" (released): axes face the origin of each cloud's frame, so that a cloud whose frame was moved has other
        descriptors. "sensor": they face the cloud's viewpoint, and upwards where that is not known.
    """

    voxel: float = 0.025  # metres: spacing of the points that the network was trained with
    radius: float = 0.3  # metres, of a patch
    patch_points: int = 2048  # sampled or repeated to this number; the last one is the keypoint
    radial: int = 15
    azimuth: int = 40
    elevation: int = 20
    interpolated: bool = True  # every point in eight cells; false counts it in one
    local_frame: Literal["axis", "none"] = "axis"  # "none": the axes of the cloud, as released for KITTI
    shells: tuple[ShellConv, ...] = field(default_factory=lambda: _shells(8, 16, 32, 64, 64, 128, 128))
    surface: tuple[SurfaceConv, ...] = field(default_factory=lambda: _surface(256, 256, 128, 128, 64, 64, 64))
    padding: Literal["released", "right"] = "released"
    frames: Literal["released", "right"] = "released"
    frame_batch: int = 4  # patches a batch in the released scripts
    matching: Literal["channels", "unit"] = "channels"
    facing: Literal["origin", "sensor"] = "origin"
    positive_margin: float = 0.1
    negative_margin: float = 1.4
    loss_pairs: int = 10  # keypoint pairs of a training step
    pair_radius: float = 0.05  # metres within which keypoints of both clouds correspond under the true pose

    def __post_init__(self) -> None:
        limits.within(self, 1e-4, 1e4, "voxel", "radius", "pair_radius")
        limits.within(self, 2, _MOST_POINTS, "patch_points")
        limits.within(self, 1, _MOST_CELLS, "radial", "azimuth", "elevation")
        limits.at_least(self, 1, "frame_batch", "loss_pairs")
        if not self.surface:
            raise ValueError("surface must have one convolution at least")
        left = self.radial - sum(shell.kernel - 1 for shell in self.shells)
        if left != 1:
            raise ValueError(
                f"the shells' kernels leave {left} of radial={self.radial} cells, and must leave one: their sizes less "
                f"one must add up to {self.radial - 1}"
            )

    @property
    def width(self) -> int:
        """Numbers in a descriptor."""
        return self.surface[-1].width

    def to_dict(self) -> dict[str, Any]:
        """Plain values that `from_dict` and JSON take back."""
        return dataclasses.asdict(self)

    @staticmethod
    def from_dict(values: Mapping[str, Any]) -> SphereNetConfig:
        """Build from plain values; an unknown key raises ``ValueError`` that names it."""
        return build(SphereNetConfig, values, "config")


def _outdoor(voxel: float, points: int, shells: tuple[int, ...], surface: tuple[int, ...]) -> SphereNetConfig:
    # No published configuration is for outdoor scenes; a patch of ten voxels, as indoors.
    return SphereNetConfig(
        voxel=voxel,
        radius=10.0 * voxel,
        patch_points=points,
        radial=1 + 2 * len(shells),
        azimuth=24,
        elevation=12,
        shells=_shells(*shells),
        surface=_surface(*surface),
        padding="right",
        frames="right",
        matching="unit",
        facing="sensor",
        pair_radius=1.0 * voxel,
    )


def _small() -> SphereNetConfig:
    return _outdoor(0.25, 512, (8, 16, 32, 32), (64, 64, 64, 64, 32, 32, 32))


def _nano() -> SphereNetConfig:
    return _outdoor(0.5, 128, (4, 8), (16, 16, 16, 16, 16, 16, 16))


SIZES: dict[str, Callable[[], SphereNetConfig]] = {
    "nano": _nano,
    "small": _small,
    "vrhcf-3dmatch": SphereNetConfig,
}


def named_config(name: str) -> SphereNetConfig:
    """The configuration of a size.

    Parameters
    ----------
    name
        ``nano``, ``small`` (outdoor, ours, everything right) or ``vrhcf-3dmatch`` (as released: 2.24 M parameters).

    Raises
    ------
    KeyError
        An unknown name; the message lists the known ones.
    """
    if name not in SIZES:
        raise KeyError(f"unknown size {name!r} of SphereNet; known are {', '.join(SIZES)}")
    return SIZES[name]()
