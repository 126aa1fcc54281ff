# SPDX-License-Identifier: MIT
"""Both clouds laid on one another, to be turned with the mouse."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from hybridreg.geometry import se3
from hybridreg.geometry.extent import sample
from hybridreg.geometry.fitness import Overlay
from hybridreg.runtime.optional_packages import load

Array = NDArray[np.float64]

# Points of a cloud that a browser turns without stuttering.
_SHOWN = 50_000
_COLOURS = {"target": "#3b6fb6", "source, aligned": "#d95f02", "source, before": "#999999"}


def figure(overlay: Overlay) -> Any:
    """A plotly figure of the target and of the source before and after, at most 50,000 points each, metres.

    Coordinates are those of the clouds with their map's offset taken off: a browser counts in single precision.

    Raises
    ------
    ImportError
        Without plotly.
    """
    graph = load("plotly.graph_objects", "result.plot()")
    source, target = sample(overlay.source, _SHOWN), sample(overlay.target, _SHOWN)
    clouds = {
        "target": target,
        "source, aligned": se3.apply(overlay.T_target_source, source),
        "source, before": source,
    }
    shown = graph.Figure()
    for name, points in clouds.items():
        x, y, z = points.astype(np.float32).T
        shown.add_trace(
            graph.Scatter3d(
                x=x, y=y, z=z, mode="markers", name=name, hoverinfo="skip",
                visible="legendonly" if name == "source, before" else True,
                marker={"size": 1.5, "color": _COLOURS[name]},
            )
        )  # fmt: skip
    shown.update_layout(scene={"aspectmode": "data"}, margin={"l": 0, "r": 0, "t": 0, "b": 0})
    return shown
