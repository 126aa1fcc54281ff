# SPDX-License-Identifier: MIT
"""Which ground of a scene is occupied: rotated rectangles, queried thousands of times a scene."""

from __future__ import annotations

import math

import numpy as np

_ROOM = 128  # rectangles at first


class Taken:
    """Rectangles, and whether a disc touches any."""

    def __init__(self) -> None:
        self._count = 0
        self._circles = np.zeros((3, _ROOM))  # rows x, y and the radius that holds the rectangle
        self._boxes: list[tuple[float, float, float, float]] = []  # half sizes, cosine and sine of yaw

    def add(self, xy: np.ndarray, half: tuple[float, float], yaw: float) -> None:
        """Take the rectangle about `xy` (2,) with edges twice `half`, turned by `yaw` radians."""
        if self._count == self._circles.shape[1]:
            self._circles = np.concatenate([self._circles, np.zeros_like(self._circles)], axis=1)
        wide, deep = float(half[0]), float(half[1])
        # Slightly larger, so that rounding never leaves a rectangle out.
        self._circles[:, self._count] = xy[0], xy[1], math.hypot(wide, deep) + 1e-6
        self._count += 1
        self._boxes.append((wide, deep, float(np.cos(yaw)), float(np.sin(yaw))))

    def free(self, xy: np.ndarray, radius: float) -> bool:
        """Whether the disc about `xy` (2,) touches no rectangle."""
        x, y, reach = self._circles[:, : self._count]
        dx, dy = xy[0] - x, xy[1] - y
        near = (dx * dx + dy * dy <= (reach + radius) ** 2).nonzero()[0]
        return not any(self._touches(k, float(dx[k]), float(dy[k]), radius) for k in near)

    def _touches(self, k: int, dx: float, dy: float, radius: float) -> bool:
        wide, deep, c, s = self._boxes[k]
        gap_x = max(abs(c * dx + s * dy) - wide, 0.0)
        gap_y = max(abs(c * dy - s * dx) - deep, 0.0)
        return gap_x * gap_x + gap_y * gap_y <= radius * radius
