# SPDX-License-Identifier: MIT
"""A pair's camera image: pixels, or the path of a file that is decoded on first access."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray


class CameraImage:
    """A dataclass field that holds a path or pixels, and gives pixels: (H, W, 3) uint8, RGB, or None.

    Most pipelines never use the image, and decoding it may take longer than they do.

    Raises
    ------
    ValueError
        On first access, if the file cannot be decoded (`hybridreg.io.read_image`).
    """

    def __get__(self, pair: Any, owner: Any = None) -> NDArray[np.uint8] | None:
        held = None if pair is None else self.held_by(pair)
        if isinstance(held, Path):
            from hybridreg.io import read_image

            held = read_image(held)
            self.__set__(pair, held)
        return held

    def __set__(self, pair: Any, value: Any) -> None:
        pair.__dict__["_image"] = value

    @staticmethod
    def held_by(pair: Any) -> Any:
        """What the pair holds: pixels, a path that was not read yet, or None."""
        return pair.__dict__.get("_image")
