# SPDX-License-Identifier: MIT
"""Errors and warnings as a user of the command line wants them: one sentence on stderr, no traceback."""

from __future__ import annotations

import sys
import warnings
from collections.abc import Callable
from functools import wraps
from typing import ParamSpec

import typer

from hybridreg.cli.spoken import spoken

BAD_INPUT, VERDICT_FAILED = 2, 3

P = ParamSpec("P")


def plainly(command: Callable[P, None]) -> Callable[P, None]:
    """Make a command end with one sentence and exit code 2 where the input is at fault."""

    @wraps(command)
    def wrapped(*args: P.args, **kwargs: P.kwargs) -> None:
        with warnings.catch_warnings():
            warnings.simplefilter("default", UserWarning)
            warnings.showwarning = _show_warning
            try:
                command(*args, **kwargs)
            except (ValueError, KeyError, OSError, ImportError) as error:
                print(f"hybridreg: {spoken(sentence(error))}", file=sys.stderr)
                raise typer.Exit(BAD_INPUT) from None

    return wrapped


def sentence(error: Exception) -> str:
    """An exception's text on one line."""
    if isinstance(error, OSError) and error.strerror:
        text = f"{error.filename}: {error.strerror}" if error.filename else error.strerror
    else:
        # str(KeyError) puts quotes around the sentence.
        text = str(error.args[0]) if error.args else type(error).__name__
    return " ".join(text.split())


def _show_warning(message: Warning | str, *_: object, **__: object) -> None:
    print(f"hybridreg: warning: {spoken(str(message))}", file=sys.stderr)
