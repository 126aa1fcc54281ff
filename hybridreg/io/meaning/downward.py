# SPDX-License-Identifier: MIT
"""Depths and other coordinates that count downwards, as sonars and autopilots have them: as z they mirror the cloud."""

from __future__ import annotations

import re
import warnings
from collections.abc import Iterable, Sequence

from hybridreg.io.faults import fault, shorten

_UNIT = r"(?:[ _](?:m|mm|cm|ft|feet|metres?|meters?))?"
_DEPTH = re.compile(
    rf"(?:water[ _])?depths?{_UNIT}|(?:[zp]?[ _]?|pos[ _])down(?:wards?)?{_UNIT}|soundings?{_UNIT}"
)
# D alone is a depth beside north and east only.
_LETTERS = {"n", "e", "d"}
_DOWN = re.compile(
    r"\W*(?:\+|z|positive|is|in|m|metres|meters|[ ,._-])*(?:depths?|down(?:wards?)?)\W*", re.IGNORECASE
)
_SAYS = re.compile(
    r"(?<!y )(?:\bz\b(?:[ _-]?axis)?|positive|(?<![a-z])depths?)"
    r"(?:\W+(?:is|are|being|points?|counts?|increases?|positive)){0,3}\W+down(?:wards?)?\b",
    re.IGNORECASE,
)
# Names of columns in a comment, which leave the third one z.
_COLUMNS = re.compile(
    r"\b(?:x\W+y|east(?:ing)?s?\W+north(?:ing)?s?)\W+(?:\(?m\)?\W+)?(?:depths?|soundings?|down)\b",
    re.IGNORECASE,
)
_CURE = "change its sign and call it z, with x to the east and y to the north; of a depth camera call it z as it is"


def refuse_downward(names: Iterable[str], name: str) -> None:
    """Refuse columns, none of them z, of which one counts downwards.

    Raises
    ------
    ValueError
        One does; it says that its sign is to be changed.
    """
    held = [str(each).strip(" \"'") for each in names]
    parts = [re.split(r"[\s_]*[\[(/]", each.lower())[0] for each in held]
    letters = set(parts) >= _LETTERS
    for label, part in zip(held, parts, strict=True):
        if _DEPTH.fullmatch(part) or (letters and part == "d"):
            problem = (
                f"has no z among {shorten(', '.join(held), 200)}, but {shorten(label)} may count downwards"
            )
            raise fault(name, problem, _CURE)


def tell_downward(said: object, name: str) -> None:
    """Warn where what is said of z, beside its name or in an attribute, is that it counts downwards."""
    if isinstance(said, str) and _DOWN.fullmatch(said):
        _tell(said, name)


def tell_downward_comments(lines: Sequence[str], name: str) -> None:
    """Warn where a comment says that z counts downwards."""
    found = next(filter(None, (says.search(line) for line in lines for says in (_SAYS, _COLUMNS))), None)
    if found is not None:
        _tell(found.group(), name)


def _tell(said: str, name: str) -> None:
    warnings.warn(
        f"{name}: its z is said to count downwards ({shorten(said.strip())}), and was read as it is; where x goes to "
        "the east and y to the north, that is the mirror image: change the sign of z",
        UserWarning,
        stacklevel=4,
    )
