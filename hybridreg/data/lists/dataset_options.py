# SPDX-License-Identifier: MIT
"""Data sets as one text: "PATH#option,name=value"."""

from __future__ import annotations

import inspect
from collections.abc import Iterable
from pathlib import Path
from typing import Any

_TRUTH = {"yes": True, "true": True, "no": False, "false": False}


def parse(text: str, signature: inspect.Signature) -> tuple[str, dict[str, Any]]:
    """The path, and the options as keyword arguments of `signature`, whose first parameter is the path.

    A bare word is the value of the next parameter in order, or switches on the flag of that name; the type of
    a value follows from the parameter's default.

    Raises
    ------
    ValueError
        An unknown name, too many words, or a value of the wrong type; says what there is.
    """
    if "#" not in text or Path(text).exists():
        return text, {}
    path, _, rest = text.rpartition("#")
    parameters = list(signature.parameters.values())[1:]
    options: dict[str, Any] = {}
    for word in filter(None, (part.strip() for part in rest.split(","))):
        parameter, value = _meant(word, parameters, options, text)
        options[parameter.name] = _typed(value, parameter, text)
    return path, options


def _meant(
    word: str, parameters: list[inspect.Parameter], given: Iterable[str], text: str
) -> tuple[inspect.Parameter, str]:
    named = {p.name: p for p in parameters}
    name, equals, value = word.partition("=")
    name = name.strip().replace("-", "_")
    if equals and name in named:
        return named[name], value.strip()
    if name in named and isinstance(named[name].default, bool):
        return named[name], "yes"
    free = [p for p in parameters if p.name not in given and not isinstance(p.default, bool)]
    if not equals and free:
        return free[0], word
    known = ", ".join(f"{p.name}={p.default}" for p in parameters) or "none"
    raise ValueError(f"{text}: {word!r} is not an option; there are {known}")


def _typed(value: str, parameter: inspect.Parameter, text: str) -> Any:
    kind = type(parameter.default)
    try:
        if kind is bool:
            return _TRUTH[value.lower()]
        return kind(value) if kind in (int, float) else value
    except (ValueError, KeyError):
        wanted = "yes or no" if kind is bool else f"a number such as {parameter.default}"
        raise ValueError(f"{text}: {parameter.name}={value!r} must be {wanted}") from None
