# SPDX-License-Identifier: MIT
"""From a camera image to the tensor that the image encoder takes."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import torch
from torch import Tensor
from torch.nn import functional as F

_MEAN = torch.tensor([0.485, 0.456, 0.406])[:, None, None]  # ImageNet
_STD = torch.tensor([0.229, 0.224, 0.225])[:, None, None]


def image_tensor(image: npt.NDArray[np.uint8], height: int, width: int) -> Tensor:
    """Letter-box an image to (3, height, width) float32, normalised by ImageNet's mean and deviation.

    Parameters
    ----------
    image
        (H, W, 3) or (H, W) uint8; grey is repeated to three channels.

    Raises
    ------
    ValueError
        Another shape or type.
    """
    if image.dtype != np.uint8 or image.ndim not in (2, 3) or (image.ndim == 3 and image.shape[2] != 3):
        raise ValueError(f"the image must be (H, W, 3) or (H, W) uint8, got {image.shape} {image.dtype}")
    if 0 in image.shape:
        raise ValueError(f"the image has no pixels: {image.shape}")
    colour = image if image.ndim == 3 else np.repeat(image[..., None], 3, axis=2)
    tensor = torch.from_numpy(np.ascontiguousarray(colour)).permute(2, 0, 1).float() / 255.0
    size = letterboxed_size(tensor.shape[1], tensor.shape[2], height, width)
    resized = F.interpolate(tensor[None], size=size, mode="bilinear", align_corners=False, antialias=True)[0]
    normalized = (resized - _MEAN) / _STD
    top, left = (height - size[0]) // 2, (width - size[1]) // 2
    # Bars of the mean colour: zero after normalisation.
    return F.pad(normalized, (left, width - size[1] - left, top, height - size[0] - top))


def letterboxed_size(rows: int, columns: int, height: int, width: int) -> tuple[int, int]:
    """Rows and columns of an image of ``rows`` x ``columns`` pixels scaled to fit into ``height`` x ``width``."""
    scale = min(height / rows, width / columns)
    return max(1, round(rows * scale)), max(1, round(columns * scale))
