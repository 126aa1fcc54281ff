# SPDX-License-Identifier: MIT
"""What a stage or a preset is, in text: its description, and its fields with their defaults."""

from __future__ import annotations

import dataclasses
import inspect
import json
from collections.abc import Iterator
from difflib import get_close_matches
from importlib.resources import files
from typing import Any

from hybridreg import presets, registry
from hybridreg.slots import SLOTS


def about(name: str) -> str:
    """Everything of this name: stages of each slot, then the preset as its file has it.

    Raises
    ------
    ValueError
        Nothing is called so; the message has the nearest names.
    """
    found = [*_stages(name), *_presets(name)]
    if not found:
        known = sorted({*presets.names(), *(each for slot in SLOTS for each in registry.names(slot))})
        near = get_close_matches(name, known)
        cure = f"did you mean {', '.join(near)}?" if near else "`hybridreg list` has all names"
        raise ValueError(f"{name}: neither a kind of name, nor a stage, nor a preset; {cure}")
    return "\n\n".join(found)


def _stages(name: str) -> Iterator[str]:
    for slot in SLOTS:
        if name in registry.names(slot):
            stage = registry.load(slot, name)
            yield f'{slot} = "{name}"\n\n{inspect.getdoc(stage)}\n\n{_fields(slot, name, stage)}'


def _fields(slot: str, name: str, stage: type[Any]) -> str:
    fields = dataclasses.fields(stage) if dataclasses.is_dataclass(stage) else ()
    lines = [_line(field) for field in fields if field.init]
    if not lines:
        return "It has no fields."
    text = "\n".join([f"[{slot}]", f'stage = "{name}"', *lines])
    return f"Its defaults, as a pipeline's file has them (on the command line --set {slot}.FIELD=VALUE):\n\n{text}"


def _line(field: dataclasses.Field[Any]) -> str:
    if field.default is not dataclasses.MISSING:
        value = field.default
    elif field.default_factory is not dataclasses.MISSING:
        value = field.default_factory()
    else:
        return f"{field.name} = ...  # needed"
    if value is None:  # TOML has no such value
        return f"# {field.name} is not set"
    if isinstance(value, (bool, int, float, str)) or (isinstance(value, tuple) and "{" not in repr(value)):
        return f"{field.name} = {json.dumps(value)}"
    return f"# {field.name} = {value!r}"


def _presets(name: str) -> Iterator[str]:
    if name in presets.names():
        text = files("hybridreg.presets").joinpath(f"{name}.toml").read_text(encoding="utf-8")
        yield f"preset {name}\n\n{text.strip()}"
