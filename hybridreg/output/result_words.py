# SPDX-License-Identifier: MIT
"""A result in a few lines, as text and as a notebook's cell."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING

import numpy as np

from hybridreg.config.number_of import number_of
from hybridreg.geometry import se3

if TYPE_CHECKING:
    from hybridreg.result import RegistrationResult

_COLOURS = {"ok": "#2a7d46", "doubtful": "#b36b00", "failed": "#b3261e"}


def summary(result: RegistrationResult) -> str:
    """Verdict, pose in words, how far off it may be, reasons, notes and seconds."""
    T = result.transformation
    lines = [f"{result.verdict} (confidence {result.confidence:.2f}, to {_tolerance(result)})"]
    lines.append(
        f"source -> target: {se3.angle_deg(T[:3, :3]):.3f} deg, "
        f"({', '.join(f'{x:.3f}' for x in T[:3, 3])}) m{_scale(result)}"
    )
    if result.verdict == "ok":
        lines.append(f"one standard deviation: {_spread(result)}")
    if len(result.rivals):
        others = number_of(len(result.rivals), "other pose")
        lines.append(f"rivals, which explain the clouds nearly as well or better: {others}")
    lines += [f"- {each}" for each in result.reasons]
    lines += [f"note: {each}" for each in result.notes]
    lines += [f"found by {found_by(result)}"] if result.entries else []
    return "\n".join([*lines, f"{sum(result.seconds.values()):.2f} s, seed {result.seed}"])


def found_by(result: RegistrationResult) -> str:
    """The entry that the pose came from, and how many ran: `relief, entry 2 of 6 tried (0.4 of 5.3 s)`."""
    won = next((each for each in result.entries if each.won), None)
    total = sum(each.seconds for each in result.entries)
    if won is None:
        return f"none of {number_of(len(result.entries), 'entry', 'entries')} ({total:.1f} s)"
    place = 1 + result.entries.index(won)
    return f"{won.entry}, entry {place} of {len(result.entries)} tried ({won.seconds:.1f} of {total:.1f} s)"


def html(result: RegistrationResult) -> str:
    """The same for a notebook: a table of the pose under the verdict in its colour."""
    colour = _COLOURS[result.verdict]
    rows = "".join(
        "<tr>" + "".join(f"<td style='text-align:right'>{x:.6f}</td>" for x in row) + "</tr>"
        for row in result.transformation
    )
    reasons = "".join(f"<li>{escape(each)}</li>" for each in result.reasons)
    return (
        f"<div><b style='color:{colour}'>{result.verdict}</b> (confidence {result.confidence:.2f}, "
        f"to {escape(_tolerance(result))}){escape(_scale(result))}<table>{rows}</table><ul>{reasons}</ul></div>"
    )


def _tolerance(result: RegistrationResult) -> str:
    return f"{result.tolerance.degrees:g} deg and {result.tolerance.metres:g} m"


def _scale(result: RegistrationResult) -> str:
    return "" if result.scale_verdict is None else f", scale {result.scale:.5g} ({result.scale_verdict})"


def _spread(result: RegistrationResult) -> str:
    deviations = np.sqrt(np.diag(result.covariance))
    turns, moves = np.degrees(deviations[:3]), deviations[3:]
    return (
        f"({', '.join(f'{x:.3f}' for x in turns)}) deg, ({', '.join(f'{x:.3f}' for x in moves)}) m "
        "about and along the target's axes"
    )
