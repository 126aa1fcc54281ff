# SPDX-License-Identifier: MIT
"""Figure: recall against the thresholds, a panel for each estimator."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Literal

from hybridreg.eval.report.cloud_pictures import new_figure, save_both
from hybridreg.eval.report.line_styles import Style, styles
from hybridreg.eval.score import curves, errors
from hybridreg.eval.score.protocols import Protocol
from hybridreg.eval.scored_table import Entry
from hybridreg.io import write_text
from hybridreg.io.csv_cells import csv_text

# As the paper calls them; other estimators go by their own names.
_TITLES = {"lgr": "LGR", "ransac-50k": "RANSAC-50K", "svd": "weighted SVD", "ransac": "our RANSAC"}
_SWEEPS: tuple[Literal["rre", "rte"], ...] = ("rre", "rte")
# Width of a panel, and of a letter and a line's sample in the legend, inches.
_PANEL, _LETTER, _SAMPLE = 4.2, 0.075, 0.6


def write(folder: str | os.PathLike[str], entries: Sequence[Entry], protocol: Protocol) -> list[Path]:
    """Write `curves.png`, `curves.pdf` and `curves.csv`.

    Above, the rotation's threshold moves, below, the translation's; the other stays at the protocol's. One panel an
    estimator; one legend for all of them, below the panels.

    Raises
    ------
    OSError
        A file cannot be written.
    """
    panels = by_estimator(entries)
    looks = styles([entry.name for entry in entries])
    width = max(_PANEL * len(panels), 5.0)
    columns = max(1, int(width / (_SAMPLE + _LETTER * max(len(name) for name in looks))))
    figure = new_figure((width, 7.0 + 0.17 * -(-len(looks) // columns)))
    grid = figure.subplots(2, len(panels), squeeze=False, sharey=True)
    lines = [["estimator", "method", "moves", "threshold", "recall"]]
    for column, (estimator, members) in enumerate(panels.items()):
        for axes, which in zip(grid[:, column], _SWEEPS, strict=True):
            lines += _panel(axes, estimator, members, looks, protocol, which)
        grid[0][column].set_title(estimator)
    drawn = {line.get_label(): line for axes in grid[0] for line in axes.get_lines()}
    figure.legend(
        [drawn[name] for name in looks], looks, loc="outside lower center", ncols=columns, fontsize=8
    )
    for row in grid:
        row[0].set_ylabel("recall, %")
    table = Path(folder) / "curves.csv"
    files = [*save_both(figure, folder, "curves"), table]
    write_text(table, csv_text(lines))
    return files


def by_estimator(entries: Sequence[Entry]) -> dict[str, list[Entry]]:
    """The entries of each estimator, in the table's order."""
    panels: dict[str, list[Entry]] = {}
    for entry in entries:
        panels.setdefault(estimator_of(entry.config), []).append(entry)
    return panels


def estimator_of(config: Mapping[str, Any]) -> str:
    """Name of the estimator that a line's configuration tells; "other" for a plain function."""
    method = config.get("method")
    stage = method.get("estimate") if isinstance(method, Mapping) else None
    name = stage.get("stage") if isinstance(stage, Mapping) else None
    return _TITLES.get(str(name), str(name)) if name else "other"


def _panel(
    axes: Any,
    estimator: str,
    members: Sequence[Entry],
    looks: Mapping[str, Style],
    protocol: Protocol,
    which: Literal["rre", "rte"],
) -> list[list[Any]]:
    lines: list[list[Any]] = []
    for entry in members:
        curve = curves.sweep(errors.of(entry.rows), protocol, which)
        look = looks[entry.name]
        axes.plot(
            curve.threshold,
            100.0 * curve.recall,
            label=entry.name,
            color=look.colour,
            linestyle=look.matplotlib,
        )
        moved = f"{which} {'deg' if which == 'rre' else 'm'}"
        lines += [
            [estimator, entry.name, moved, f"{t:.6g}", f"{r:.6g}"]
            for t, r in zip(curve.threshold, curve.recall, strict=True)
        ]
    at, moves, other = (
        (protocol.rre_deg, "RRE threshold, °", f"RTE < {protocol.rte_m:g} m")
        if which == "rre"
        else (protocol.rte_m, "RTE threshold, m", f"RRE < {protocol.rre_deg:g}°")
    )
    axes.axvline(at, color="0.7", linewidth=0.8, linestyle=":", label="_threshold")
    axes.set(xlabel=f"{moves} ({other})", ylim=(-2, 102), xlim=(0, 5 * at))
    return lines
