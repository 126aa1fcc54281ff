# SPDX-License-Identifier: MIT
"""Augmentation that keeps every index of a pyramid: motions, noise, light (docs/methods.md 2.5)."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from hybridreg.learned.pyramid.point_pyramid import Pyramid

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class Augmentation:
    """How a training pair is augmented.

    Attributes
    ----------
    rotation : "yaw" rotates about the vertical by up to 180 degrees and tilts by up to ``tilt`` degrees; "full" draws
        three Euler angles over the full circle, as GeoTransformer does
    clouds : rotate both clouds independently, or a random one
    shift : largest shift along each axis, metres, of both clouds
    jitter : half the width of the noise on each coordinate, metres
    scale : range of a common factor on both clouds; anything but 1 changes the neighbours, so it needs pairs that
        are not prepared
    light : largest relative change of an image's brightness, contrast and colour balance
    """

    rotation: Literal["yaw", "full", "none"] = "yaw"
    tilt: float = 5.0
    clouds: Literal["both", "one"] = "both"
    shift: float = 2.0
    jitter: float = 0.005
    scale: tuple[float, ...] = (1.0, 1.0)
    light: float = 0.2

    def __post_init__(self) -> None:
        if len(self.scale) != 2 or not 0 < self.scale[0] <= self.scale[1]:
            raise ValueError(f"augmentation.scale={list(self.scale)}: give the lowest and the highest factor")

    @property
    def rescales(self) -> bool:
        """Whether it changes the neighbours."""
        return self.scale != (1.0, 1.0)

    @property
    def upright(self) -> bool:
        """Whether it only rotates clouds about the vertical and shifts them."""
        tilts = self.rotation == "full" or (self.rotation == "yaw" and self.tilt != 0.0)
        return not tilts and self.jitter == 0.0 and not self.rescales

    def draw_scale(self, rng: np.random.Generator) -> float:
        """A factor from the range; the generator is not used where there is nothing to choose."""
        return float(rng.uniform(self.scale[0], self.scale[1])) if self.rescales else 1.0


def draw_motions(augmentation: Augmentation, rng: np.random.Generator) -> tuple[Array, Array]:
    """Random motions (4, 4) of the target and of the source."""
    motions = [np.eye(4), np.eye(4)]
    turned = (0, 1) if augmentation.clouds == "both" else (int(rng.integers(2)),)
    for cloud in turned:
        motions[cloud][:3, :3] = _rotation(augmentation, rng)
    for motion in motions:
        motion[:3, 3] = rng.uniform(-augmentation.shift, augmentation.shift, 3)
    return motions[0], motions[1]


def move_pyramid(
    pyramid: Pyramid, motions: tuple[Array, Array], jitter: float, rng: np.random.Generator
) -> Pyramid:
    """The pyramid with the points of each cloud moved at all stages; neighbours stay the same."""
    matrices = [torch.from_numpy(motion).float() for motion in motions]
    noise = torch.Generator().manual_seed(int(rng.integers(2**62)))
    moved = []
    for stage in range(pyramid.stages):
        clouds = zip(pyramid.clouds(stage), matrices, strict=True)
        points = torch.cat([cloud @ T[:3, :3].t() + T[:3, 3] for cloud, T in clouds])
        moved.append(points + (torch.rand(points.shape, generator=noise) - 0.5) * (2.0 * jitter))
    return replace(pyramid, points=tuple(moved))


def move_truth(T_target_source: Tensor, motions: tuple[Array, Array]) -> Tensor:
    """The true pose (4, 4) between the moved clouds."""
    T = motions[0] @ T_target_source.double().numpy() @ np.linalg.inv(motions[1])
    return torch.from_numpy(T).to(T_target_source.dtype)


def relight(image: NDArray[np.uint8], light: float, rng: np.random.Generator) -> NDArray[np.uint8]:
    """The image (H, W, 3) with another brightness, contrast and colour balance."""
    if light == 0.0:
        return image
    gain = rng.uniform(1.0 - light, 1.0 + light) * rng.uniform(1.0 - light / 4, 1.0 + light / 4, 3)
    shift = 255.0 * rng.uniform(-light / 2, light / 2)
    changed = (image - 127.5) * gain + 127.5 + shift
    return np.clip(np.rint(changed), 0, 255).astype(np.uint8)


def _rotation(augmentation: Augmentation, rng: np.random.Generator) -> Array:
    from scipy.spatial.transform import Rotation

    if augmentation.rotation == "none":
        return np.eye(3)
    if augmentation.rotation == "full":
        angles = rng.uniform(0.0, 360.0, 3)
    else:
        angles = rng.uniform(-1.0, 1.0, 3) * (180.0, augmentation.tilt, augmentation.tilt)
    matrix: Array = Rotation.from_euler("zyx", angles, degrees=True).as_matrix()
    return matrix
