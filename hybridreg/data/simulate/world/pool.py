# SPDX-License-Identifier: MIT
"""Objects made once and reused, each time stretched, rotated and tinted differently: scenes are cheap."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache

import numpy as np

from hybridreg.data.simulate.world.mesh import Mesh

Maker = Callable[[np.random.Generator], Mesh]


@lru_cache(maxsize=4096)
def _variant(maker: Maker, number: int) -> Mesh:
    # Seeded by its number alone: which variants were made before changes nothing.
    # Merged, because that stores it column by column.
    return Mesh.merge([maker(np.random.default_rng([number, 2509]))])


def one_of(maker: Maker, rng: np.random.Generator, variants: int = 64, stretch: float = 0.06) -> Mesh:
    """One of `variants` meshes of `maker` (a function with a name, not a lambda), stretched along each axis by
    some `stretch` (standard deviation, share) and a little darker or lighter."""
    mesh = _variant(maker, int(rng.integers(variants)))
    scale = np.exp(rng.normal(0, stretch, 3)).astype(np.float32)
    shade = np.float32(rng.uniform(0.8, 1.15))
    return Mesh(mesh.vertices * scale, mesh.faces, mesh.material, mesh.tint * shade)
