# SPDX-License-Identifier: MIT
"""A scale or an offset in the comments of a file, which may be that of its coordinates: told, not applied."""

from __future__ import annotations

import re
import warnings
from collections.abc import Iterable, Sequence

from hybridreg.io.faults import shorten

_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:e[+-]?\d+)?"
_NUMBERS = rf"[\[(]?\s*({_NUMBER}(?:\s*[,; ]\s*{_NUMBER}){{0,2}})"
_IS = r"\s*(?:[:=]|\b(?:is|of|by)\b)?\s*"
_FLAGS = re.IGNORECASE
_SCALE = re.compile(
    rf"(?:([a-z]+)[ _-]+)?(?<![a-z])(?:scal(?:e|es|ing)(?:[ _-]?factors?)?|quantization)(?:[ _-]?xyz|[ _-][xyz])?"
    rf"{_IS}{_NUMBERS}(?![\w%]|\s*[:/]\s*\d)",
    _FLAGS,
)
_TIMES = re.compile(
    rf"()\b(?:multipl(?:y|ied)|divided?|scaled?)\b[\w ,]{{0,25}}?\bby\s+{_NUMBERS}(?![\w%])", _FLAGS
)
_OFFSET = re.compile(
    rf"(?:([a-z]+)[ _-]+)?(?:(?:(?<![a-z])|(?<=global))(?:offsets?|shift)(?:[ _-]?xyz)?|"
    rf"(?<![a-z])(?:local|map|world|project|utm)[ _-]?origin){_IS}{_NUMBERS}(?![\w%])",
    _FLAGS,
)
_MAYBE = re.compile(
    r"scal|quantiz|multipl|divide|offset|shift|origin", _FLAGS
)  # a quick look at what is mostly prose
# What else has a scale or an offset.
_OF_OTHERS = (
    "time", "clock", "timestamp", "intensity", "color", "colour", "gray", "grey", "display", "full", "view", "font",
    "point", "line", "gaussian", "noise", "temperature", "range", "depth", "map", "phase", "frequency", "normal",
    "byte", "header", "data", "angle", "azimuth", "encoder", "horizontal", "rotational", "pixel", "image", "octree",
    "max", "min",
)  # fmt: skip


def tell_scale(lines: Iterable[str], name: str) -> None:
    """Warn of each comment that gives a scale other than one, or an offset of three numbers other than zero."""
    for line in filter(_MAYBE.search, lines):
        for says in (_SCALE, _TIMES, _OFFSET):
            found = says.search(line)
            if (
                found is None
                or (found.group(1) or "").lower() in _OF_OTHERS
                or not _changes(found, says is _OFFSET)
            ):
                continue
            done = "shifted" if says is _OFFSET else "multiplied or divided"
            warnings.warn(
                f"{name}: its header says {shorten(found.group(0).strip())}, which was not applied; if its "
                f"coordinates are to be {done} by that, do so and give the result",
                UserWarning,
                stacklevel=4,
            )
            break


def _changes(found: re.Match[str], offset: bool) -> bool:
    numbers: Sequence[float] = [float(each) for each in re.split(r"[,;\s]+", found.group(2))]
    if offset:  # one number may be of anything
        return len(numbers) == 3 and any(numbers)
    return any(each not in (0.0, 1.0) for each in numbers)
