# SPDX-License-Identifier: MIT
"""One hostile input, and what the library may do with it."""

from __future__ import annotations

import warnings
from pathlib import Path
from traceback import extract_tb
from typing import ClassVar, Protocol

import hybridreg
import hybridreg.classical
import hybridreg.eval
import hybridreg.learned

_PACKAGES = (hybridreg, hybridreg.classical, hybridreg.eval, hybridreg.learned)
ROOTS = tuple(str(Path(str(package.__file__)).resolve().parent) for package in _PACKAGES)


class Case(Protocol):
    """An input that can be pickled, small enough to be printed.

    `run` gives it to the library and returns a short word on the outcome; it raises `AssertionError` where the result
    breaks a promise. `allowed` are the exceptions that the docstrings name for it.
    """

    kind: ClassVar[str]
    allowed: ClassVar[tuple[type[BaseException], ...]]

    def run(self) -> str: ...


def verdict_on(case: Case) -> tuple[str, str]:
    """Run a case: ("fine", what came out), ("refused", the message) or ("finding", what is wrong)."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", RuntimeWarning)  # an unintended NaN
            warnings.simplefilter("ignore", UserWarning)  # the library's own advice on units and voxels
            return "fine", case.run()
    except BaseException as error:
        text = f"{type(error).__name__}: {error}"[:2000]
        if not isinstance(error, case.allowed):
            return "finding", f"{text}\n    {_where(error)}"
        if not _deliberate(error):
            return "finding", f"not the library's own words: {text}\n    {_where(error)}"
        return "refused", text


def _deliberate(error: BaseException) -> bool:
    # An error raised by a dependency is about its internals, not about the user's cloud.
    frames = extract_tb(error.__traceback__)
    return bool(frames) and str(Path(frames[-1].filename).resolve()).startswith(ROOTS)


def _where(error: BaseException) -> str:
    frames = extract_tb(error.__traceback__)[-4:]
    return " < ".join(f"{Path(f.filename).name}:{f.lineno} {f.name}" for f in reversed(frames))
