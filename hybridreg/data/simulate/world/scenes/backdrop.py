# SPDX-License-Identifier: MIT
"""The backdrop far away: blocks and tree tops, coarse because no sensor comes near them."""

from __future__ import annotations

import numpy as np

from hybridreg.data.simulate.world.layout import Layout
from hybridreg.data.simulate.world.solids import boxes, cards


def add_backdrop(layout: Layout, rng: np.random.Generator) -> None:
    """A ragged ring of houses and trees between 80 and 125 m from the centre."""
    n = int(rng.integers(20, 55))
    angle = rng.uniform(0, 2 * np.pi, n)
    xy = rng.uniform(85, 122, n)[:, None] * np.c_[np.cos(angle), np.sin(angle)]
    base = np.c_[xy, layout.terrain.height(xy[:, 0], xy[:, 1]) - 2.0]
    houses = rng.random(n) < rng.uniform(0.2, 0.8)
    size = rng.uniform([8, 8, 6], [30, 18, 20], (n, 3))
    tint = np.array([0.6, 0.57, 0.52]) * rng.uniform(0.7, 1.2)
    layout.still.append(boxes(base[houses], size[houses], angle[houses], "plaster", tint))
    # A tree is a tuft of large cards: at a hundred metres the beams are decimetres apart.
    trees = base[~houses]
    tuft = rng.normal(0, 1, (len(trees), 45, 3)) * [2.2, 2.2, 2.6] + [0, 0, 7.5]
    centres = (trees[:, None] + tuft).reshape(-1, 3)
    if len(centres):
        layout.still.append(
            cards(centres, rng.uniform(0.8, 1.7, len(centres)), rng, "leaves", (0.24, 0.32, 0.15))
        )
