# SPDX-License-Identifier: MIT
"""The command as it was typed, for reports that say how they were made."""

from __future__ import annotations

import shlex
from enum import Enum

import typer


def typed(context: typer.Context) -> str:
    """The running command with every argument and option that was given, quoted for a shell.

    Options stand under their long names, so that a reader needs no help page.
    """
    arguments: list[str] = []
    options: list[str] = []
    for parameter in context.command.params:
        name = str(parameter.name)
        if getattr(context.get_parameter_source(name), "name", "") != "COMMANDLINE":
            continue
        value = context.params[name]
        values = value if isinstance(value, (list, tuple)) else [value]
        if parameter.param_type_name == "argument":
            arguments += [_text(each) for each in values]
        elif value is True:
            options.append(parameter.opts[0])
        else:
            options += [word for each in values for word in (parameter.opts[0], _text(each))]
    return shlex.join(["hybridreg", str(context.info_name), *arguments, *options])


def _text(value: object) -> str:
    return str(value.value) if isinstance(value, Enum) else str(value)
