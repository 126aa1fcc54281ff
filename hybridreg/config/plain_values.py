# SPDX-License-Identifier: MIT
"""Frozen dataclasses from plain values, as TOML and JSON give them; unknown keys are refused by name."""

from __future__ import annotations

import dataclasses
import types
import typing
from collections.abc import Mapping
from contextlib import suppress
from typing import Any, Literal, TypeVar

import numpy as np

T = TypeVar("T")
_WANTED = {bool: "true or false", int: "a number", float: "a number", str: "a text"}


def build(cls: type[T], values: Mapping[str, Any], where: str) -> T:
    """An instance of a dataclass from a mapping, nested ones and tuples of them included.

    Raises
    ------
    ValueError
        An unknown key or a value of the wrong kind: it is named, with its location after ``where``.
    """
    if not isinstance(values, Mapping):
        raise ValueError(f"{where}: expected a table, got {_shown(values)}")
    hints = typing.get_type_hints(cls)
    unknown = sorted(set(values) - set(hints))
    if unknown:
        raise ValueError(f"{where}: unknown keys {unknown}; known are {sorted(hints)}")
    missing = [f.name for f in dataclasses.fields(cls) if _required(f) and f.name not in values]  # type: ignore[arg-type]
    if missing:
        raise ValueError(f"{where}: {', '.join(missing)} missing")
    return cls(**{name: value_of(hints[name], value, f"{where}.{name}") for name, value in values.items()})


def value_of(hint: Any, value: Any, where: str) -> Any:
    """A value as an annotation wants it: lists become tuples, whole numbers floats, numpy's numbers Python's.

    Values that an annotation does not describe (`Any`, a third-party class) pass unchanged.

    Raises
    ------
    ValueError
        A value of another kind; the message begins with ``where``.
    """
    origin, parts = typing.get_origin(hint), typing.get_args(hint)
    if origin in (typing.Union, types.UnionType):
        return _optional(parts, value, where)
    if dataclasses.is_dataclass(hint):
        if isinstance(value, typing.cast(type, hint)):
            return value
        return build(typing.cast(type, hint), value, where)
    if origin is tuple:
        value = value.tolist() if isinstance(value, np.ndarray) else value
        _checked(isinstance(value, (list, tuple, range)), value, where, "a list")
        made = tuple(value_of(parts[0], item, f"{where}[{i}]") for i, item in enumerate(value))
        # The same object where nothing changed: sklearn.base.clone insists.
        unchanged = isinstance(value, tuple) and all(a is b for a, b in zip(made, value, strict=True))
        return value if unchanged else made
    if origin is list:
        _checked(isinstance(value, list), value, where, "a list")
        return [value_of(parts[0], item, f"{where}[{i}]") for i, item in enumerate(value)]
    if isinstance(origin, type) and issubclass(origin, Mapping):
        _checked(isinstance(value, Mapping), value, where, "a table")
        table = {
            value_of(parts[0], key, where): value_of(parts[1], item, f"{where}.{key}")
            for key, item in value.items()
        }
        return value if all(table.get(key) is item for key, item in value.items()) else table
    if origin is Literal:
        value = _native(value)
        # Not `in` alone: True equals 1, and a list is not hashable.
        right = any(type(part) is type(value) and part == value for part in parts)
        return _checked(right, value, where, f"one of {', '.join(map(repr, parts))}")
    return _plain(hint, value, where)


def _required(field: dataclasses.Field[Any]) -> bool:
    return field.default is dataclasses.MISSING and field.default_factory is dataclasses.MISSING


def _optional(parts: tuple[Any, ...], value: Any, where: str) -> Any:
    if value is None and type(None) in parts:
        return None
    *others, last = (part for part in parts if part is not type(None))
    for part in others:
        with suppress(ValueError):
            return value_of(part, value, where)
    return value_of(last, value, where)


def _plain(hint: Any, value: Any, where: str) -> Any:
    if hint in (bool, int, float, str):
        value = _native(value)
    if hint is float and isinstance(value, int) and not isinstance(value, bool):
        try:
            return float(value)
        except OverflowError:
            return _checked(False, value, where, "a number below 1e308")
    if hint in (bool, int, float, str):
        right = isinstance(value, hint) and (hint is bool or not isinstance(value, bool))
        fraction = hint is int and isinstance(value, float)
        return _checked(right, value, where, "a whole number" if fraction else _WANTED[hint])
    return value


def _native(value: Any) -> Any:
    # Python's own of a numpy scalar, as which arithmetic often returns a number.
    return value.item() if isinstance(value, (np.generic, np.ndarray)) and value.ndim == 0 else value


def _checked(right: bool, value: Any, where: str, wanted: str) -> Any:
    if not right:
        raise ValueError(f"{where}: expected {wanted}, got {_shown(value)}")
    return value


def _shown(value: Any) -> str:
    shown = repr(value)
    return shown if len(shown) <= 200 else f"{shown[:200]}..."
