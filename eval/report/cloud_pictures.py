# SPDX-License-Identifier: MIT
"""Pictures of clouds from above, by matplotlib, without a display."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from hybridreg.geometry import se3
from hybridreg.geometry.extent import sample
from hybridreg.io import atomic_path

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Array = NDArray[np.float64]

_SOURCE = "#d95f02"  # orange
_TARGET = "#3b6fb6"  # blue
_DRAWN = 30_000


def before_after(path: str | os.PathLike[str], source: Array, target: Array, T: Array) -> None:
    """Write a PNG: both clouds from above in the target's frame, before and after alignment.

    Parameters
    ----------
    source, target : (N, 3), (M, 3), metres
    T : (4, 4), source to target
    """
    moving, still = thin(source), thin(target)
    views = {"before": moving, "after": se3.apply(T, moving)}
    frame = window(np.vstack(list(views.values())))
    figure = new_figure((10, 5.2))
    for axes, (title, points) in zip(figure.subplots(1, 2), views.items(), strict=True):
        draw_clouds(axes, points, still, frame)
        axes.set_title(f"{title}, from above")
        axes.set_xlabel("x, m")
        axes.legend(markerscale=8, loc="upper right")
    save(figure, path)


def new_figure(inches: tuple[float, float]) -> Figure:
    """An empty figure that needs no display."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=inches, dpi=110, layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def save(figure: Figure, path: str | os.PathLike[str]) -> None:
    """Write a figure as PNG, or as PDF where the name ends so, whole or not at all."""
    pdf = os.fspath(path).lower().endswith(".pdf")
    with atomic_path(path) as temporary:
        # Without the date two runs write the same bytes.
        figure.savefig(
            temporary, format="pdf" if pdf else "png", metadata={"CreationDate": None} if pdf else None
        )


def save_both(figure: Figure, folder: str | os.PathLike[str], name: str) -> list[Path]:
    """Write `name.png` and `name.pdf`."""
    files = [Path(folder) / f"{name}.{kind}" for kind in ("png", "pdf")]
    for file in files:
        save(figure, file)
    return files


def window(points: Array) -> tuple[Array, Array]:
    """Corners (2,), (2,) of a square around points (N, 3), without their few far returns."""
    # Those would shrink the scene to a dot.
    low, high = np.quantile(points[:, :2], [0.02, 0.98], axis=0)
    middle, half = (low + high) / 2, 0.65 * float(max(high - low))
    return middle - half, middle + half


def draw_clouds(axes: Any, source: Array, target: Array, window: tuple[Array, Array]) -> None:
    """Both clouds from above, (N, 3) and (M, 3), within the window's corners."""
    for points, colour, label in ((target, _TARGET, "target"), (source, _SOURCE, "source")):
        # As pixels in a PDF too: tens of thousands of circles take a viewer minutes.
        axes.scatter(points[:, 0], points[:, 1], s=0.8, c=colour, linewidths=0, label=label, rasterized=True)
    low, high = window
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), aspect="equal")


def thin(points: Array) -> Array:
    """The points (N, 3), or a subset where a picture cannot show more."""
    return sample(points, _DRAWN)
