# SPDX-License-Identifier: MIT
"""Camera images in one form: (H, W, 3), uint8, RGB."""

from __future__ import annotations

import os
import warnings
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hybridreg.io.faults import fault
from hybridreg.io.formats.image_size import image_size
from hybridreg.io.meaning.image_objects import pixels_in
from hybridreg.io.signatures import kind_of
from hybridreg.io.whole_files import read_whole
from hybridreg.runtime.optional_packages import load

_NOT_AN_IMAGE = "give an image that an image viewer opens (.png, .jpg, .tif, .bmp, .webp)"
# The largest phone cameras have 200 million; decoded they take 0.6 GB, twice that while decoding.
_MOST_PIXELS = 210_000_000
_ROWS = 256
_ROUNDING = 1e-6  # by which a float image may leave [0, 1]
# Cameras of 10 and 12 bits fill so much of 16, where nobody scales what they give.
_TWELVE_BITS = 4095


def read_image(path: str | os.PathLike[str]) -> NDArray[np.uint8]:
    """Read an image, turned upright by its EXIF orientation.

    Parameters
    ----------
    path : path
        A file of any kind that OpenCV decodes, whatever its name: grey, colour, with alpha (which is
        dropped), 8 or 16 bits (of which the full range becomes 0 to 255).

    Returns
    -------
    array of shape (H, W, 3), uint8
        RGB.

    Raises
    ------
    FileNotFoundError, IsADirectoryError
        Nothing, or a folder, lies at `path`.
    ValueError
        The file is not an image, is truncated, or has more than 210 million pixels (it is then not decoded).
    """
    name = str(path)
    data = _checked(Path(path))
    pixels = _decode(data)
    if pixels is None:
        raise _undecodable(data, name)
    return as_image(pixels[..., ::-1] if pixels.ndim == 3 else pixels, name)


def check_image(path: str | os.PathLike[str]) -> None:
    """Refuse by its header alone what is not an image, is truncated, or has too many pixels.

    Raises
    ------
    FileNotFoundError, IsADirectoryError, ValueError
        As `read_image`, but for damage that only a decoder meets.
    """
    _checked(Path(path))


def _checked(path: Path) -> bytes:
    name, data = str(path), read_whole(path)
    if not data:
        raise fault(name, "is empty (0 bytes)")
    if data.startswith(b"\xff\xd8\xff") and not _jpeg_is_whole(data):
        raise fault(name, f"breaks off within the JPEG data, after {len(data)} bytes")
    size = image_size(data)
    if size is None:
        raise _undecodable(data, name)
    rows, columns = size
    if rows * columns > _MOST_PIXELS:
        problem = f"has {columns} x {rows} pixels, {rows * columns / 1e6:.0f} megapixels"
        raise fault(
            name,
            problem,
            f"make it smaller: {_MOST_PIXELS / 1e6:.0f} are read, networks use less than one",
        )
    return data


def _undecodable(data: bytes, name: str) -> ValueError:
    kind = kind_of(data)
    what = f"its content is {kind.words}" if kind else f"begins with {data[:8]!r}"
    return fault(name, f"cannot be decoded as an image: {what}, {len(data)} bytes", _NOT_AN_IMAGE)


def as_image(image: ArrayLike | Any, name: str = "image") -> NDArray[np.uint8]:
    """Convert pixels to the one form that all stages take.

    Parameters
    ----------
    image : array of shape (H, W), (H, W, 1), (H, W, 3) or (H, W, 4)
        Grey, RGB or RGBA (alpha is dropped); uint8, uint16 (full range) or floats in [0, 1]; also Pillow's images,
        tensors, and messages sensor_msgs/Image. OpenCV's own `imread` gives BGR: turn that with `image[..., ::-1]`.
    name : str
        What an error message calls it.

    Returns
    -------
    array of shape (H, W, 3), uint8
        RGB, contiguous; a copy.

    Raises
    ------
    ValueError
        Another shape or dtype, no pixels, floats outside [0, 1] or not finite.
    """
    pixels = pixels_in(image, name)
    if pixels.ndim == 2:
        pixels = pixels[:, :, None]
    _check_shape(pixels, name)
    colour = np.broadcast_to(pixels[:, :, :3], (*pixels.shape[:2], 3))
    return np.array(_eight_bits(colour, name), dtype=np.uint8, order="C")


def _check_shape(pixels: NDArray[Any], name: str) -> None:
    shape = pixels.shape
    if pixels.ndim == 3 and shape[2] > 4 and shape[0] in (1, 3, 4):
        cure = "put the channels last: numpy.moveaxis(image, 0, -1), of a tensor image.permute(1, 2, 0)"
        raise fault(name, f"has the shape {shape}, channels first", cure)
    if pixels.ndim != 3 or shape[2] not in (1, 3, 4):
        cure = "give (H, W), (H, W, 1), (H, W, 3) or (H, W, 4)" + (": image[0]" if len(shape) == 4 else "")
        raise fault(name, f"has the shape {shape}", cure)
    if pixels.size == 0:
        raise fault(name, f"has the shape {shape}, no pixels", "give an image of at least one pixel")


def _eight_bits(pixels: NDArray[Any], name: str) -> NDArray[Any]:
    if pixels.dtype == np.uint8:
        return pixels
    if pixels.dtype.kind == "u" and pixels.dtype.itemsize == 2:
        _warn_of_dark(int(pixels.max()), name)
        rounded = np.empty(pixels.shape, dtype=np.uint8)
        for row in range(0, len(pixels), _ROWS):  # so that no copy of four bytes each is made of all
            rounded[row : row + _ROWS] = (pixels[row : row + _ROWS].astype(np.uint32) * 255 + 32767) // 65535
        return rounded
    if pixels.dtype.kind != "f":
        raise fault(name, f"has the dtype {pixels.dtype}", _as_another_type(pixels))
    low, high = float(pixels.min()), float(pixels.max())
    if not (low >= -_ROUNDING and high <= 1 + _ROUNDING):  # written so that NaN fails it
        raise fault(name, f"has floats from {low:g} to {high:g}, not in [0, 1]", _as_shares(low, high))
    return np.rint(np.clip(pixels, 0, 1) * 255)


def _warn_of_dark(high: int, name: str) -> None:
    if 0 < high <= _TWELVE_BITS:
        problem = f"the values of its 16 bits reach {high} of 65535, which is nearly black"
        warnings.warn(f"{name}: {problem}; scale them to the full range", UserWarning, stacklevel=5)


def _as_another_type(pixels: NDArray[Any]) -> str:
    if pixels.dtype.kind == "b":
        return "give floats: numpy.asarray(image, float)"
    if pixels.dtype.kind in "iu" and pixels.min() >= 0 and pixels.max() <= 65535:
        return f"convert it: numpy.asarray(image, numpy.{'uint8' if pixels.max() <= 255 else 'uint16'})"
    return "give uint8, uint16 or floats in [0, 1]"


def _as_shares(low: float, high: float) -> str:
    if not np.isfinite((low, high)).all():
        return "give a value to pixels that have none: numpy.nan_to_num(image)"
    if low < 0.0:
        return "undo its normalisation, so that black is 0 and white is 1"
    return "divide it by its full scale" + (", 255" if high <= 255.0 else "")


def _decode(data: bytes) -> NDArray[Any] | None:
    cv2 = load("cv2", "an image")
    # ANYDEPTH keeps 16 bits for our own rounding; COLOR turns the image upright, which UNCHANGED does not.
    try:
        return cv2.imdecode(np.frombuffer(data, dtype=np.uint8), cv2.IMREAD_COLOR | cv2.IMREAD_ANYDEPTH)
    except (cv2.error, MemoryError):
        return None


def _jpeg_is_whole(data: bytes) -> bool:
    """Whether the end mark follows the pixels: OpenCV 4 fills what a truncated JPEG lacks with grey."""
    place = 2
    while place + 4 <= len(data) and data[place] == 0xFF:
        marker = data[place + 1]
        if marker == 0xDA:  # start of scan; from here on the end mark cannot stand for anything else
            return data.find(b"\xff\xd9", place) >= 0
        place += 1 if marker == 0xFF else 2 + int.from_bytes(data[place + 2 : place + 4], "big")
    return False
