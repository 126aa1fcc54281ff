# SPDX-License-Identifier: MIT
"""Interactive figures for the HTML page, by plotly, imported when the first is drawn."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from hybridreg.eval.run.row import Row
from hybridreg.eval.score import curves, errors
from hybridreg.eval.score.protocols import Protocol
from hybridreg.geometry import se3

if TYPE_CHECKING:
    from plotly.graph_objects import Figure

Array = NDArray[np.float64]

# Points drawn per cloud: enough to see walls and poles, few enough for a page with several views.
THINNED = 4000
BEFORE = "#999999"  # grey
AFTER = "#d95f02"  # orange
TRUE = "#1b9e77"  # green
TARGET = "#3b6fb6"  # blue


def recall_curves(rows: Mapping[str, Sequence[Row]], protocol: Protocol) -> list[Figure]:
    """Recall against the rotation and the translation threshold, one line a method."""
    measured = {name: errors.of(each) for name, each in rows.items()}
    return [
        _curve_figure(
            {name: curves.sweep(e, protocol, "rre") for name, e in measured.items()},
            f"RRE threshold, ° (RTE < {protocol.rte_m:g} m)",
        ),
        _curve_figure(
            {name: curves.sweep(e, protocol, "rte") for name, e in measured.items()},
            f"RTE threshold, m (RRE < {protocol.rre_deg:g}°)",
        ),
    ]


def confidence(rows: Mapping[str, Sequence[Row]], protocol: Protocol) -> Figure:
    """Confidence of every pair against its worst error in units of the thresholds; below 1 is a success."""
    from plotly.graph_objects import Figure

    figure = Figure()
    for name, each in rows.items():
        told = [row for row in each if row.confidence is not None and row.T_true is not None]
        if told:
            figure.add_scatter(
                x=[row.confidence for row in told],
                y=np.maximum(badness(told, protocol), 1e-3),
                mode="markers",
                name=name,
                text=[f"{row.id}: {row.verdict}" for row in told],
            )
    figure.add_hline(y=1.0, line_dash="dot")
    figure.update_yaxes(type="log", title="error / threshold (success below 1)")
    return _dressed(figure, "confidence")


def reliability(rows: Mapping[str, Sequence[Row]], protocol: Protocol) -> Figure:
    """Reliability diagram: share of successes among pairs of similar confidence; calibrated on the diagonal."""
    from plotly.graph_objects import Figure

    figure = Figure()
    for name, each in rows.items():
        told = [row for row in each if row.confidence is not None and row.T_true is not None]
        bins = reliability_bins(
            np.array([row.confidence for row in told], dtype=np.float64), errors.of(told).success(protocol)
        )
        if told:
            figure.add_scatter(
                x=bins[:, 0],
                y=100.0 * bins[:, 1],
                mode="lines+markers",
                name=name,
                text=[f"{n:.0f} pairs" for n in bins[:, 2]],
            )
    figure.add_shape(type="line", x0=0, y0=0, x1=1, y1=100, line_dash="dot")
    figure.update_yaxes(title="successes, %", range=[-2, 102])
    return _dressed(figure, "confidence, in fifths")


def reliability_bins(confidence: Array, success: NDArray[np.bool_], n_bins: int = 5) -> Array:
    """Mean confidence, share of successes and count of each bin that is not empty, (k, 3)."""
    member = np.minimum((confidence * n_bins).astype(int), n_bins - 1)
    filled = [member == b for b in range(n_bins) if np.any(member == b)]
    rows = [(confidence[m].mean(), success[m].mean(), m.sum()) for m in filled]
    return np.array(rows, dtype=np.float64).reshape(-1, 3)


def badness(rows: Sequence[Row], protocol: Protocol) -> Array:
    """The larger of both errors over its threshold, (n,); infinite without a pose."""
    measured = errors.of(rows)
    worst = np.maximum(measured.rre_deg / protocol.rre_deg, measured.rte_m / protocol.rte_m)
    result: Array = np.where(measured.failed, np.inf, worst)
    return result


def clouds(source: Array, target: Array, T: Array, truth: Array | None = None) -> Figure:
    """Both clouds in the target's frame: the source before alignment, after it, and under the true pose.

    Parameters
    ----------
    source, target : (N, 3), (M, 3), metres
    T, truth : (4, 4), source to target
    """
    from plotly.graph_objects import Figure

    moving = thin(source)
    figure = Figure()
    _add_cloud(figure, thin(target), "target", TARGET, True)
    _add_cloud(figure, se3.apply(T, moving), "source, aligned", AFTER, True)
    _add_cloud(figure, moving, "source, before", BEFORE, "legendonly")
    if truth is not None:
        _add_cloud(figure, se3.apply(truth, moving), "source, true pose", TRUE, "legendonly")
    figure.update_layout(
        height=480, margin={"l": 0, "r": 0, "t": 0, "b": 0}, scene={"aspectmode": "data"}, legend={"y": 0.95}
    )
    return figure


def thin(points: Array, n: int = THINNED) -> Array:
    """About `n` of the points (N, 3), evenly along the file."""
    return points[:: max(1, len(points) // n)]


def to_html(figure: Figure) -> str:
    """A figure as a piece of a page that already contains plotly's script."""
    text: str = figure.to_html(full_html=False, include_plotlyjs=False, config={"displaylogo": False})
    return text


def script() -> str:
    """plotly's script, to be included in a page once."""
    from plotly.offline import get_plotlyjs

    text: str = get_plotlyjs()
    return text


def _add_cloud(figure: Figure, points: Array, name: str, colour: str, visible: Any) -> None:
    x, y, z = np.round(points, 2).astype(np.float32).T
    figure.add_scatter3d(
        x=x,
        y=y,
        z=z,
        mode="markers",
        name=name,
        visible=visible,
        hoverinfo="skip",
        marker={"size": 1.5, "color": colour},
    )


def _curve_figure(lines: Mapping[str, curves.Curve], title: str) -> Figure:
    from plotly.graph_objects import Figure

    figure = Figure()
    for name, curve in lines.items():
        figure.add_scatter(x=curve.threshold, y=100.0 * curve.recall, name=name, mode="lines")
    figure.update_yaxes(title="recall, %", range=[-2, 102])
    return _dressed(figure, title)


def _dressed(figure: Figure, x_title: str) -> Figure:
    figure.update_xaxes(title=x_title)
    figure.update_layout(
        height=360, margin={"l": 60, "r": 10, "t": 10, "b": 50}, template="simple_white", showlegend=True
    )
    return figure
