# SPDX-License-Identifier: MIT
"""Figure: recall against the thresholds, a panel for each estimator."""

from __future__ import annotations

import csv
import io
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Literal

from hybridreg.eval.report.cloud_pictures import new_figure, save_both
from hybridreg.eval.score import curves, errors
from hybridreg.eval.score.protocols import Protocol
from hybridreg.eval.scored_table import Entry
from hybridreg.io import write_text
from hybridreg.io.csv_cells import cell

# As the paper calls them; other estimators go by their own names.
_TITLES = {"lgr": "LGR", "ransac-50k": "RANSAC-50K", "svd": "weighted SVD", "ransac": "our RANSAC"}
_SWEEPS: tuple[Literal["rre", "rte"], ...] = ("rre", "rte")
_STYLES = ("-", "--", "-.", ":")
_COLOURS = 10


def write(folder: str | os.PathLike[str], entries: Sequence[Entry], protocol: Protocol) -> list[Path]:
    """Write `curves.png`, `curves.pdf` and `curves.csv`.

    Above, the rotation's threshold moves, below, the translation's; the other stays at the protocol's.

    Raises
    ------
    OSError
        A file cannot be written.
    """
    panels: dict[str, list[Entry]] = {}
    for entry in entries:
        panels.setdefault(estimator_of(entry.config), []).append(entry)
    figure = new_figure((max(4.2 * len(panels), 5.0), 7.4))
    grid = figure.subplots(2, len(panels), squeeze=False, sharey=True)
    lines = [["estimator", "method", "moves", "threshold", "recall"]]
    for column, (estimator, members) in enumerate(panels.items()):
        for axes, which in zip(grid[:, column], _SWEEPS, strict=True):
            lines += _panel(axes, estimator, members, protocol, which)
        grid[0][column].set_title(estimator)
        grid[1][column].legend(fontsize=7, loc="upper center", bbox_to_anchor=(0.5, -0.18))
    for row in grid:
        row[0].set_ylabel("recall, %")
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows([[cell(value) for value in line] for line in lines])
    table = Path(folder) / "curves.csv"
    files = [*save_both(figure, folder, "curves"), table]
    write_text(table, text.getvalue())
    return files


def estimator_of(config: Mapping[str, Any]) -> str:
    """Name of the estimator that a line's configuration tells; "other" for a plain function."""
    method = config.get("method")
    stage = method.get("estimate") if isinstance(method, Mapping) else None
    name = stage.get("stage") if isinstance(stage, Mapping) else None
    return _TITLES.get(str(name), str(name)) if name else "other"


def _panel(
    axes: Any, estimator: str, members: Sequence[Entry], protocol: Protocol, which: Literal["rre", "rte"]
) -> list[list[Any]]:
    lines: list[list[Any]] = []
    for number, entry in enumerate(members):
        curve = curves.sweep(errors.of(entry.rows), protocol, which)
        style = {"color": f"C{number % _COLOURS}", "linestyle": _STYLES[number % len(_STYLES)]}
        axes.plot(curve.threshold, 100.0 * curve.recall, label=entry.name, **style)
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
    axes.axvline(at, color="0.7", linewidth=0.8, linestyle=":")
    axes.set(xlabel=f"{moves} ({other})", ylim=(-2, 102), xlim=(0, 5 * at))
    return lines
