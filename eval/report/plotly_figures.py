# SPDX-License-Identifier: MIT
"""Interactive figures for the HTML page, by plotly, imported when the first is drawn."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from hybridreg.eval.report.line_styles import Style
from hybridreg.eval.run.row import Row
from hybridreg.eval.score import curves, errors
from hybridreg.eval.score.protocols import Protocol

if TYPE_CHECKING:
    from plotly.graph_objects import Figure

Array = NDArray[np.float64]

# Lettering and axes: grey, on white paper as on black.
_INK = "#808080"


def recall_curves(
    rows: Mapping[str, Sequence[Row]], looks: Mapping[str, Style], protocol: Protocol
) -> list[Figure]:
    """Recall against the rotation and the translation threshold, one line a method."""
    measured = {name: errors.of(each) for name, each in rows.items()}
    return [
        _curve_figure(
            {name: curves.sweep(e, protocol, "rre") for name, e in measured.items()},
            looks,
            f"RRE threshold, ° (RTE < {protocol.rte_m:g} m)",
            protocol.rre_deg,
        ),
        _curve_figure(
            {name: curves.sweep(e, protocol, "rte") for name, e in measured.items()},
            looks,
            f"RTE threshold, m (RRE < {protocol.rre_deg:g}°)",
            protocol.rte_m,
        ),
    ]


def confidence(rows: Mapping[str, Sequence[Row]], looks: Mapping[str, Style], protocol: Protocol) -> Figure:
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
                marker={"color": looks[name].colour},
                name=name,
                text=[f"{row.id}: {row.verdict}" for row in told],
            )
    figure.add_hline(y=1.0, line_dash="dot", line_color=_INK)
    figure.update_yaxes(type="log", title="error / threshold (success below 1)")
    return _dressed(figure, "confidence")


def reliability(rows: Mapping[str, Sequence[Row]], looks: Mapping[str, Style], protocol: Protocol) -> Figure:
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
                line={"color": looks[name].colour, "dash": looks[name].plotly},
                name=name,
                text=[f"{n:.0f} pairs" for n in bins[:, 2]],
            )
    figure.add_shape(type="line", x0=0, y0=0, x1=1, y1=100, line_dash="dot", line_color=_INK)
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


def to_html(figure: Figure) -> str:
    """A figure as a piece of a page that already contains plotly's script."""
    # Without plotly's bar of buttons, which lies over the curves; drag and double-click zoom without it.
    config = {"displayModeBar": False, "responsive": True}
    text: str = figure.to_html(full_html=False, include_plotlyjs=False, config=config)
    return text


def script() -> str:
    """plotly's script, to be included in a page once."""
    from plotly.offline import get_plotlyjs

    text: str = get_plotlyjs()
    return text


def _curve_figure(
    lines: Mapping[str, curves.Curve], looks: Mapping[str, Style], title: str, at: float
) -> Figure:
    from plotly.graph_objects import Figure

    figure = Figure()
    for name, curve in lines.items():
        line = {"color": looks[name].colour, "dash": looks[name].plotly, "width": 2}
        figure.add_scatter(
            x=curve.threshold, y=100.0 * curve.recall, name=name, mode="lines", line=line, cliponaxis=False
        )
    figure.add_vline(x=at, line_dash="dot", line_color=_INK, line_width=1)
    figure.update_yaxes(title="recall, %", range=[-2, 102])
    return _dressed(figure, title)


def _dressed(figure: Figure, x_title: str) -> Figure:
    figure.update_xaxes(title=x_title)
    axis = {"color": _INK, "gridcolor": "rgba(128,128,128,0.25)", "zerolinecolor": "rgba(128,128,128,0.5)"}
    figure.update_xaxes(**axis)
    figure.update_yaxes(**axis)
    figure.update_layout(
        height=340,
        margin={"l": 55, "r": 12, "t": 12, "b": 45},
        template="none",
        showlegend=False,  # one for all panels stands above them
        paper_bgcolor="rgba(0,0,0,0)",
        plot_bgcolor="rgba(0,0,0,0)",
        font={"color": _INK},
    )
    return figure
