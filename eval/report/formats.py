# SPDX-License-Identifier: MIT
"""Tables as Markdown, LaTeX and CSV."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

from hybridreg.eval.report import table_columns
from hybridreg.eval.report.table_columns import Cells
from hybridreg.eval.run.controls import MARK
from hybridreg.eval.score import differences
from hybridreg.eval.score.protocols import Protocol
from hybridreg.eval.score.scoring import scene_of
from hybridreg.eval.scored_table import Table
from hybridreg.io.csv_cells import csv_text

_LATEX = {"\\": r"\textbackslash{}", "°": r"$^\circ$", "–": "--"} | {c: f"\\{c}" for c in "&%$#_{}"}
_LATEX |= {
    MARK[-1]: r"$\dagger$",
    "<": "$<$",
    ">": "$>$",
    "~": r"\textasciitilde{}",
    "^": r"\textasciicircum{}",
}

_VISITS_NOTE = " Visits are the training pairs that a method's weights have seen, repeats counted."
_CONTROL_NOTE = f" Rows with{MARK} are controls, not methods: their overlap was taken from the ground truth."


def markdown(table: Table, protocols: Sequence[Protocol]) -> str:
    """Every protocol's tables with their captions, then the conditions of the numbers."""
    parts = [f"# {table.title}"]
    for protocol in protocols:
        parts.append(f"## {protocol.name}\n\n{table.caption(protocol)} ({protocol.source}).")
        named = tables(table, protocol).items()
        parts.extend(f"### {title}\n\n{markdown_table(lines)}" for title, lines in named if lines)
    if table.paper is not None:
        parts.append(f"## {table.paper.heading()}\n\n{markdown_table(table.paper.cells())}")
    parts.extend(table.remarks())
    return "\n\n".join([*parts, fine_print(table)]) + "\n"


def fine_print(table: Table) -> str:
    """The conditions that every number of a table depends on."""
    scenes = {scene_of(row) for entry in table.entries for row in entry.rows}
    return (
        "Recall's interval is a 95 % bootstrap over scenes (a pair and its random yaw rotations are drawn as one); "
        f"one of no width says that all {len(scenes)} scenes agree, which still leaves room for "
        f"{min(100.0, 300 / max(len(scenes), 1)):.0f} percentage points (the rule of three). A pair "
        "without a pose counts as the identity and never as a success. Seconds are wall time, one thread a pair; "
        f"seed {table.seed}."
        f"{_VISITS_NOTE if table.visits else ''}"
        f"{_CONTROL_NOTE if any(MARK in entry.name for entry in table.entries) else ''}"
    )


def tables(table: Table, protocol: Protocol) -> dict[str, list[Cells]]:
    """All tables of one protocol by their headings."""
    scores = table.scores(protocol)
    with_verdict = [e for e in table.methods if any(row.verdict for row in e.rows)]
    return {
        "Results": [
            table_columns.results(name, score) | _visits(table, name) for name, score in scores.items()
        ],
        **_differences(table, protocol),
        "Recall at fixed thresholds": [
            table_columns.thresholds(name, score) for name, score in scores.items()
        ],
        "Recall by overlap": [table_columns.by_overlap(e.name, e.rows, protocol) for e in table.entries],
        "Overlap mask": [
            table_columns.masks(e.name, e.rows) for e in table.methods if any(row.mask for row in e.rows)
        ],
        "Verdict against success": [table_columns.verdicts(e.name, e.rows, protocol) for e in with_verdict],
        "Seconds of each stage": table_columns.stages(scores),
    }


def _visits(table: Table, name: str) -> Cells:
    # A column of every line or of none.
    return {"visits": f"{table.visits[name]:,}" if name in table.visits else "–"} if table.visits else {}


def _differences(table: Table, protocol: Protocol) -> dict[str, list[Cells]]:
    entries = [entry for entry in table.methods if entry.rows]
    if not entries:
        return {}
    first = entries[0]
    lines = [differences.cells(entry.name, entry.rows, first.rows, protocol) for entry in entries[1:]]
    return {f"Difference to {first.name}, pair by pair": lines}


def markdown_table(lines: Sequence[Cells]) -> str:
    """Lines of the same columns as a Markdown table."""
    head = list(lines[0])
    rows = [head, ["---"] * len(head), *([line[key] for key in head] for line in lines)]
    return "\n".join(f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in row)} |" for row in rows)


def latex(table: Table, protocols: Sequence[Protocol]) -> str:
    """The table of every protocol as papers print it, for the package booktabs."""
    parts = []
    for each in protocols:
        parts.append(
            _latex_table(f"{table.caption(each)}. Recall with its 95 % interval", printed(table, each))
        )
    if table.paper is not None:
        parts.append(_latex_table(table.paper.heading(), table.paper.cells()))
    parts.extend(f"\\noindent {_escape(remark)}\n" for remark in table.remarks())
    return "\n".join(parts)


def printed(table: Table, protocol: Protocol) -> list[Cells]:
    """A protocol's lines as papers print them."""
    scores = table.scores(protocol).items()
    return [table_columns.printed(name, score) | _visits(table, name) for name, score in scores]


def _latex_table(caption: str, lines: Sequence[Cells]) -> str:
    head = list(lines[0])
    body = "\n".join(f"{' & '.join(_escape(line[key]) for key in head)} \\\\" for line in lines)
    return (
        "\\begin{table}\n\\centering\n"
        f"\\caption{{{_escape(caption)}.}}\n"
        f"\\begin{{tabular}}{{l{'r' * (len(head) - 1)}}}\n\\toprule\n"
        f"{' & '.join(_escape(key) for key in head)} \\\\\n\\midrule\n{body}\n"
        "\\bottomrule\n\\end{tabular}\n\\end{table}\n"
    )


def _escape(text: str) -> str:
    return "".join(_LATEX.get(character, character) for character in text)


def table_csv(table: Table, protocols: Sequence[Protocol]) -> str:
    """One line a method and protocol, numbers in full."""
    lines = []
    for protocol in protocols:
        for name, score in table.scores(protocol).items():
            fields = dataclasses.asdict(score) | {"protocol": protocol.name}
            at, seconds = fields.pop("recall_at"), fields.pop("seconds")
            lines.append(
                {"method": name, "data": table.data, **fields}
                | ({"visits": table.visits[name]} if name in table.visits else {})
                | {f"recall at {key}": value for key, value in at.items()}
                | {f"seconds {stage}": value for stage, value in seconds.items()}
            )
    lines.extend({"method": name, "data": table.data, "not run": why} for name, why in table.problems.items())
    head = list(dict.fromkeys(key for line in lines for key in line))
    return csv_text([head, *([line.get(key, "") for key in head] for line in lines)])
