# SPDX-License-Identifier: MIT
"""Clouds in 3-D on a page, turned with mouse or finger: no package, no network, some bytes a point.

The script `orbit_view.js` draws on a plain canvas, so that a page with tens of thousands of points stays small.
"""

from __future__ import annotations

import base64
import json
from collections.abc import Sequence
from importlib.resources import files
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hybridreg.eval.report import laid_out, page
from hybridreg.eval.report.laid_out import residuals
from hybridreg.evidence.surface_distance import FineSurfaces
from hybridreg.frames import lower_pose
from hybridreg.geometry import se3
from hybridreg.geometry.extent import sample
from hybridreg.pair import Pair
from hybridreg.resolution import tolerance

Array = NDArray[np.float64]

# Integers that a coordinate is stored as: 16 bits, with one to spare at either end.
_STEPS = 65533


class Layer(NamedTuple):
    """One cloud of a view, to be switched on and off.

    name : what its switch says
    points : (n, 3), metres
    colour : "#rrggbb"
    shown : at first
    shade : (n,) or None, 0 to 1: coloured by this instead, blue to red; NaN keeps `colour`
    size : edge of a point's square, pixels
    """

    name: str
    points: Array
    colour: str
    shown: bool = True
    shade: Array | None = None
    size: int = 2


def html(layers: Sequence[Layer], name: str = "view") -> str:
    """A view of these layers; `name` is unique on its page, and the page holds `script()` once, after it."""
    stored = [_stored(layer) for layer in layers]
    # "<" would allow the data to end its element, whatever a layer is called.
    data = json.dumps({"layers": stored, "frame": _frame(layers)}).replace("<", "\\u003c")
    return (
        f'<div class="orbit" id="{name}"><canvas tabindex="0" aria-label="both clouds in 3-D"></canvas>'
        '<div class="switches"></div><p class="caption">Drag to turn, Shift or two fingers to move, wheel or '
        "pinch to zoom; double-click starts again.</p>"
        f'<script type="application/json">{data}</script></div>'
    )


def script() -> str:
    """The script that draws every view of its page."""
    text = files("hybridreg.eval.report").joinpath("orbit_view.js").read_text(encoding="utf-8")
    return f"<script>\n{text}</script>"


def _stored(layer: Layer) -> dict[str, object]:
    points = np.asarray(layer.points, dtype=np.float64).reshape(-1, 3)
    low, high = (points.min(axis=0), points.max(axis=0)) if len(points) else (np.zeros(3), np.ones(3))
    step = np.maximum((high - low) / _STEPS, 1e-9)
    cells = np.round((points - low) / step).astype("<u2")
    shade = None
    if layer.shade is not None:
        # 255 says that there is none.
        shade = np.where(
            np.isfinite(layer.shade), np.clip(np.nan_to_num(layer.shade), 0.0, 1.0) * 254.0, 255.0
        ).astype(np.uint8)
    return {
        "name": layer.name,
        "colour": layer.colour,
        "shown": layer.shown,
        "size": layer.size,
        "low": low.tolist(),
        "step": step.tolist(),
        "points": base64.b64encode(cells.tobytes()).decode("ascii"),
        "shade": None if shade is None else base64.b64encode(shade.tobytes()).decode("ascii"),
    }


def _frame(layers: Sequence[Layer]) -> dict[str, object]:
    """Middle and half width of what is shown at first, without its few far returns."""
    shown = [layer.points for layer in layers if layer.shown and len(layer.points)]
    points = np.vstack(shown) if shown else np.zeros((1, 3))
    low, high = np.quantile(points, [0.02, 0.98], axis=0)
    return {"middle": ((low + high) / 2).tolist(), "half": max(float(np.max(high - low)) / 2, 1e-6)}


def pair_page(pair: Pair, T: Array, title: str, drawn: int) -> str:
    """A page of both clouds in the target's frame, the source coloured by its distance to the target's surfaces.

    Parameters
    ----------
    T : (4, 4), source to target, in the user's coordinates
    drawn : points of each cloud, at most
    """
    source, target = (sample(cloud.points, drawn) for cloud in (pair.source, pair.target))
    lowered = lower_pose(T, pair)
    moved = se3.apply(lowered, source)
    most = laid_out.reddest(tolerance(pair.source, pair.target))
    shade = residuals(moved, FineSurfaces.of(pair).target) / most
    layers = [
        Layer("target", target, laid_out.TARGET),
        Layer("source", moved, laid_out.ALONE, shade=shade),
        Layer("source as it came", source, laid_out.BEFORE, shown=False),
    ]
    words = (
        f"The source is coloured by its distance to the target's surfaces, blue 0 to red {most:g} m and more; sand "
        f"where none is near. Drawn are {len(source):,} of its {len(pair.source):,} points, and {len(target):,} of "
        f"the target's {len(pair.target):,}."
    )
    return page.page(title, [page.heading(title, 1), html(layers), page.paragraph(words), script()])
