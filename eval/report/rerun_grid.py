# SPDX-License-Identifier: MIT
"""Figures of what stages made of some pairs: matches, and masks beside the photograph. The pipelines run again."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from pathlib import Path

from hybridreg.data.dataset import ids_of
from hybridreg.eval.report import stage_pictures
from hybridreg.eval.report.cloud_pictures import new_figure, save_both
from hybridreg.eval.report.figure_choice import wrapped
from hybridreg.eval.report.rerun_for_pictures import Rerun, control_of, keeps_all, rerun
from hybridreg.eval.score.protocols import Protocol
from hybridreg.eval.scored_table import Entry
from hybridreg.pair import LabelledPair


def write_matches(
    folder: str | os.PathLike[str],
    entries: Sequence[Entry],
    pairs: Sequence[LabelledPair],
    names: Sequence[str],
    protocol: Protocol,
    seed: int,
) -> list[Path]:
    """Write `matches.png` and `matches.pdf`: pairs in rows, methods in columns, wrong matches over right ones, counted.

    Raises
    ------
    MissingWeights, OSError, ValueError
        A pipeline cannot be built, a pair not read, a file not written; or no method makes matches.
    """
    drawn = [one for one in _rerun(entries, pairs, names, seed) if len(one.trace.matches)]
    if not drawn:
        raise ValueError(
            "none of these methods makes matches that a figure could show; name others by --method"
        )
    methods = list(dict.fromkeys(one.method for one in drawn))
    figure = new_figure((6.0 * len(methods), 3.6 * len(names)))
    grid = figure.subplots(len(names), len(methods), squeeze=False)
    for axes in grid.flat:
        axes.set_axis_off()
    for one in drawn:
        axes = grid[names.index(one.pair)][methods.index(one.method)]
        axes.set_axis_on()
        share = stage_pictures.draw_matches(axes, one.trace, one.truth, protocol.inlier_m)
        axes.set(xticks=[], yticks=[], xlabel=f"{100 * share:.1f} % right within {protocol.inlier_m:g} m")
        axes.set_title(f"{wrapped(one.method, 60)}\n{one.pair}", fontsize=9, pad=16)
    return save_both(figure, folder, "matches")


def write_masks(
    folder: str | os.PathLike[str],
    entries: Sequence[Entry],
    pairs: Sequence[LabelledPair],
    names: Sequence[str],
    seed: int,
) -> list[Path]:
    """Write `masks.png` and `masks.pdf`: a row a pair and method, source, target and photograph, at the threshold that
    the matcher applies.

    Raises
    ------
    MissingWeights, OSError, ValueError
        As `write_matches`; or no method leaves anything out.
    """
    drawn = [one for one in _rerun(entries, pairs, names, seed) if not keeps_all(one.trace)]
    if not drawn:
        raise ValueError("none of these methods has a mask that leaves anything out; name others by --method")
    figure = new_figure((15.0, 4.6 * len(drawn) + 0.4))
    grid = figure.subplots(len(drawn), 3, squeeze=False)
    for panels, one in zip(grid, drawn, strict=True):
        stage_pictures.draw_masks(panels, one.trace, one.truth, one.threshold)
        panels[0].set_ylabel(f"{wrapped(one.method, 40)}\n{one.pair}")
    handles, labels = grid[0][0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower left", ncols=4, markerscale=6)
    return save_both(figure, folder, "masks")


def _rerun(
    entries: Sequence[Entry], pairs: Sequence[LabelledPair], names: Sequence[str], seed: int
) -> Iterator[Rerun]:
    ids = ids_of(pairs)
    for entry in entries:
        control = control_of(entry)
        if control is None:
            continue
        for name in names:
            yield rerun(entry.name, control, pairs, ids.index(name), seed)._replace(pair=name)
