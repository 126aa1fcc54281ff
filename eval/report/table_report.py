# SPDX-License-Identifier: MIT
"""Reports of a table: Markdown, LaTeX, CSV, and one HTML page."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from hybridreg.data.dataset import ids_of
from hybridreg.eval.report import formats, line_styles, orbit_view, page, plotly_figures
from hybridreg.eval.report.curve_panels import by_estimator
from hybridreg.eval.report.line_styles import styles
from hybridreg.eval.report.table_columns import Cells, number
from hybridreg.eval.run.attempt import one_line
from hybridreg.eval.run.row import Row
from hybridreg.eval.score import errors
from hybridreg.eval.score.protocols import Protocol
from hybridreg.eval.score.scoring import identity
from hybridreg.eval.scored_table import IDENTITY, Entry, Table
from hybridreg.frames import lower_pose
from hybridreg.geometry import se3
from hybridreg.geometry.extent import sample
from hybridreg.io import write_text
from hybridreg.pair import LabelledPair, Pair
from hybridreg.runtime import optional_packages

_MOST_VIEWS = 8
# Points of a cloud in a view: eight of them take a megabyte.
_DRAWN = 6000


def write(
    table: Table,
    protocols: Sequence[Protocol],
    out: str | os.PathLike[str],
    pairs: Sequence[LabelledPair] | None = None,
) -> list[Path]:
    """Write `table.md`, `table.tex`, `table.csv` and `report.html`, each whole or not at all, always as UTF-8.

    Parameters
    ----------
    pairs : the data that the rows are of, for the 3D views; None leaves the views out

    Returns
    -------
    The files written.

    Raises
    ------
    OSError
        Files that could not be written: the first is named with its reason, and those that were written are there.

    Warns
    -----
    UserWarning
        The page is left out for want of plotly.
    """
    folder = Path(out)
    folder.mkdir(parents=True, exist_ok=True)
    # The page is the largest, and the one that reads the data again.
    contents: dict[str, Callable[[], str]] = {
        "table.md": lambda: formats.markdown(table, protocols),
        "table.tex": lambda: formats.latex(table, protocols),
        "table.csv": lambda: formats.table_csv(table, protocols),
        "report.html": lambda: html(table, protocols, pairs),
    }
    failed: list[OSError] = []
    written = []
    for name, make in contents.items():
        with optional_packages.left_out_unless_installed(name):
            text = make()
            try:
                write_text(folder / name, text)
                written.append(folder / name)
            except OSError as error:
                failed.append(error)
    if failed:
        raise failed[0]
    return written


def html(table: Table, protocols: Sequence[Protocol], pairs: Sequence[LabelledPair] | None = None) -> str:
    """The page: tables and curves of every protocol; pairs and views by the first of them."""
    body = [page.heading(table.title, 1), page.paragraph(formats.fine_print(table))]
    for protocol in protocols:
        body += _protocol_part(table, protocol)
    if table.paper is not None:
        body += [page.heading(table.paper.heading()), page.html_table(table.paper.cells())]
    body += [page.heading("Every pair"), page.paragraph(f"By protocol {protocols[0].name}.")]
    lines = [line for entry in table.methods for line in _pair_lines(entry, protocols[0])]
    if lines:
        body.append(page.filterable(lines, success="success", text_from="why"))
    body += [page.heading("The worst pairs"), *_views(table, protocols[0], pairs)]
    body.append(page.heading("Settings"))
    for entry in table.methods:
        body.append(page.folded(entry.name, page.code(entry.config)))
    body += [page.paragraph(remark) for remark in table.remarks()]
    body.append(orbit_view.script())
    return page.page(table.title, body, f"<script>{plotly_figures.script()}</script>")


def _protocol_part(table: Table, protocol: Protocol) -> Iterator[str]:
    yield page.heading(f"Protocol {protocol.name}")
    yield page.paragraph(f"{table.caption(protocol)} ({protocol.source}).")
    for title, lines in formats.tables(table, protocol).items():
        if lines:
            yield page.heading(title, 3)
            yield page.html_table(lines)
    yield page.heading("As papers print it", 3)
    yield page.html_table(formats.printed(table, protocol))
    yield page.folded("The same in LaTeX", page.verbatim(formats.latex(table, [protocol])))
    yield from _curves(table, protocol)


def _curves(table: Table, protocol: Protocol) -> Iterator[str]:
    entries = [entry for entry in table.entries if entry.rows]
    looks = styles([entry.name for entry in entries])
    yield page.heading("Recall as a threshold moves, and the confidence", 3)
    yield line_styles.legend(looks)
    base = [entry for entry in entries if entry.name == IDENTITY]
    panels = by_estimator([entry for entry in entries if entry.name != IDENTITY]) or {"no method": []}
    for estimator, members in panels.items():
        rows = {entry.name: entry.rows for entry in [*base, *members]}
        yield page.heading(f"Estimator: {estimator}", 4)
        yield _side_by_side(plotly_figures.recall_curves(rows, looks, protocol))
    judged = {
        entry.name: entry.rows for entry in entries if any(row.confidence is not None for row in entry.rows)
    }
    if judged:
        yield page.heading("Confidence of all methods", 4)
        plots = [plotly_figures.reliability(judged, looks, protocol)]
        yield _side_by_side([*plots, plotly_figures.confidence(judged, looks, protocol)])


def _side_by_side(plots: Sequence[Any]) -> str:
    return (
        f'<div class="curves">{"".join(f"<div>{plotly_figures.to_html(plot)}</div>" for plot in plots)}</div>'
    )


def _pair_lines(entry: Entry, protocol: Protocol) -> Iterator[Cells]:
    measured = errors.of(entry.rows)
    for i, (row, success) in enumerate(zip(entry.rows, measured.success(protocol), strict=True)):
        yield {
            "method": entry.name,
            "pair": row.id,
            "success": "yes" if success else "no",
            "RRE°": number(float(measured.rre_deg[i]), 3),
            "RTE m": number(float(measured.rte_m[i]), 3),
            "overlap": number(np.nan if row.overlap is None else row.overlap, 2),
            "confidence": number(np.nan if row.confidence is None else row.confidence, 3),
            "seconds": number(row.seconds.get("total", np.nan), 2),
            "verdict": row.verdict or ("no pose" if row.T is None else "–"),
            "why": row.error or "; ".join(row.reasons),
        }


def _views(table: Table, protocol: Protocol, pairs: Sequence[LabelledPair] | None) -> Iterator[str]:
    if pairs is None:
        yield page.paragraph("The data was not at hand when this page was written, so there are no views.")
        return
    ids = ids_of(pairs)
    for number_of, (name, row) in enumerate(worst(table, protocol)):
        if row.id not in ids or row.T_true is None:
            continue
        yield page.heading(f"{row.id}, {name}", 3)
        yield page.paragraph(_told(row))
        try:
            pair = pairs[ids.index(row.id)].pair
        except (OSError, ValueError) as error:  # data that was damaged since must not prevent the report
            yield page.paragraph(f"There is no view: {one_line(error)}")
            continue
        yield orbit_view.html(_layers(pair, row), f"view-{number_of}")


def _layers(pair: Pair, row: Row) -> list[orbit_view.Layer]:
    # Without a pose as it came, in the small coordinates that both clouds are drawn in.
    found = np.eye(4) if row.T is None else lower_pose(np.array(row.T), pair)
    truth = lower_pose(np.array(row.T_true), pair)
    source, target = (sample(cloud.points, _DRAWN) for cloud in (pair.source, pair.target))
    layer = orbit_view.Layer
    return [
        layer("target", target, "#8f99a8"),
        layer("source, aligned", se3.apply(found, source), "#d95f02"),
        layer("source, true pose", se3.apply(truth, source), "#1b9e77"),
        layer("source, before", source, "#a6761d", shown=False),
    ]


def worst(table: Table, protocol: Protocol) -> list[tuple[str, Row]]:
    """Each method's pairs with the largest errors, the methods taking turns."""
    ranked = []
    for entry in table.methods:
        measured = [row for row in entry.rows if row.T_true is not None]
        # Where there is no pose the error of the identity decides which is worse.
        posed = [row if row.T is not None else identity([row])[0] for row in measured]
        order = np.argsort(-plotly_figures.badness(posed, protocol), kind="stable")
        ranked.append([(entry.name, measured[i]) for i in order])
    turns = [each[k] for k in range(_MOST_VIEWS) for each in ranked if k < len(each)]
    return turns[:_MOST_VIEWS]


def _told(row: Row) -> str:
    measured = errors.of([row])
    verdict = f'verdict "{row.verdict}"' if row.verdict else "no verdict"
    found = "no pose, shown as it came" if row.T is None else verdict
    return (
        f"RRE {measured.rre_deg[0]:.2f}°, RTE {measured.rte_m[0]:.2f} m, {found}. {row.error or ''}".strip()
    )
