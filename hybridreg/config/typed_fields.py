# SPDX-License-Identifier: MIT
"""Fields of a dataclass by their annotations: what a file or a caller gives for them is checked where it is given."""

from __future__ import annotations

import dataclasses
import typing
from collections.abc import Mapping
from functools import cache
from typing import Any

from hybridreg.config.plain_values import value_of


def typed(cls: type[Any], values: Mapping[str, Any], where: str) -> dict[str, Any]:
    """Values by the names of fields, as the fields' annotations want them (`plain_values.value_of`).

    A field's own default is trusted, and so is what has no annotation.

    Raises
    ------
    ValueError
        A value of another kind; the message begins with ``where`` and the field.
    """
    hints, defaults = _hints(cls), {f.name: f.default for f in dataclasses.fields(cls)}  # type: ignore[arg-type]
    return {
        key: value_of(hints[key], value, f"{where}: {key}")
        if key in hints and value is not defaults.get(key)
        else value
        for key, value in values.items()
    }


@cache
def _hints(cls: type[Any]) -> dict[str, Any]:
    try:
        return typing.get_type_hints(cls)
    except NameError:  # third-party annotations, of names that only a type checker imports
        return {}
