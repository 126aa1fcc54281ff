# SPDX-License-Identifier: MIT
"""Images of every size, dtype and state of damage."""

from __future__ import annotations

import struct
import tempfile
import zlib
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from hypothesis import strategies as st
from numpy.typing import NDArray

from hybridreg import Pipeline
from hybridreg.io import as_image, read_image
from hybridreg.pair import Pair
from hybridreg.testing import sample_pair
from tools.hostile.damage import Damage, damaged, damages

DTYPES = ("u1", "u1", "u2", "u4", "i2", "i8", "f2", "f4", "f8", ">f4", "?", "c8", "O", "U3")
FILLS = ("noise", "zeros", "nan", "inf", "negative", "full")
SIZES = (0, 1, 2, 3, 4, 7, 64, 257)


@dataclass(frozen=True, kw_only=True)
class PixelCase:
    """An array passed as the image; the learned stages use it where `used`."""

    kind: ClassVar[str] = "images"
    allowed: ClassVar[tuple[type[BaseException], ...]] = (ValueError,)

    shape: tuple[int, ...]
    dtype: str
    fill: str
    used: bool

    def run(self) -> str:
        """Convert it, perhaps run a network on it."""
        pixels = filled(self.shape, self.dtype, self.fill)
        image = as_image(pixels)
        assert image.dtype == np.uint8, image.dtype
        assert image.ndim == 3, image.shape
        assert image.shape[2] == 3, image.shape
        if self.used:
            pair, _ = sample_pair(1, 300)
            seeing = Pair(source=pair.source, target=pair.target, image=image)
            _network().run(seeing)
        return "taken"


@dataclass(frozen=True, kw_only=True)
class ImageFileCase:
    """An encoded camera image, damaged, whatever its name says."""

    kind: ClassVar[str] = "images"
    allowed: ClassVar[tuple[type[BaseException], ...]] = (ValueError,)

    sample: str
    suffix: str
    damage: tuple[Damage, ...]

    def run(self) -> str:
        """Read it."""
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / f"image{self.suffix}"
            path.write_bytes(damaged(encoded(self.sample), self.damage))
            image = read_image(path)
        assert image.dtype == np.uint8, image.dtype
        assert image.shape[2] == 3, image.shape
        return "read"


def cases() -> st.SearchStrategy[Any]:
    """Arrays and files."""
    side = st.sampled_from(SIZES)
    channels = st.sampled_from((0, 1, 2, 3, 4, 5))
    shapes = st.one_of(
        st.tuples(side, side),
        st.tuples(side, side, channels),
        st.tuples(channels, side, side),
        st.tuples(side),
        st.just(()),
        st.tuples(st.just(1), side, side, st.just(3)),
        st.just((1, 9000, 3)),
    )
    pixels = st.builds(
        PixelCase,
        shape=shapes,
        dtype=st.sampled_from(DTYPES),
        fill=st.sampled_from(FILLS),
        used=st.sampled_from((False, False, False, True)),
    )
    files = st.builds(
        ImageFileCase,
        sample=st.sampled_from(_SAMPLES),
        suffix=st.sampled_from(("", ".png", ".jpg", ".txt")),
        damage=damages(),
    )
    return st.one_of(pixels, files)


def filled(shape: tuple[int, ...], dtype: str, fill: str) -> NDArray[Any]:
    """An array of that shape and dtype."""
    rng = np.random.default_rng(0)
    values = {"zeros": 0.0, "nan": np.nan, "inf": np.inf, "negative": -1.0, "full": 1.0}
    made = rng.uniform(0.0, 1.0, shape) if fill == "noise" else np.full(shape, values[fill])
    kind = np.dtype(dtype).kind
    with np.errstate(all="ignore"):
        if kind in "iu" and fill == "noise":
            made = made * 255
        return np.nan_to_num(made).astype(dtype) if kind in "iu" else made.astype(dtype)


@cache
def encoded(sample: str) -> bytes:
    """A valid file."""
    import cv2

    _, suffix, kind = sample.split()
    if kind == "bomb":  # it promises 900 megapixels
        head = b"IHDR" + struct.pack(">IIBBBBB", 30_000, 30_000, 8, 2, 0, 0, 0)
        crc = struct.pack(">I", zlib.crc32(head))
        return b"\x89PNG\r\n\x1a\n" + struct.pack(">I", 13) + head + crc + encoded("a png colour")[33:]
    pixels = filled((48, 64, 3) if kind == "colour" else (48, 64), "u1", "noise")
    return bytes(np.asarray(cv2.imencode(f".{suffix}", pixels)[1], dtype=np.uint8))


@cache
def _network() -> Pipeline:
    # Random weights: the effect of an image on the network's arithmetic does not depend on them.
    blind = {"untrained": True}
    return Pipeline(
        overlap={"stage": "omp", **blind}, match={"stage": "vgam", **blind}, estimate="lgr", refine="none"
    )


_SAMPLES = (
    *(
        f"a {suffix} {kind}"
        for suffix in ("png", "jpg", "bmp", "tiff", "webp", "gif", "avif")
        for kind in ("grey", "colour")
    ),
    "a pgm grey",
    "a ppm colour",
    "a png bomb",
)
