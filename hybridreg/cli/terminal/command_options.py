# SPDX-License-Identifier: MIT
"""Which options the running command has, and which of them were given: not every command takes every cure."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Any

from typer.models import OptionInfo

_NONE: tuple[Callable[..., None] | None, Mapping[str, Any]] = (None, {})
_running: ContextVar[tuple[Callable[..., None] | None, Mapping[str, Any]]] = ContextVar(
    "running", default=_NONE
)


@contextmanager
def running(command: Callable[..., None], values: Mapping[str, Any]) -> Iterator[None]:
    """Within the block, this is the command, called with these values of its parameters by name."""
    token = _running.set((command, values))
    try:
        yield
    finally:
        _running.reset(token)


def offered() -> set[str] | None:
    """Long names of the running command's options; None where no command runs."""
    command, _ = _running.get()
    return None if command is None else {option for option, _ in _options(command)}


def given() -> set[str]:
    """Those of them that have another value than they have by default."""
    command, values = _running.get()
    if command is None:
        return set()
    return {
        option
        for option, parameter in _options(command)
        if values.get(parameter.name, parameter.default) != parameter.default
    }


def _options(command: Callable[..., None]) -> Iterator[tuple[str, inspect.Parameter]]:
    for parameter in inspect.signature(command, eval_str=True).parameters.values():
        for note in getattr(parameter.annotation, "__metadata__", ()):
            if isinstance(note, OptionInfo):
                # Beside an annotation typer keeps the first name in the place of the default.
                named = [each for each in (note.default, *(note.param_decls or ())) if isinstance(each, str)]
                for option in named or [f"--{parameter.name.replace('_', '-')}"]:
                    yield option, parameter
