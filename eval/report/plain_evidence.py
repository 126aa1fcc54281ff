# SPDX-License-Identifier: MIT
"""Evidence in plain words, each number with a bar that shows what is usual for right poses."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from html import escape
from typing import NamedTuple

import numpy as np

from hybridreg.verdict.usual import FACTS, LEVELS, facts, usual


class Words(NamedTuple):
    """How a fact is told: a title, a sentence, and its number in a unit."""

    title: str
    means: str
    number: Callable[[float], str]


def _share(value: float) -> str:
    return f"{100.0 * value:.1f} %"


WORDS = {
    "agreement_rare": Words(
        "Walls, poles and what else is not ground",
        "of these points, where both sensors looked, so many lie on a surface of the other cloud",
        _share,
    ),
    "agreement_least": Words(
        "The direction that agrees least",
        "of the surfaces that face it, so many agree; few are enough to let the clouds slide",
        _share,
    ),
    "looked_through": Words(
        "Free-space violations",
        "of the points that a sensor should have hit, it saw through so many",
        _share,
    ),
    "neighbours": Words(
        "Points with a neighbour",
        "of the points that the other sensor could see, so many have a point of the other cloud near by",
        _share,
    ),
    "overlap": Words("Overlap", "so much of a cloud was visible to the other sensor", _share),
    "inlier_rmse": Words(
        "Distance to the surfaces",
        "of the points that agree, root mean square, at the coarse resolution of the evidence",
        lambda value: f"{100.0 * value:.1f} cm",
    ),
    "weakest": Words(
        "Hold in the loosest direction",
        "share of the surfaces' information that constrains it; a corridor has next to none along itself",
        _share,
    ),
    "relief_correlation": Words(
        "Ground relief",
        "correlation of the ground's bumps and hollows, centimetres deep",
        lambda value: f"{value:.2f}",
    ),
    "matched": Words("Matches", "so many of the matcher's correspondences agree with the pose", _share),
    "lead": Words(
        "Lead over the best other pose",
        "log-odds; 0 means that another pose explains the clouds equally well",
        lambda value: f"{value:.1f}",
    ),
}


def html(evidence: Mapping[str, float]) -> str:
    """A list of the facts, most telling first; empty where another judge's evidence has other names."""
    told = facts(evidence)
    return "\n".join(_line(name, value) for name, value in told.items())


def standing(name: str, value: float) -> str:
    """Where a value lies among those of right poses: "usual", "better than usual" or "worse than usual"."""
    quantiles = usual().quantiles[name]
    low, high = quantiles[LEVELS.index(0.05)], quantiles[LEVELS.index(0.95)]
    if low <= value <= high:
        return "usual"
    return "better than usual" if (value > high) == (FACTS[name] > 0) else "worse than usual"


def _line(name: str, value: float) -> str:
    words, quantiles = WORDS[name], usual().quantiles[name]
    stands = standing(name, value)
    low, high = quantiles[LEVELS.index(0.05)], quantiles[LEVELS.index(0.95)]
    return (
        f'<div class="fact {stands.partition(" ")[0]}"><div class="said"><b>{escape(words.title)}</b> '
        f"<span>{escape(words.means)}</span></div>"
        f'<div class="measured"><b>{escape(words.number(value))}</b> {_bar(name, value)}'
        f"<small>{stands}; 9 in 10 right poses: {escape(words.number(low))} to {escape(words.number(high))}</small>"
        "</div></div>"
    )


def _bar(name: str, value: float) -> str:
    quantiles = usual().quantiles[name]
    ends = (min(quantiles[0], value), max(quantiles[-1], value))
    span = (ends[1] - ends[0]) or 1.0

    def place(x: float) -> float:
        return float(np.round(100.0 * (x - ends[0]) / span, 1))

    at = dict(zip(LEVELS, map(place, quantiles), strict=True))
    # Nine in ten right poses, the middle half of them, their median, and this one.
    return (
        '<svg class="bar" viewBox="-2 0 104 12" preserveAspectRatio="none" role="img" '
        f'aria-label="{escape(standing(name, value))}">'
        '<rect class="all" x="0" y="5" width="100" height="2"/>'
        f'<rect class="most" x="{at[0.05]}" y="3" width="{at[0.95] - at[0.05]:.1f}" height="6"/>'
        f'<rect class="half" x="{at[0.25]}" y="3" width="{at[0.75] - at[0.25]:.1f}" height="6"/>'
        f'<rect class="this" x="{place(value) - 0.6:.1f}" y="0" width="1.2" height="12"/></svg>'
    )


def source() -> str:
    """What the bars are taken from."""
    return f"the number among {usual().n} right poses on simulated training pairs"
