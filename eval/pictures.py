# SPDX-License-Identifier: MIT
"""A small picture of two clouds before and after, by matplotlib, without a display."""

from __future__ import annotations

import os
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hybridreg import se3
from hybridreg.io import atomic_path

Array = NDArray[np.float64]

_SOURCE, _TARGET = "#d95f02", "#3b6fb6"
_DRAWN = 30_000


def before_after(path: str | os.PathLike[str], source: Array, target: Array, T: Array) -> None:
    """Write a PNG: both clouds from above in the target's frame, as they came and aligned.

    Parameters
    ----------
    source, target : (N, 3), (M, 3), metres
    T : (4, 4), source to target
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    moving, still = _thin(source), _thin(target)
    views = {"before": moving, "after": se3.apply(T, moving)}
    window = _window(np.vstack(list(views.values())))
    figure = Figure(figsize=(10, 5.2), dpi=110, layout="constrained")
    FigureCanvasAgg(figure)
    for axes, (title, points) in zip(figure.subplots(1, 2), views.items(), strict=True):
        _draw(axes, points, still, window)
        axes.set_title(f"{title}, from above")
    with atomic_path(path) as temporary:
        figure.savefig(temporary, format="png")


def _window(points: Array) -> tuple[Array, Array]:
    # Around the cloud that moves, without its few far returns, which would shrink the scene to a dot.
    low, high = np.quantile(points[:, :2], [0.02, 0.98], axis=0)
    middle, half = (low + high) / 2, 0.65 * float(max(high - low))
    return middle - half, middle + half


def _draw(axes: Any, source: Array, target: Array, window: tuple[Array, Array]) -> None:
    axes.scatter(target[:, 0], target[:, 1], s=0.8, c=_TARGET, linewidths=0, label="target")
    axes.scatter(source[:, 0], source[:, 1], s=0.8, c=_SOURCE, linewidths=0, label="source")
    low, high = window
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), xlabel="x, m", aspect="equal")
    axes.legend(markerscale=8, loc="upper right")


def _thin(points: Array) -> Array:
    return points[:: max(1, len(points) // _DRAWN)]
