# SPDX-License-Identifier: MIT
"""Errors and warnings for users of the command line: one sentence on stderr, no traceback."""

from __future__ import annotations

import errno
import os
import sys
import warnings
from collections.abc import Callable
from contextlib import suppress
from functools import wraps
from typing import ParamSpec

import typer

from hybridreg.cli.terminal import command_options, stop_signals
from hybridreg.cli.terminal.command_line_cures import spoken
from hybridreg.cli.terminal.console import make_ready
from hybridreg.cli.terminal.memory_errors import lacks_memory, memory_sentence, require_addresses
from hybridreg.runtime import optional_packages

# Exit codes.
BAD_INPUT = 2
VERDICT_FAILED = 3

P = ParamSpec("P")

# What to do where a file cannot be written.
_CURES = {
    errno.ENOSPC: "make room, then run the same command again",
    errno.EDQUOT: "make room, then run the same command again",
    errno.EFBIG: "raise the limit of a file's size (ulimit -f), then run the same command again",
    errno.EROFS: "name another folder",
    errno.EEXIST: "name another folder: a file of this name is in the way",
    errno.ENOTDIR: "name another folder: a file is in the way",
    errno.EACCES: "change the permissions, or name another folder",
}


def plainly(command: Callable[P, None]) -> Callable[P, None]:
    """Have a command end with one sentence: exit code 2 where the input or the machine is at fault, 128 + n where
    signal n stopped it."""

    @wraps(command)
    def wrapped(*args: P.args, **kwargs: P.kwargs) -> None:
        make_ready()
        with (
            command_options.running(command, kwargs),
            warnings.catch_warnings(),
            stop_signals.stoppable(),
        ):
            warnings.simplefilter("default", UserWarning)
            # From workers that are stopped early on purpose.
            warnings.filterwarnings("ignore", message=".*tasks which were still being processed")
            warnings.showwarning = _show_warning
            try:
                require_addresses()
                command(*args, **kwargs)
                sys.stdout.flush()  # here, where a full disk behind it can still be reported
            except BrokenPipeError:  # the reader of our output has closed the pipe
                raise
            except KeyboardInterrupt as error:
                say(f"stopped by {stop_signals.name_of(error)}{stop_signals.how_of(error)}")
                raise typer.Exit(128 + stop_signals.number_of(error)) from None
            except Exception as error:
                _give_up_stdout()
                if lacks_memory(error):
                    say(memory_sentence(error))
                elif isinstance(error, (ValueError, KeyError, OSError, ImportError)):
                    say(spoken(sentence(error)))
                else:
                    raise
                raise typer.Exit(BAD_INPUT) from None

    return wrapped


def say(text: str) -> None:
    """Print a line on stderr, if that is possible."""
    with suppress(OSError):
        print(f"hybridreg: {text}", file=sys.stderr, flush=True)


def sentence(error: BaseException) -> str:
    """An exception's text on one line."""
    if isinstance(error, OSError) and error.strerror:
        cure = _CURES.get(error.errno or 0)
        # Our own writers name the file.
        name = error.filename or ("standard output" if cure else "")
        text = f"{name}: {error.strerror}" if name else error.strerror
        text += f"; {cure}" if cure else ""
    elif isinstance(error, UnicodeError):  # whose first argument is an encoding
        text = str(error)
    else:
        # str(KeyError) puts quotes around the sentence.
        text = str(error.args[0]) if error.args else type(error).__name__
    if isinstance(error, ModuleNotFoundError) and error.name:
        text += f"; this needs {optional_packages.cure(error.name)}"
    return " ".join(text.split())


def _show_warning(message: Warning | str, *_: object, **__: object) -> None:
    say(f"warning: {spoken(str(message))}")


def _give_up_stdout() -> None:
    # What could not be written may still be in its buffer, and would be tried again at the end.
    try:
        sys.stdout.flush()
    except OSError:
        with suppress(OSError, ValueError):
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
