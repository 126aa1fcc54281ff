# SPDX-License-Identifier: MIT
"""Buildings whose facades have relief: recessed windows, balconies, pillars, cornices, doors, roofs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hybridreg.data.simulate.sensing.column_arrays import stack
from hybridreg.data.simulate.world.chance import one
from hybridreg.data.simulate.world.materials import MATERIAL_INDEX
from hybridreg.data.simulate.world.mesh import Mesh, Tint
from hybridreg.data.simulate.world.solids import boxes, loft, quads

# One window cell on 12 corners: 0-3 the cell, 4-7 the hole in the wall, 8-11 the pane behind it.
_WALL = [[0, 1, 5], [0, 5, 4], [1, 2, 6], [1, 6, 5], [2, 3, 7], [2, 7, 6], [3, 0, 4], [3, 4, 7]]
_REVEAL = [[4, 5, 9], [4, 9, 8], [5, 6, 10], [5, 10, 9], [6, 7, 11], [6, 11, 10], [7, 4, 8], [7, 8, 11]]
_PANE = np.array([[8, 9, 10], [8, 10, 11]], np.int32)
_STONE = np.array(_WALL + _REVEAL, np.int32)
_WALL_TINTS = (
    (0.72, 0.68, 0.60), (0.80, 0.74, 0.58), (0.62, 0.36, 0.28), (0.55, 0.30, 0.24), (0.75, 0.75, 0.73),
    (0.58, 0.58, 0.60), (0.83, 0.80, 0.74), (0.70, 0.55, 0.42), (0.66, 0.70, 0.72),
)  # fmt: skip


@dataclass(frozen=True)
class Style:
    """What all facades of one building share."""

    material: str
    tint: Tint
    cell: float  # metres from one window axis to the next
    storey: float
    window: tuple[float, float]  # share of the cell that the window takes, across and up
    recess: float
    balconies: float  # share of window axes that carry them
    pillars: bool
    shop: bool

    @staticmethod
    def draw(rng: np.random.Generator) -> Style:
        """A building as towns have them."""
        material = one(rng, ("plaster", "brick", "concrete"), (0.5, 0.3, 0.2))
        tint = np.array(_WALL_TINTS[rng.integers(len(_WALL_TINTS))]) * rng.uniform(0.8, 1.1)
        return Style(
            material,
            (float(tint[0]), float(tint[1]), float(tint[2])),
            rng.uniform(2.2, 4.6),
            rng.uniform(2.8, 3.8),
            (rng.uniform(0.3, 0.75), rng.uniform(0.4, 0.65)),
            rng.uniform(0.08, 0.4),
            one(rng, (0.0, 0.0, rng.uniform(0.15, 0.5))),
            bool(rng.random() < 0.3),
            bool(rng.random() < 0.4),
        )


def _cells(style: Style, length: float, height: float, rng: np.random.Generator) -> tuple[np.ndarray, ...]:
    """Edges of the cells: left, right, bottom, top, and of their windows, each (n,)."""
    across, up = max(1, round(length / style.cell)), max(1, round(height / style.storey))
    u = np.linspace(0, length, across + 1)
    z = np.linspace(0, height, up + 1)
    left, bottom = np.repeat(u[:-1], up), np.tile(z[:-1], across)
    width, storey = length / across, height / up
    ground = bottom < 0.1
    share_u = np.where(ground & style.shop, 0.85, style.window[0]) * np.where(
        rng.random(len(left)) < 0.06, 0.6, 1
    )
    share_z = np.where(ground & style.shop, 0.75, style.window[1])
    middle = left + width / 2
    sill = bottom + np.where(ground & style.shop, 0.1, 0.3) * storey
    top = np.minimum(sill + share_z * storey, bottom + 0.95 * storey)
    return (
        left,
        left + width,
        bottom,
        bottom + storey,
        middle - share_u * width / 2,
        middle + share_u * width / 2,
        sill,
        top,
    )


def facade(
    start: np.ndarray, end: np.ndarray, base: float, height: float, style: Style, rng: np.random.Generator
) -> list[Mesh]:
    """A wall from `start` (2,) to `end` (2,), its outside on the right hand of that walk."""
    along = (end - start) / max(float(np.linalg.norm(end - start)), 1e-6)
    out = np.array([along[1], -along[0]])
    length = float(np.linalg.norm(end - start))
    u0, u1, z0, z1, w0, w1, s0, s1 = _cells(style, length, height, rng)
    u = np.stack(
        [u0, u1, u1, u0, w0, w1, w1, w0, w0, w1, w1, w0], 1
    )  # (n,12), as _WALL, _REVEAL and _PANE count
    z = np.stack([z0, z0, z1, z1, s0, s0, s1, s1, s0, s0, s1, s1], 1)
    depth = np.repeat([0.0, style.recess], [8, 4])
    vertices = stack(
        start[0] - depth * out[0] + along[0] * u, start[1] - depth * out[1] + along[1] * u, base + z
    )
    parts = [_wall(vertices, style, rng)]
    parts += _relief(start, along, out, base, length, height, style, (w0, w1, s0), rng)
    return parts


def _wall(vertices: np.ndarray, style: Style, rng: np.random.Generator) -> Mesh:
    """Stone and panes over the corners (12n,3) of n window cells."""
    glass = np.array([0.25, 0.29, 0.33]) * rng.uniform(0.6, 1.3)
    stride = np.arange(0, len(vertices), 12, dtype=np.int32)[:, None, None]
    # Curtains and blinds: a third of the windows answer like plaster, the others like glass.
    covered = rng.random(len(stride)) < 0.35
    curtain = rng.uniform(0.55, 0.9) * np.array([1.0, 0.97, 0.92])
    kinds = (
        (_STONE + stride, style.material, style.tint),
        (_PANE + stride[~covered], "glass", glass),
        (_PANE + stride[covered], "plaster", curtain),
    )
    counts = [faces.size // 3 for faces, _, _ in kinds]
    return Mesh(
        vertices,
        np.concatenate([faces.reshape(-1, 3) for faces, _, _ in kinds]),
        np.repeat(np.array([MATERIAL_INDEX[material] for _, material, _ in kinds], np.uint8), counts),
        np.repeat(np.array([tint for _, _, tint in kinds], np.float32).T, counts, axis=1).T,
    )


def _relief(
    start: np.ndarray,
    along: np.ndarray,
    out: np.ndarray,
    base: float,
    length: float,
    height: float,
    style: Style,
    window: tuple[np.ndarray, np.ndarray, np.ndarray],
    rng: np.random.Generator,
) -> list[Mesh]:
    yaw = float(np.arctan2(along[1], along[0]))
    dark = np.array(style.tint) * 0.85
    parts = []
    w0, w1, sill = window
    with_balcony = (rng.random(len(w0)) < style.balconies) & (sill > style.storey)
    if with_balcony.any():
        u = ((w0 + w1) / 2)[with_balcony]
        xy = start + u[:, None] * along + 0.6 * out
        foot = np.column_stack([xy, base + sill[with_balcony] - 0.3])
        parts.append(boxes(foot, np.array([style.cell * 0.8, 1.2, 0.15]), yaw, "concrete", dark))
        rail = np.column_stack([xy + 0.55 * out, foot[:, 2] + 0.15])
        parts.append(boxes(rail, np.array([style.cell * 0.8, 0.06, 0.9]), yaw, "metal", (0.35, 0.35, 0.37)))
    if style.pillars:
        u = np.linspace(0.3, length - 0.3, max(2, int(length / (2 * style.cell))))
        xy = start + u[:, None] * along + 0.15 * out
        parts.append(
            boxes(
                np.column_stack([xy, np.full(len(u), base)]),
                np.array([0.5, 0.35, height]),
                yaw,
                "concrete",
                dark,
            )
        )
    middle = start + 0.5 * length * along + 0.12 * out
    ledges = base + np.array([min(style.storey, height * 0.5), height - 0.35])
    parts.append(
        boxes(
            np.array([[*middle, ledges[0]], [*middle, ledges[1]]]),
            np.array([length, 0.3, 0.25]),
            yaw,
            style.material,
            dark,
        )
    )
    return parts


def building(
    centre: np.ndarray, size: np.ndarray, yaw: float, base: float, rng: np.random.Generator, eye: np.ndarray
) -> Mesh:
    """A block of `size` (length, depth, height) with relief on the sides that face `eye` (2,)."""
    style = Style.draw(rng)
    c, s = np.cos(yaw), np.sin(yaw)
    half = size[:2] / 2
    corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * half @ np.array([[c, s], [-s, c]]) + centre
    parts: list[Mesh] = []
    for i in range(4):
        a, b = corners[i], corners[(i + 1) % 4]
        outward = np.array([(b - a)[1], -(b - a)[0]]) / np.linalg.norm(b - a)
        to_eye = eye - (a + b) / 2
        if to_eye @ outward > -22 and np.hypot(*to_eye) < 85:  # sensors keep within some 20 m of the eye
            parts += facade(a, b, base, float(size[2]), style, rng)
        else:
            wall = np.array([[*a, base], [*b, base], [*b, base + size[2]], [*a, base + size[2]]])
            parts.append(quads(wall[None], style.material, style.tint))
    parts += _roof(corners, base + float(size[2]), style, rng)
    return Mesh.merge(parts)


def _roof(corners: np.ndarray, top: float, style: Style, rng: np.random.Generator) -> list[Mesh]:
    flat = np.column_stack([corners, np.full(4, top)])
    parts = [quads(flat[None], "concrete", (0.4, 0.4, 0.4))]
    if rng.random() < 0.5:
        rise = rng.uniform(1.5, 4.0)
        ridge = np.array([(flat[0] + flat[3]) / 2, (flat[1] + flat[2]) / 2]) + [0, 0, rise]
        tint = np.array([0.45, 0.22, 0.17]) if rng.random() < 0.6 else np.array([0.28, 0.28, 0.31])
        rings = np.stack([np.stack([flat[0], ridge[0], flat[3]]), np.stack([flat[1], ridge[1], flat[2]])])
        parts.append(loft(rings, "roof", tint))
    return parts
