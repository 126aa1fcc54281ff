# SPDX-License-Identifier: MIT
"""How a bad file is reported: its name, what is wrong with it, and what to do."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager

FETCH_AGAIN = "copy, download or export it again"


def fault(name: str, problem: str, cure: str = FETCH_AGAIN) -> ValueError:
    """The error to raise for the file called `name`."""
    return ValueError(f"{name}: {problem}; {cure}")


def shorten(text: object, length: int = 60) -> str:
    """`text` quoted for a message, cut short so that a damaged file does not flood the screen."""
    shown = str(text)
    return repr(shown if len(shown) <= length else shown[:length] + "...")


@contextmanager
def foreign_parser(name: str, kind: str, cure: str = FETCH_AGAIN) -> Iterator[None]:
    """Turn whatever a third-party parser raises for a damaged file into one `ValueError`, which tells the cure.

    zipfile, numpy's header reader, laspy and lazrs raise a dozen kinds of exceptions on damaged bytes, and
    lazrs' Rust panics do not even derive from `Exception`. Our own parsers do not hide behind this.
    """
    try:
        yield
    except (KeyboardInterrupt, SystemExit, GeneratorExit, ImportError):
        raise
    except BaseException as error:
        reason = shorten(str(error) or type(error).__name__, 200)
        raise fault(name, f"cannot be read as {kind} ({reason})", cure) from error


@contextmanager
def naming(path: str | os.PathLike[str], instead_of: str | os.PathLike[str] | None = None) -> Iterator[None]:
    """Have an `OSError` of the block name `path` where it names nothing (a full disk), or a file of our own making."""
    try:
        yield
    except OSError as error:
        ours = instead_of is not None and str(error.filename) == os.fspath(instead_of)
        if ours or (error.filename is None and error.errno is not None):
            error.filename = os.fspath(path)
        raise
