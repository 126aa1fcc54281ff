# SPDX-License-Identifier: MIT
"""Pictures as the bytes a camera delivers."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def encode(picture: NDArray[np.uint8], quality: int) -> bytes:
    """RGB (H,W,3) uint8 as JPEG."""
    import cv2

    return bytes(cv2.imencode(".jpg", picture[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, quality])[1])


def decode(data: bytes) -> NDArray[np.uint8]:
    """RGB (H,W,3) uint8.

    Raises
    ------
    ValueError
        For bytes that are not an image.
    """
    import cv2

    picture = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR)
    if picture is None:
        raise ValueError(f"these {len(data)} bytes are no JPEG picture")
    rgb: NDArray[np.uint8] = np.ascontiguousarray(picture[..., ::-1])
    return rgb
