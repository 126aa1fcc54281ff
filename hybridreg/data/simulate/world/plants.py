# SPDX-License-Identifier: MIT
"""Trees with irregular crowns, bushes, hedges: leaves are small cards that a laser beam passes between."""

from __future__ import annotations

from bisect import bisect_left
from functools import partial

import numpy as np

from hybridreg.data.simulate.world.chance import one
from hybridreg.data.simulate.world.mesh import Mesh
from hybridreg.data.simulate.world.pool import one_of
from hybridreg.data.simulate.world.solids import boxes, cards, tubes

_GREENS = np.array([[.24, .36, .12], [.32, .42, .16], [.18, .30, .14], [.42, .44, .18], [.50, .38, .15]])  # fmt: skip
KINDS = {"round": 0.52, "tall": 0.2, "conifer": 0.18, "bare": 0.1}


def tree(rng: np.random.Generator, kind: str, leaves: int) -> Mesh:
    """A tree on the origin; `leaves` cards in all (fewer, larger ones for trees far away).

    kind: "round", "tall", "conifer" or "bare".
    """
    height = rng.uniform(4.5, 13.0)
    girth = 0.018 * height * rng.uniform(0.7, 1.4)
    lean = rng.normal(0, 0.035, 2) * height
    clear = height * (rng.uniform(0.05, 0.15) if kind == "conifer" else rng.uniform(0.18, 0.4))
    top = np.array([*lean, height * 0.93])
    knee = np.array([*(lean * 0.3 + rng.normal(0, 0.1, 2)), clear])
    bark = np.array([0.30, 0.25, 0.20]) * rng.uniform(0.6, 1.4)
    foot = np.array([[0, 0, -0.3], knee])
    trunk = tubes(
        foot,
        np.array([knee, top]),
        np.array([1.25, 0.8]) * girth,
        np.array([0.8, 0.15]) * girth,
        "bark",
        bark,
    )
    tips = _tips(rng, kind, knee, top, height)
    branches = tubes(
        knee + (top - knee) * rng.uniform(0, 0.55, (len(tips), 1)),
        tips,
        0.3 * girth,
        0.06 * girth,
        "bark",
        bark,
        4,
    )
    if kind == "bare":
        return Mesh.merge([trunk, branches, _twigs(rng, tips, height, bark)])
    return Mesh.merge([trunk, branches, _crown(rng, kind, knee, top, tips, height, leaves)])


# One maker for each kind and level of detail, as the pool needs them.
FINENESS = (480, 240, 110)
TREES = {(kind, leaves): partial(tree, kind=kind, leaves=leaves) for kind in KINDS for leaves in FINENESS}


def tree_from_pool(rng: np.random.Generator, distance: float, kind: str | None = None) -> Mesh:
    """A tree in the detail that its `distance` (metres) from the scene's centre needs; kind None draws one."""
    kind = kind or one(rng, tuple(KINDS), tuple(KINDS.values()))
    leaves = FINENESS[bisect_left((24.0, 45.0), distance)]
    return one_of(TREES[kind, leaves], rng, variants=40, stretch=0.16)


def _tips(
    rng: np.random.Generator, kind: str, knee: np.ndarray, top: np.ndarray, height: float
) -> np.ndarray:
    n = int(rng.integers(6, 12))
    angle = rng.uniform(0, 2 * np.pi, n)
    level = rng.uniform(0.15, 0.95, n)
    spread = (
        {"round": 0.30, "tall": 0.12, "conifer": 0.24, "bare": 0.28}[kind] * height * rng.uniform(0.7, 1.15)
    )
    narrowing = (1 - level) if kind == "conifer" else np.sqrt(np.clip(1 - (2 * level - 0.9) ** 2, 0.1, 1))
    reach = spread * narrowing * rng.uniform(0.5, 1.0, n)
    offset = np.c_[reach * np.cos(angle), reach * np.sin(angle), np.zeros(n)]
    return knee + (top - knee) * level[:, None] + offset


def _twigs(rng: np.random.Generator, tips: np.ndarray, height: float, bark: np.ndarray) -> Mesh:
    start = np.repeat(tips, 5, axis=0) + rng.normal(0, 0.03 * height, (5 * len(tips), 3))
    return tubes(start, start + rng.normal(0, 0.07 * height, start.shape), 0.02, 0.008, "bark", bark, 3)


def _crown(
    rng: np.random.Generator,
    kind: str,
    knee: np.ndarray,
    top: np.ndarray,
    tips: np.ndarray,
    height: float,
    leaves: int,
) -> Mesh:
    tint = _GREENS[rng.integers(len(_GREENS))] * rng.uniform(0.7, 1.25)
    if kind == "conifer":
        level = 1 - np.sqrt(rng.random(leaves))
        reach = 0.22 * height * (1 - level) * np.sqrt(rng.uniform(0.15, 1, leaves))
        angle = rng.uniform(0, 2 * np.pi, leaves)
        drop = np.c_[reach * np.cos(angle), reach * np.sin(angle), -0.35 * reach]
        centres = knee + (top + [0, 0, 0.05 * height] - knee) * level[:, None] + drop
    else:
        # Clumps around the branch tips, uneven in size: the outline is ragged, with gaps to see through.
        clump = rng.integers(len(tips), size=leaves)
        width = rng.uniform(0.05, 0.13, len(tips))[clump, None] * height * (0.6 if kind == "tall" else 1.0)
        centres = tips[clump] + rng.normal(0, 0.65, (leaves, 3)) * width * [1, 1, 0.8]
    size = 0.045 * height * np.sqrt(420 / leaves) * rng.uniform(0.6, 1.3, leaves)
    return cards(centres, size, rng, "leaves", tint)


def bush(rng: np.random.Generator) -> Mesh:
    """A bush or tall weeds on the origin."""
    leaves = 80
    width, height = rng.uniform(0.4, 1.3), rng.uniform(0.3, 1.6)
    offset = rng.normal(0, 0.5, (leaves, 3)) * [width, width, 0.45 * height] + [0, 0, 0.45 * height]
    offset[:, 2] = np.abs(offset[:, 2])
    return cards(
        offset,
        rng.uniform(0.06, 0.18, leaves),
        rng,
        "leaves",
        _GREENS[rng.integers(5)] * rng.uniform(0.7, 1.2),
    )


def hedge(rng: np.random.Generator, length: float) -> Mesh:
    """A clipped hedge along x: a core with a ragged skin."""
    height, depth = rng.uniform(0.8, 2.0), rng.uniform(0.5, 1.0)
    tint = _GREENS[rng.integers(5)] * 0.9
    core = boxes(np.zeros((1, 3)), np.array([length, depth * 0.8, height * 0.92]), 0.0, "leaves", tint)
    n = int(min(40 * length, 500))
    skin = rng.uniform(-0.5, 0.5, (n, 3)) * [length, depth, height] + [0, 0, height / 2]
    outward = rng.integers(3, size=n)
    skin[outward == 0, 1] = depth / 2 * np.sign(skin[outward == 0, 1])
    skin[outward == 1, 1] = -depth / 2
    skin[outward == 2, 2] = height
    return Mesh.merge([core, cards(skin, rng.uniform(0.1, 0.25, n), rng, "leaves", tint)])
