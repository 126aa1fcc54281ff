# SPDX-License-Identifier: MIT
"""Stages as plain tables, for TOML files and stored results.

A table names a registered stage and its fields: `{stage = "match.fpfh", radius = 1.25}`. Reading one can only create
objects of registered classes, so a file from an untrusted source cannot run code. Inside a stage's table, a field with
a slot's name holds a stage of that slot, and a table of slots one stage for each:
`{match = "fpfh", estimate = "ransac"}`.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from hybridreg import registry
from hybridreg.config.typed_fields import typed
from hybridreg.slots import SLOTS
from hybridreg.stage import own_params


def to_table(stage: Any, slot: str | None = None, *, for_file: bool = False) -> dict[str, Any]:
    """Table of a stage; inside its own slot the short name suffices.

    What no table can hold, such as a network, is named by its class, unless the table is `for_file`.

    Raises
    ------
    ValueError
        A field's value that no file can hold, naming stage and field.
    """
    registered = registry.name_of(stage)
    if registered is None:
        named = stage if hasattr(stage, "__qualname__") else type(stage)
        name = f"{named.__module__}:{named.__qualname__}"
    else:
        name = registered.removeprefix(f"{slot}.") if slot else registered
    fields = own_params(stage) if dataclasses.is_dataclass(stage) else {}

    def other(value: Any, key: str) -> str:
        if for_file:
            raise ValueError(
                f"{name}: {key} is a {type(value).__name__}, which no file holds; let the field be what it is made "
                "from, such as the path of a network's weights"
            )
        return f"{type(value).__module__}:{type(value).__qualname__}"

    # TOML has no null; a field left out takes its default, which is None wherever a field may be None.
    plain = {key: _plain(value, key, for_file, other) for key, value in fields.items() if value is not None}
    return {"stage": name, **plain}


def _plain(value: Any, key: str, for_file: bool, other: Callable[[Any, str], str]) -> Any:
    if key in SLOTS and callable(value):
        return to_table(value, key, for_file=for_file)
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return to_table(value, for_file=for_file)
    if isinstance(value, Mapping):
        return {slot: _plain(stage, slot, for_file, other) for slot, stage in value.items()}
    if isinstance(value, (tuple, list, np.ndarray)):
        return [_plain(item, "", for_file, other) for item in value]
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, (str, int, float, bool)):
        return value
    return other(value, key)


def from_table(table: Any, slot: str | None = None) -> Any:
    """Stage of a table, or of a bare name.

    Raises
    ------
    KeyError
        A stage that is not registered.
    ValueError
        A field that the stage does not have, a value of the wrong type, or a table without a `stage`.
    """
    if isinstance(table, str):
        table = {"stage": table}
    if not isinstance(table, Mapping) or not isinstance(table.get("stage"), str):
        raise ValueError(f"expected a stage's name or a table with a `stage`, got {table!r}")
    own_slot, name = _resolve(table["stage"], slot)
    cls = registry.load(own_slot, name)
    fields = {key: _restore(value, key) for key, value in table.items() if key != "stage"}
    try:
        return cls(**_typed(cls, fields, f"{own_slot} stage {name!r}"))
    except TypeError as error:
        known = [f.name for f in dataclasses.fields(cls)] if dataclasses.is_dataclass(cls) else []
        has = f"its fields are {', '.join(known)}" if known else "it has no fields"
        raise ValueError(f"{own_slot} stage {name!r}: {error}; {has}") from error


def _typed(cls: type[Any], fields: dict[str, Any], where: str) -> dict[str, Any]:
    return typed(cls, fields, where) if dataclasses.is_dataclass(cls) else fields


def _resolve(name: str, slot: str | None) -> tuple[str, str]:
    if ":" in name:
        raise KeyError(
            f"{name!r} is a class, and files may only name registered stages; register it through the entry-point "
            f"group {registry.ENTRY_POINTS!r}"
        )
    if slot is not None and not name.startswith(f"{slot}."):
        return slot, name
    own_slot, _, short = name.partition(".")
    return own_slot, short


def _restore(value: Any, key: str) -> Any:
    if isinstance(value, Mapping):
        if value and set(value) <= set(SLOTS):
            return {slot: _restore(stage, slot) for slot, stage in value.items()}
        return from_table(value, key if key in SLOTS else None)
    if isinstance(value, list):
        return tuple(_restore(item, "") for item in value)
    return value
