# SPDX-License-Identifier: MIT
"""Pictures of one pose for its report: residuals from above and from the side, free-space violations, rivals.

Each is a small picture of its own, so that a page can put them side by side or, on a phone, below one another. The
background is transparent and the lettering grey: both are read on light and on dark paper.
"""

from __future__ import annotations

import base64
import io
from collections.abc import Iterator
from html import escape
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from hybridreg.eval.report.cloud_pictures import new_figure, window
from hybridreg.eval.report.laid_out import ALONE, TARGET, LaidOut
from hybridreg.geometry import se3

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Array = NDArray[np.float64]

_INCHES = (5.0, 4.8)
_STRIP = (5.0, 3.1)  # of a side view
_INK = "#808080"  # grey, on white as on black
_SOURCE = "#d95f02"  # orange
_THROUGH = "#e7298a"  # pink
_MOST_RIVALS = 3
# Lengths of the axes that are drawn: from above x and y, from the side x and z.
_ABOVE, _SIDE = (0, 1), (0, 2)


def residual_pictures(laid: LaidOut, most: float) -> Iterator[str]:
    """The pose from above and from the side, source points coloured by residual, 0 to `most` metres."""
    from matplotlib.ticker import MaxNLocator

    for axes, words in ((_ABOVE, "from above"), (_SIDE, "from the side")):
        figure = new_figure(_INCHES if axes == _ABOVE else _STRIP)
        panel = _panel(figure, laid, axes, laid.source)
        alone = ~np.isfinite(laid.residual)
        _dots(panel, laid.source[alone][:, axes], ALONE, 1.0)
        order = np.argsort(laid.residual[~alone])  # the largest on top
        points, residual = laid.source[~alone][order], laid.residual[~alone][order]
        drawn = panel.scatter(
            points[:, axes[0]], points[:, axes[1]], s=1.2, c=residual, cmap="turbo", vmin=0.0, vmax=most,
            linewidths=0, rasterized=True,
        )  # fmt: skip
        bar = figure.colorbar(
            drawn, ax=panel, location="bottom", shrink=0.8, extend="max", aspect=30, pad=0.02
        )
        bar.set_label("distance to the target's surface, m", color=_INK, fontsize=9)
        bar.ax.tick_params(colors=_INK, labelsize=9)
        bar.locator = MaxNLocator(4)
        bar.update_ticks()
        bar.outline.set_edgecolor(_INK)
        yield _picture(figure, f"Both clouds at the pose, {words}, coloured by residual", f"Seen {words}")


def violation_picture(laid: LaidOut) -> str:
    """Where a sensor saw through what the pose puts there, from above, with the sensors."""
    figure = new_figure(_INCHES)
    panel = _panel(figure, laid, _ABOVE, np.vstack([laid.source, *laid.sensors.values()]))
    _dots(panel, laid.source[:, :2], _SOURCE, 0.6, alpha=0.35)
    for name, marker in (("source", "^"), ("target", "s")):
        places = laid.sensors.get(name, np.empty((0, 3)))[:20]
        if len(places):
            panel.plot(
                places[:, 0], places[:, 1], marker, color="#1b9e77", markersize=8, label=f"{name}'s sensor"
            )
    if len(laid.violations):
        x, y = laid.violations[:, :2].T
        panel.scatter(
            x, y, s=22, facecolors="none", edgecolors=_THROUGH, linewidths=1.2, label="seen through"
        )
    _legend(panel)
    return _picture(figure, "Free-space violations from above", "Where a sensor saw through, from above")


def rival_pictures(laid: LaidOut, words: list[str]) -> Iterator[str]:
    """The pose beside its best rivals, each from above; `words` (r,) tell how far each lies from the pose."""
    best = laid.rivals[:_MOST_RIVALS]
    everything = np.vstack([laid.source, *(se3.apply(T, laid.source) for T in best)])
    for T, name in zip((np.eye(4), *best), ("the pose", *words), strict=False):
        figure = new_figure(_INCHES)
        panel = _panel(figure, laid, _ABOVE, everything)
        _dots(panel, se3.apply(T, laid.source)[:, :2], _SOURCE, 1.0)
        yield _picture(figure, f"Both clouds from above: {name}", name)


def _panel(figure: Figure, laid: LaidOut, axes: tuple[int, int], framed: Array) -> Any:
    panel = figure.subplots()
    _dots(panel, laid.target[:, axes], TARGET, 0.8)
    low, high = window(framed[:, axes])
    if axes == _SIDE:  # a side view is a strip: as high as the points are
        heights = np.quantile(framed[:, 2], [0.005, 0.995])
        half = max(0.65 * float(heights[1] - heights[0]), 0.2 * float(high[0] - low[0]), 1e-6)
        low, high = np.array([low[0], heights.mean() - half]), np.array([high[0], heights.mean() + half])
    panel.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), aspect="equal", facecolor="none")
    panel.set_xlabel("x, m", color=_INK, fontsize=9)
    panel.set_ylabel("y, m" if axes == _ABOVE else "z, m", color=_INK, fontsize=9)
    panel.tick_params(colors=_INK, labelsize=9)
    for spine in panel.spines.values():
        spine.set_edgecolor(_INK)
    return panel


def _dots(panel: Any, points: Array, colour: str, size: float, alpha: float = 1.0) -> None:
    panel.scatter(points[:, 0], points[:, 1], s=size, c=colour, alpha=alpha, linewidths=0, rasterized=True)


def _legend(panel: Any) -> None:
    if panel.get_legend_handles_labels()[0]:
        panel.legend(
            loc="upper center",
            bbox_to_anchor=(0.5, -0.13),
            ncols=3,
            fontsize=9,
            columnspacing=1.0,
            handletextpad=0.3,
            frameon=False,
            labelcolor=_INK,
        )


def _picture(figure: Figure, alt: str, caption: str) -> str:
    stream = io.BytesIO()
    figure.savefig(stream, format="webp", transparent=True, dpi=150, pil_kwargs={"quality": 80})
    data = base64.b64encode(stream.getvalue()).decode("ascii")
    return (
        f'<figure><img src="data:image/webp;base64,{data}" alt="{escape(alt)}">'
        f"<figcaption>{escape(caption)}</figcaption></figure>"
    )
