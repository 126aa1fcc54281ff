# SPDX-License-Identifier: MIT
"""Figure: pairs in rows, methods in columns, each as it came out, between the input and the truth."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from hybridreg.data.dataset import ids_of
from hybridreg.eval.report.cloud_pictures import draw_clouds, new_figure, save_both, thin, window
from hybridreg.eval.report.figure_choice import row_of, wrapped
from hybridreg.eval.run.row import Row
from hybridreg.eval.score import errors
from hybridreg.eval.score.protocols import Protocol
from hybridreg.eval.scored_table import Entry
from hybridreg.frames import lower_pose
from hybridreg.geometry import se3
from hybridreg.pair import LabelledPair

_RIGHT, _WRONG = "#1b9e77", "#d7301f"
_CELL = 2.6  # inches


def write(
    folder: str | os.PathLike[str],
    entries: Sequence[Entry],
    pairs: Sequence[LabelledPair],
    names: Sequence[str],
    protocol: Protocol,
) -> list[Path]:
    """Write `registrations.png` and `registrations.pdf`: target blue, source orange, from above in the target's frame.

    The window of a row is that of the truth, so that a source that was put elsewhere leaves it. Frames are green where
    the protocol calls the pose a success.

    Raises
    ------
    OSError, ValueError
        A pair cannot be read, or a file cannot be written.
    """
    titles = ["input", *(wrapped(entry.name) for entry in entries), "truth"]
    figure = new_figure((_CELL * len(titles), (_CELL + 0.5) * len(names) + 0.6))
    grid = figure.subplots(len(names), len(titles), squeeze=False)
    ids = ids_of(pairs)
    for line, name in zip(grid, names, strict=True):
        labelled = pairs[ids.index(name)]
        truth = lower_pose(labelled.T_target_source, labelled.pair)
        source, target = thin(labelled.pair.source.points), thin(labelled.pair.target.points)
        frame = window(np.vstack([se3.apply(truth, source), target]))
        draw_clouds(line[0], source, target, frame)
        draw_clouds(line[-1], se3.apply(truth, source), target, frame)
        line[0].set_ylabel(name)
        for axes, entry in zip(line[1:-1], entries, strict=True):
            row = row_of(entry, name)
            # Without a pose as it came, in the small coordinates that both clouds are drawn in.
            T = np.eye(4) if row is None or row.T is None else lower_pose(np.array(row.T), labelled.pair)
            draw_clouds(axes, se3.apply(T, source), target, frame)
            _judge(axes, row, protocol)
        for axes in line:
            axes.set(xticks=[], yticks=[])
    for axes, title in zip(grid[0], titles, strict=True):
        axes.set_title(title, fontsize=9)
    handles, labels = grid[0][0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower left", ncols=2, markerscale=8, fontsize=9)
    return save_both(figure, folder, "registrations")


def _judge(axes: Any, row: Row | None, protocol: Protocol) -> None:
    if row is None or row.T is None:
        told, good = "no row" if row is None else "no pose", False
    else:
        measured = errors.of([row])
        told = f"{measured.rre_deg[0]:.2f}°, {measured.rte_m[0]:.2f} m"
        good = bool(measured.success(protocol)[0])
    colour = _RIGHT if good else _WRONG
    axes.set_xlabel(told, color=colour, fontsize=9)
    for edge in axes.spines.values():
        edge.set(color=colour, linewidth=2.0)
