# SPDX-License-Identifier: MIT
"""Frozen dataclasses from plain values, as TOML and JSON give them; unknown keys are refused by name."""

from __future__ import annotations

import dataclasses
import types
import typing
from collections.abc import Mapping
from typing import Any, Literal, TypeVar

T = TypeVar("T")
_NUMBERS = (int, float)


def build(cls: type[T], values: Mapping[str, Any], where: str) -> T:
    """An instance of a dataclass from a mapping, nested ones and tuples of them included.

    Raises
    ------
    ValueError
        An unknown key or a value of the wrong kind: it is named, with its place after ``where``.
    """
    if not isinstance(values, Mapping):
        raise ValueError(f"{where}: expected a table, got {values!r}")
    hints = typing.get_type_hints(cls)
    unknown = sorted(set(values) - set(hints))
    if unknown:
        raise ValueError(f"{where}: unknown keys {unknown}; known are {sorted(hints)}")
    try:
        return cls(**{name: _value(hints[name], value, f"{where}.{name}") for name, value in values.items()})
    except TypeError as error:
        missing = [f.name for f in dataclasses.fields(cls) if _required(f) and f.name not in values]  # type: ignore[arg-type]
        raise ValueError(
            f"{where}: {', '.join(missing)} missing" if missing else f"{where}: {error}"
        ) from error


def _required(field: dataclasses.Field[Any]) -> bool:
    return field.default is dataclasses.MISSING and field.default_factory is dataclasses.MISSING


def _value(hint: Any, value: Any, where: str) -> Any:
    origin, parts = typing.get_origin(hint), typing.get_args(hint)
    if origin in (typing.Union, types.UnionType):
        if value is None and type(None) in parts:
            return None
        return _value(next(part for part in parts if part is not type(None)), value, where)
    if dataclasses.is_dataclass(hint):
        return build(typing.cast(type, hint), value, where)
    if origin is tuple:
        return _tuple(parts, value, where)
    if origin is Literal:
        return _checked(value in parts, value, where, f"one of {', '.join(map(repr, parts))}")
    return _plain(hint, value, where)


def _tuple(parts: tuple[Any, ...], value: Any, where: str) -> tuple[Any, ...]:
    _checked(isinstance(value, (list, tuple)), value, where, "a list")
    return tuple(_value(parts[0], item, f"{where}[{i}]") for i, item in enumerate(value))


def _plain(hint: Any, value: Any, where: str) -> Any:
    if hint is float and isinstance(value, int) and not isinstance(value, bool):
        return float(value)
    if hint in (bool, int, float, str):
        right = isinstance(value, hint) and (hint is bool or not isinstance(value, bool))
        return _checked(right, value, where, {bool: "true or false", str: "a text"}.get(hint, "a number"))
    return value


def _checked(right: bool, value: Any, where: str, wanted: str) -> Any:
    if not right:
        raise ValueError(f"{where}: expected {wanted}, got {value!r}")
    return value
