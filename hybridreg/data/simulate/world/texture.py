# SPDX-License-Identifier: MIT
"""Patterns on surfaces, from their world coordinates: enough for an image encoder to work with."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from scipy.ndimage import zoom

from hybridreg.data.simulate.world.materials import CONTRAST, MATERIALS

_SIZE = 256
_NAMES = tuple(dict.fromkeys(m.texture for m in MATERIALS))
_KIND = np.array([_NAMES.index(m.texture) for m in MATERIALS], np.uint8)


@lru_cache(maxsize=1)
def _noise() -> np.ndarray:
    """A tile (256,256) of noise over five octaves, about zero with unit spread; the same in every process."""
    rng = np.random.default_rng(20250911)
    tile = np.zeros((_SIZE, _SIZE))
    for octave in range(3, 8):
        coarse = rng.normal(size=(2**octave, 2**octave))
        tile += zoom(coarse, _SIZE / 2**octave, order=1, mode="grid-wrap", grid_mode=True) * 0.75**octave
    return ((tile - tile.mean()) / tile.std()).astype(np.float32)


def noise_at(u: np.ndarray, v: np.ndarray, metres: float) -> np.ndarray:
    """Noise at coordinates in metres, one tile spread over `metres`."""
    scale = np.float32(_SIZE / metres)
    row, column = (np.floor(x * scale).astype(np.int32) & (_SIZE - 1) for x in (u, v))
    return _noise()[row, column]


def _grid_lines(
    u: np.ndarray, v: np.ndarray, wide: float, high: float, joint: float, stagger: bool
) -> np.ndarray:
    row = np.floor(v / high)
    shifted = u + (0.5 * wide * (row % 2) if stagger else 0.0)
    on_joint = ((shifted % wide) < joint) | ((v % high) < joint)
    stone = _noise()[
        (np.floor(shifted / wide).astype(np.int64) * 7) % _SIZE, (row.astype(np.int64) * 13) % _SIZE
    ]
    return np.where(on_joint, -1.6, 0.7 * stone)


def _pattern(name: str, u: np.ndarray, v: np.ndarray) -> np.ndarray:
    if name == "bricks":
        return _grid_lines(u, v, 0.26, 0.085, 0.015, True) + 0.4 * noise_at(u, v, 9.0)
    if name == "tiles":
        return _grid_lines(u, v, 0.5, 0.5, 0.03, False) + 0.5 * noise_at(u, v, 7.0)
    if name == "speckle":
        return 0.8 * noise_at(u, v, 1.7) + 0.8 * noise_at(u, v, 23.0)
    if name == "grass":
        return noise_at(u, v, 1.1) + 0.7 * noise_at(u, v, 31.0)
    if name == "leaves":
        return noise_at(u, v, 2.3)
    return noise_at(u, v, 5.3) + 0.5 * noise_at(u, v, 37.0)  # stains and patches


def shade_factor(points: np.ndarray, normal: np.ndarray, material: np.ndarray) -> np.ndarray:
    """How much lighter or darker (n,) the pattern makes each hit, about 1."""
    factor = np.ones(len(points), np.float32)
    flat = np.abs(normal[:, 2]) > 0.75
    along_x = np.abs(normal[:, 1]) > np.abs(normal[:, 0])
    u = np.where(flat | along_x, points[:, 0], points[:, 1])
    v = np.where(flat, points[:, 1], points[:, 2])
    kind = _KIND[material]
    for number, name in enumerate(_NAMES):
        mine = np.flatnonzero(kind == number)
        if name != "none" and len(mine):
            factor[mine] += CONTRAST[material[mine]] * _pattern(name, u[mine], v[mine])
    return np.clip(factor, 0.2, 2.2)
