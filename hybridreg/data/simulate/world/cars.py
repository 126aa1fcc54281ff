# SPDX-License-Identifier: MIT
"""Vehicles as lofted bodies: saloon, hatchback, estate, SUV, van, lorry, bus."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hybridreg.data.simulate.world.mesh import Mesh
from hybridreg.data.simulate.world.solids import boxes, loft, tubes

_COLOURS = np.array(
    [[.9, .9, .9], [.75, .76, .78], [.12, .12, .13], [.3, .31, .33], [.6, .1, .1], [.12, .2, .42], [.2, .3, .25],
     [.7, .62, .45], [.85, .8, .75], [.35, .15, .12]]
)  # fmt: skip


@dataclass(frozen=True)
class Shape:
    """Side view as shares of length (x) and height (z), and the usual size in metres."""

    size: tuple[float, float, float]  # length, width, height
    belt: tuple[tuple[float, float], ...]  # top edge of the lower body
    cabin: tuple[tuple[float, float], ...]  # roof line above the belt


SHAPES = {
    "saloon": Shape((4.6, 1.80, 1.45), ((0, .5), (.03, .6), (.28, .68), (.8, .68), (.97, .65), (1, .5)),
                    ((.25, .67), (.42, .98), (.68, 1.), (.86, .68))),
    "hatchback": Shape((4.0, 1.75, 1.50), ((0, .48), (.04, .58), (.25, .64), (.95, .66), (1, .45)),
                       ((.22, .63), (.38, .97), (.8, 1.), (.98, .66))),
    "estate": Shape((4.7, 1.82, 1.50), ((0, .48), (.03, .6), (.27, .66), (.97, .67), (1, .45)),
                    ((.25, .65), (.4, .97), (.88, 1.), (.98, .66))),
    "suv": Shape((4.6, 1.90, 1.75), ((0, .5), (.03, .62), (.25, .66), (.97, .66), (1, .45)),
                 ((.24, .65), (.36, .98), (.9, 1.), (.99, .65))),
    "van": Shape((5.2, 2.00, 2.20), ((0, .42), (.05, .5), (.16, .56), (.99, .56), (1, .3)),
                 ((.12, .55), (.28, .97), (.97, 1.), (1., .55))),
}  # fmt: skip


def car(rng: np.random.Generator, kind: str | None = None) -> Mesh:
    """A vehicle standing on the origin, nose towards +x."""
    kind = kind or str(rng.choice([*SHAPES, "lorry", "bus"], p=[0.26, 0.22, 0.14, 0.18, 0.12, 0.05, 0.03]))
    colour = _COLOURS[rng.integers(len(_COLOURS))] * rng.uniform(0.85, 1.1)
    if kind in ("lorry", "bus"):
        return _large(kind, colour, rng)
    shape = SHAPES[kind]
    length, width, height = np.array(shape.size) * rng.uniform(0.93, 1.07, 3)
    paint = "dark_paint" if colour.mean() < 0.2 else "paint"
    clear = 0.14 * height
    lower = _body(np.array(shape.belt), length, height, clear, (0.94 * width, width, 0.93 * width))
    cabin = _body(
        np.array(shape.cabin), length, height, 0.55 * height, (0.9 * width, 0.88 * width, 0.7 * width)
    )
    roof = np.array(shape.cabin)[1:3]
    top = np.array([[(0.5 - roof.mean(0)[0]) * length, 0, roof[:, 1].min() * height - 0.04]])
    panel = boxes(top, np.array([(roof[1, 0] - roof[0, 0]) * length, 0.72 * width, 0.06]), 0.0, paint, colour)
    return Mesh.merge(
        [
            loft(lower, paint, colour),
            loft(cabin, "glass", (0.13, 0.15, 0.17)),
            panel,
            _wheels(length, width, 0.32),
        ]
    )


def lorry(rng: np.random.Generator) -> Mesh:
    """A lorry standing on the origin."""
    return car(rng, "lorry")


def _body(
    line: np.ndarray, length: float, height: float, bottom: float, widths: tuple[float, float, float]
) -> np.ndarray:
    """Rings (S,6,3) under a top edge `line` (S,2); `widths` at the sill, in the middle and at the top edge."""
    x = (0.5 - line[:, 0]) * length
    top = line[:, 1] * height
    narrow = np.where((line[:, 0] < 0.05) | (line[:, 0] > 0.96), 0.86, 1.0)[:, None]
    y = np.array([-widths[0], -widths[1], -widths[2], widths[2], widths[1], widths[0]]) / 2 * narrow
    z = bottom + np.outer(np.maximum(top - bottom, 0.02), [0, 0.45, 1, 1, 0.45, 0])
    return np.stack([np.broadcast_to(x[:, None], y.shape), y, z], -1)


def _wheels(length: float, width: float, radius: float) -> Mesh:
    x, y = 0.31 * length, 0.5 * width - 0.1
    hub = np.array([[x, y, radius], [x, -y, radius], [-x, y, radius], [-x, -y, radius]])
    side = np.array([[0, 0.11, 0]])
    return Mesh.merge(
        [
            tubes(hub - side, hub + side, radius, radius, "rubber", (0.06, 0.06, 0.06), sides=10),
            # A hub so thin that only its disc shows: tubes are open at their ends.
            tubes(hub - side, hub + side, radius * 0.98, 0.0, "metal", (0.3, 0.3, 0.32), sides=10),
        ]
    )


def _large(kind: str, colour: np.ndarray, rng: np.random.Generator) -> Mesh:
    length, height = (rng.uniform(6.5, 9.0), rng.uniform(2.9, 3.6)) if kind == "lorry" else (11.5, 3.1)
    width = 2.45
    box_tint = rng.uniform(0.5, 0.95, 3) if kind == "lorry" else colour
    cab = 2.0 if kind == "lorry" else 0.2
    body = boxes(
        np.array([[-cab / 2, 0, 0.75 if kind == "lorry" else 0.35]]),
        np.array([length - cab, width, height - 0.75]),
        0.0,
        "paint",
        box_tint,
    )
    front = boxes(np.array([[length / 2 - 1.0, 0, 0.5]]), np.array([1.9, 2.3, 2.1]), 0.0, "paint", colour)
    panes = boxes(
        np.array([[0.0, 0, 1.5]]) if kind == "bus" else np.array([[length / 2 - 0.9, 0, 1.6]]),
        np.array([length * 0.94, width + 0.02, 0.9]) if kind == "bus" else np.array([1.75, 2.33, 0.8]),
        0.0,
        "glass",
        (0.12, 0.14, 0.16),
    )
    return Mesh.merge([body, front, panes, _wheels(length, width, 0.48)])
