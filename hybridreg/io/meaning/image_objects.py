# SPDX-License-Identifier: MIT
"""The pixels in what holds a camera image: Pillow's images, tensors, messages of ROS; recognised without imports."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from hybridreg.io.faults import fault

# Pillow's modes whose numbers are grey or RGB as they are; of others they are rows of a palette, inks, hues.
_PLAIN = ("L", "RGB", "RGBA", "I", "I;16", "I;16L", "I;16B", "F")
# sensor_msgs/Image's encodings: the type of a number, and the channels that are red, green and blue, or grey.
_ENCODINGS = {
    "mono8": ("u1", 1, [0]),
    "8UC1": ("u1", 1, [0]),
    "mono16": ("u2", 1, [0]),
    "rgb8": ("u1", 3, [0, 1, 2]),
    "rgba8": ("u1", 4, [0, 1, 2]),
    "bgr8": ("u1", 3, [2, 1, 0]),
    "8UC3": ("u1", 3, [2, 1, 0]),
    "bgra8": ("u1", 4, [2, 1, 0]),
    "rgb16": ("u2", 3, [0, 1, 2]),
    "bgr16": ("u2", 3, [2, 1, 0]),
}
_MESSAGE = ("height", "width", "encoding", "step", "data")


def pixels_in(image: Any, name: str) -> NDArray[Any]:
    """The numbers of an image as an array, shape (H, W) or (H, W, C), in RGB where its kind tells the order.

    Pillow's images are turned upright by their EXIF orientation, as files are, and converted to RGB from palettes,
    CMYK and others; tensors may be on a GPU, or require gradients.

    Raises
    ------
    ValueError
        A mode of Pillow that it cannot convert, or a message of ROS in another encoding or with too few bytes.
    """
    if hasattr(image, "getexif") and hasattr(image, "convert"):
        return _of_pillow(image, name)
    if hasattr(image, "detach") and hasattr(image, "cpu"):
        tensor = image.detach().cpu()
        return np.asarray(tensor.float() if tensor.is_floating_point() else tensor)  # numpy has no bfloat16
    if all(hasattr(image, each) for each in _MESSAGE):
        return _of_message(image, name)
    return np.asarray(image)


def _of_pillow(image: Any, name: str) -> NDArray[Any]:
    from PIL import ImageOps

    upright = ImageOps.exif_transpose(image)
    if upright.mode not in _PLAIN:
        try:
            upright = upright.convert("RGB")
        except ValueError as error:
            raise fault(name, f"is in Pillow's mode {upright.mode}", "give it in RGB") from error
    return np.asarray(upright)


def _of_message(image: Any, name: str) -> NDArray[Any]:
    if image.encoding not in _ENCODINGS:
        known = ", ".join(_ENCODINGS)
        raise fault(
            name, f"a message of ROS in the encoding {image.encoding!r}", f"convert it to one of {known}"
        )
    code, channels, order = _ENCODINGS[image.encoding]
    kind = np.dtype(code).newbyteorder(">" if getattr(image, "is_bigendian", 0) else "<")
    data = np.frombuffer(bytes(image.data), np.uint8)
    rows, columns, step = int(image.height), int(image.width), int(image.step)
    width = columns * channels * kind.itemsize
    if step < width or data.size < rows * step:
        problem = (
            f"a message of ROS of {rows} x {columns} pixels in {step} bytes a row holds {data.size} bytes"
        )
        raise fault(name, problem, "take the message again")
    packed = np.ascontiguousarray(data[: rows * step].reshape(rows, step)[:, :width])  # rows may be padded
    pixels = packed.view(kind).reshape(rows, columns, channels)[:, :, order]
    return pixels.astype(kind.newbyteorder("="))
