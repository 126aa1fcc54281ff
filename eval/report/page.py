# SPDX-License-Identifier: MIT
"""Pieces of a self-contained HTML page: no network, no other file."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from html import escape
from importlib.resources import files
from string import Template
from typing import Any

from hybridreg.eval.report.table_columns import Cells


def page(title: str, body: Sequence[str], script: str = "") -> str:
    """A whole page from pieces of HTML; `script` is an element of the head that they need."""
    template = Template(files("hybridreg.eval.report").joinpath("page.html").read_text(encoding="utf-8"))
    # safe_substitute, because the page's own script holds template literals.
    return template.safe_substitute(title=escape(title), script=script, body="\n".join(body))


def heading(text: str, level: int = 2) -> str:
    """A heading."""
    return f"<h{level}>{escape(text)}</h{level}>"


def paragraph(text: str) -> str:
    """A paragraph of plain text."""
    return f'<p class="caption">{escape(text)}</p>'


def html_table(lines: Sequence[Cells]) -> str:
    """Lines of the same columns as a table, which a click on a column's head sorts where there are several."""
    sorts = ' class="sorts"' if len(lines) > 1 else ""
    head = "".join(f"<th{sorts}>{escape(key)}</th>" for key in lines[0])
    rows = ("".join(f"<td>{escape(line[key])}</td>" for key in lines[0]) for line in lines)
    body = "\n".join(f"<tr>{row}</tr>" for row in rows)
    kind = ' class="sortable"' if sorts else ""
    return f'<div class="scroll"><table{kind}><thead><tr>{head}</tr></thead><tbody>\n{body}\n</tbody></table></div>'


def listed(items: Mapping[str, str]) -> str:
    """Names and what belongs to them, plain text, one below the other."""
    lines = "".join(f"<dt>{escape(name)}</dt><dd>{escape(text)}</dd>" for name, text in items.items())
    return f"<dl>{lines}</dl>"


def panels(pictures: Iterable[str]) -> str:
    """Figures side by side, where there is room for that."""
    return f'<div class="panels">{"".join(pictures)}</div>'


def code(value: Any) -> str:
    """Settings as indented JSON."""
    return f"<pre>{escape(json.dumps(value, indent=1))}</pre>"


def verbatim(text: str) -> str:
    """Text as it stands, to be copied."""
    return f'<pre class="wrapped">{escape(text)}</pre>'


def folded(title: str, piece: str) -> str:
    """A piece of a page that is shown when its title is clicked."""
    return f"<details><summary>{escape(title)}</summary>{piece}</details>"


def filterable(lines: Sequence[Cells], *, success: str, text_from: str) -> str:
    """A long table with a search box; `success` is the column that "missed only" looks at."""
    head = list(lines[0])
    data = {
        "rows": [[line[key] for key in head] for line in lines],
        "success": head.index(success),
        "text": head.index(text_from),
    }
    # "</" would end the script element, "<!--<script" would keep it open, whatever the JSON contains.
    stored = json.dumps(data).replace("<", "\\u003c")
    cells = "".join(f'<th data-key="{escape(key)}">{escape(key)}</th>' for key in head)
    return (
        '<p><input type="search" id="pairs-filter" placeholder="words to look for"> '
        '<label><input type="checkbox" id="pairs-missed"> missed only</label> '
        '<span id="pairs-count"></span></p>\n'
        f'<div class="scroll tall"><table id="pairs"><thead><tr>{cells}</tr></thead>'
        "<tbody></tbody></table></div>\n"
        f'<script type="application/json" id="pairs-data">{stored}</script>'
    )
