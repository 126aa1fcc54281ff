# SPDX-License-Identifier: MIT
"""Pictures of what the stages of one run produced: matches by correctness, and the overlap mask beside the camera
image."""

from __future__ import annotations

import os
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hybridreg.eval.report.cloud_pictures import new_figure, save, thin, window
from hybridreg.eval.run.controls import true_overlap
from hybridreg.eval.score import metrics
from hybridreg.geometry import se3
from hybridreg.pipeline import Trace

Array = NDArray[np.float64]
Bools = NDArray[np.bool_]

RIGHT = "#1b9e77"  # green
WRONG = "#d7301f"  # red
POINTS = "#b8b8b8"  # grey
# True positives, false positives, false negatives, true negatives of the mask.
_KINDS = (
    ("kept, overlaps", RIGHT),
    ("kept, does not overlap", WRONG),
    ("dropped, overlaps", "#e6ab02"),
    ("dropped, does not overlap", POINTS),
)
# Lines drawn, right and wrong thinned alike: more cover each other.
_LINES = 500
_MANY = 5000


def matches(path: str | os.PathLike[str], trace: Trace, T_true: Array, inlier_m: float = 1.0) -> None:
    """Write a PNG of `draw_matches`."""
    figure = new_figure((12, 6))
    axes = figure.subplots()
    draw_matches(axes, trace, T_true, inlier_m)
    axes.set_title(f"{len(trace.matches)} matches, right within {inlier_m:g} m", pad=18)
    save(figure, path)


def draw_matches(axes: Any, trace: Trace, T_true: Array, inlier_m: float = 1.0) -> float:
    """Both clouds from above, side by side and turned alike, with a line for every match; the share that is right.

    The source is drawn under its true pose and moved to the right, so that right matches are parallel. The wrong ones
    lie on top, and the legend counts both.

    Parameters
    ----------
    trace : of `Pipeline.trace`
    T_true : (4, 4), source to target, between the clouds minus their offsets
    inlier_m : a match is right when it is off by less, metres
    """
    target, source = trace.scene.target.points, se3.apply(T_true, trace.scene.source.points)
    low, high = window(np.vstack([target, source]))
    aside = np.array([1.15 * (high[0] - low[0]), 0.0, 0.0])
    found = trace.matches
    off = metrics.match_residuals(found.source, found.target, T_true)
    right = off < inlier_m
    for points, label in ((target, "target"), (source + aside, "source, under its true pose")):
        _scatter(axes, points, POINTS)
        middle = (low[0] + high[0]) / 2 + (0.0 if label == "target" else aside[0])
        axes.text(middle, high[1], label, ha="center", va="bottom")
    moved = se3.apply(T_true, found.source) + aside
    drawn = np.zeros(len(found), dtype=bool)
    drawn[:: max(1, len(found) // _LINES)] = True
    for which, colour, label in ((right, RIGHT, "right"), (~right, WRONG, "wrong")):
        shown = which & drawn
        _lines(axes, found.target[shown], moved[shown], colour, f"{which.sum()} {label}")
    axes.set(xlim=(low[0], high[0] + aside[0]), ylim=(low[1], high[1]), aspect="equal", xlabel="x, m")
    axes.legend(loc="lower right")
    return float(right.mean()) if len(right) else 0.0


def mask(path: str | os.PathLike[str], trace: Trace, T_true: Array, threshold: float = 0.5) -> None:
    """Write a PNG of `draw_masks`."""
    figure = new_figure((16, 5.2))
    panels = figure.subplots(1, 3)
    draw_masks(panels, trace, T_true, threshold)
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower left", ncols=4, markerscale=6)
    save(figure, path)


def draw_masks(panels: Any, trace: Trace, T_true: Array, threshold: float = 0.5) -> None:
    """Both clouds from above, coloured by what the overlap mask says of them and what is true, and the photograph where
    there is one, into three panels.

    A point overlaps when the other cloud, under the true pose, has a point within twice the levels' spacing; it is
    kept when its probability is above the threshold that the match stage applies (`truth.mask_threshold`).
    """
    scene, overlap = trace.scene, trace.overlap
    in_source, in_target = true_overlap(scene, T_true)
    sides = (
        ("source", scene.source.points, overlap.source > threshold, in_source),
        ("target", scene.target.points, overlap.target > threshold, in_target),
    )
    for axes, (name, points, kept, true) in zip(panels, sides, strict=False):
        _kinds(axes, points, kept, true)
        scores = metrics.mask_scores(kept, true)
        axes.set_title(
            f"{name}, kept above {threshold:g}: precision {scores.precision:.2f}, recall {scores.recall:.2f}"
        )
        # What was matched all the same where the mask left too little.
        fallback = [
            note.partition("the ")[2] for note in scene.notes if note.startswith(f"{name}: the overlap mask")
        ]
        axes.set_xlabel(fallback[0].partition(" (")[0] if fallback else "x, m", fontsize=8)
    _image_panel(panels[2], scene.pair.image)


def _kinds(axes: Any, points: Array, kept: Bools, true: Bools) -> None:
    low, high = window(points)
    members = (kept & true, kept & ~true, ~kept & true, ~kept & ~true)
    for member, (label, colour) in reversed(list(zip(members, _KINDS, strict=True))):
        _scatter(axes, points[member], colour, label)
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), aspect="equal", xlabel="x, m")


def _image_panel(axes: Any, image: NDArray[np.uint8] | None) -> None:
    axes.set_axis_off()
    axes.set_title("no image" if image is None else "image")
    if image is not None:
        axes.imshow(image)


def _scatter(axes: Any, points: Array, colour: str, label: str | None = None) -> None:
    drawn = thin(points)
    size = 1.0 if len(drawn) > _MANY else 4.0
    axes.scatter(drawn[:, 0], drawn[:, 1], s=size, c=colour, linewidths=0, label=label, rasterized=True)


def _lines(axes: Any, ends: Array, others: Array, colour: str, label: str) -> None:
    from matplotlib.collections import LineCollection

    segments = np.stack([ends[:, :2], others[:, :2]], axis=1)
    axes.add_collection(LineCollection(list(segments), colors=colour, linewidths=0.6, alpha=0.6, label=label))
