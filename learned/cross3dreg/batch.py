# SPDX-License-Identifier: MIT
"""The input of a network: the pyramid of a pair, input features, and the image where there is one. No ground truth."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, Protocol

import numpy as np
import numpy.typing as npt
import torch
from torch import Tensor

from hybridreg.learned.cross3dreg.config import ImageConfig
from hybridreg.learned.cross3dreg.image_input import image_tensor
from hybridreg.learned.pyramid.input_features import input_features
from hybridreg.learned.pyramid.point_pyramid import Pyramid, PyramidPlan, build_pyramid


class BackbonePlan(PyramidPlan, Protocol):
    """What a batch needs of a backbone's configuration."""

    @property
    def max_range(self) -> float | None:
        """Metres from the cloud's median; farther points are left out."""

    @property
    def input_features(self) -> Literal["ones", "geometric"]:
        """The kind of input features."""


class BatchPlan(Protocol):
    """What a batch needs of a network's configuration."""

    @property
    def backbone(self) -> BackbonePlan:
        """Of the encoder."""

    @property
    def image(self) -> ImageConfig | None:
        """Of the image; None where the network uses none."""


@dataclass(frozen=True, kw_only=True)
class Batch:
    """One pair, ready for a network."""

    pyramid: Pyramid
    features: Tensor  # (N_1, C_in) float32, target first
    image: Tensor | None = None  # (3, H, W) float32, normalised

    def to(self, device: torch.device | str) -> Batch:
        """The same batch on another device."""
        image = None if self.image is None else self.image.to(device)
        return Batch(pyramid=self.pyramid.to(device), features=self.features.to(device), image=image)


def make_batch(
    target: npt.NDArray[np.floating],
    source: npt.NDArray[np.floating],
    config: BatchPlan,
    *,
    image: npt.NDArray[np.uint8] | None = None,
    subsample: bool = True,
    device: torch.device | str = "cpu",
) -> Batch:
    """Build the pyramid and the input features of a pair.

    Parameters
    ----------
    target, source
        (M, 3), (N, 3) metres, each in its sensor's frame.
    config
        Of the network that will take the batch.
    image
        (H, W, 3) uint8, or None; ignored by a network without image encoder.
    subsample
        False when both clouds already are on the first stage's grid.
    device
        Where the neighbours are searched and the tensors are placed.
    """
    reach = config.backbone.max_range
    near = [cloud if reach is None else _within(cloud, reach) for cloud in (target, source)]
    clouds = [torch.from_numpy(np.array(cloud, dtype=np.float32)).to(device) for cloud in near]
    pyramid = build_pyramid(clouds[0], clouds[1], config.backbone, subsample=subsample)
    tensor = None
    if image is not None and config.image is not None:
        tensor = image_tensor(image, config.image.height, config.image.width).to(device)
    return Batch(
        pyramid=pyramid, features=input_features(pyramid, config.backbone.input_features), image=tensor
    )


def _within(points: npt.NDArray[np.floating], reach: float) -> npt.NDArray[np.floating]:
    # From the median, not from the origin: a cloud in map coordinates keeps its middle.
    away = points[:, :2] - np.median(points[:, :2], axis=0)
    return points[np.hypot(away[:, 0], away[:, 1]) <= reach]
