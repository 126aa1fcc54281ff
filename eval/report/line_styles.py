# SPDX-License-Identifier: MIT
"""One look for each method wherever its curve is drawn, and one legend for all panels of a page."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from typing import NamedTuple

# Ten colours that are told apart on light and on dark paper, by people who do not see red and green too in most cases.
_COLOURS = (
    "#1f77b4", "#ff7f0e", "#2ca02c", "#d62728", "#9467bd", "#8c564b", "#e377c2", "#1b9e77", "#bcbd22", "#17becf",
)  # fmt: skip
# As matplotlib, plotly and SVG call them. Ten colours and four dashes turn in step: twenty looks, and neighbours differ
# in both, so that curves that coincide are both seen.
_DASHES = (("-", "solid", "none"), ("--", "dash", "7 4"), ("-.", "dashdot", "7 3 2 3"), (":", "dot", "2 3"))


class Style(NamedTuple):
    """A curve's colour, and its dash by the name that each kind of picture gives it."""

    colour: str
    matplotlib: str
    plotly: str
    svg: str


def styles(names: Sequence[str]) -> dict[str, Style]:
    """A style for each method, in the order of the table."""
    return {
        name: Style(_COLOURS[k % len(_COLOURS)], *_DASHES[k % len(_DASHES)]) for k, name in enumerate(names)
    }


def legend(looks: dict[str, Style]) -> str:
    """The legend as HTML, beside the panels and never over them; a tick hides a method in all of them."""
    items = (
        f'<label><input type="checkbox" checked data-trace="{escape(name)}">'
        f'<svg viewBox="0 0 30 8" aria-hidden="true"><line x1="0" y1="4" x2="30" y2="4" stroke="{look.colour}" '
        f'stroke-width="3" stroke-dasharray="{look.svg}"/></svg>{escape(name)}</label>'
        for name, look in looks.items()
    )
    return f'<div class="legend">{"".join(items)}</div>'
