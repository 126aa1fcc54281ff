# SPDX-License-Identifier: MIT
"""Changes to a pipeline as text: a line of a table file, or `--set` on the command line."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from typing import Any

from hybridreg import presets
from hybridreg.io import shipped_weights
from hybridreg.pipeline import Pipeline
from hybridreg.slots import SLOTS
from hybridreg.spec import to_table

KEYS = ("preset", "pipeline", "voxel", "prior", *SLOTS)


def build(changes: Mapping[str, Any]) -> Pipeline:
    """Pipeline from a preset (or a pipeline file) and the changes to it.

    Parameters
    ----------
    changes : mapping
        `preset` a name or `pipeline` a TOML file, `voxel` metres, and for each slot a stage's name, a table
        with `stage` for another stage, or a table without it for other fields of the stage that is there; `prior` a
        table of what is known beforehand (`hybridreg.prior.prior.Prior`).

    Raises
    ------
    KeyError, ValueError
        A name, key or field that does not exist; stages that do not fit together.
    MissingWeights
        A stage's weights are not here.
    """
    unknown = set(changes) - set(KEYS)
    if unknown:
        raise ValueError(f"{', '.join(sorted(unknown))}: unknown; a pipeline is given by {', '.join(KEYS)}")
    if "preset" in changes and "pipeline" in changes:
        preset, path = changes["preset"], str(changes["pipeline"])
        raise ValueError(f"preset={preset!r} and pipeline={path!r}: leave one of them out")
    if "pipeline" in changes:
        if not isinstance(changes["pipeline"], (str, os.PathLike)):
            raise ValueError(f"pipeline={changes['pipeline']!r} must be the path of a TOML file")
        start, what = Pipeline.load(changes["pipeline"]), f"pipeline {changes['pipeline']}"
    else:
        name = changes.get("preset", presets.DEFAULT)
        start, what = Pipeline(**presets.load(name)), f"preset {name!r}"
    changed = {key: value for key, value in changes.items() if key not in ("preset", "pipeline")}
    if set(changed) & set(SLOTS):
        what = "this pipeline"
    built = apply(start, changed)
    # Now, not before: the weights may be what was changed.
    shipped_weights.require({slot: getattr(built, slot) for slot in SLOTS}, what)
    return built


def apply(pipeline: Pipeline, changes: Mapping[str, Any]) -> Pipeline:
    """The pipeline with other stages in some slots, or other fields of a slot's stage."""
    estimate = changes.get("estimate")
    if "match" in changes and isinstance(estimate, Mapping) and not {"stage", "weights"} & set(estimate):
        # First alone, so that the estimate's weights follow it; then the estimate's other fields.
        pipeline = apply(pipeline, {"match": changes["match"]})
    slots: dict[str, Any] = {}
    for slot, change in changes.items():
        if slot == "prior":
            slots[slot] = change if pipeline.prior is None else {**pipeline.prior.to_table(), **change}
        elif isinstance(change, Mapping) and "stage" not in change:
            slots[slot] = {**to_table(getattr(pipeline, slot), slot), **change}
        else:
            slots[slot] = change
    return pipeline.swap(**slots)


def merge(base: Mapping[str, Any], changes: Mapping[str, Any]) -> dict[str, Any]:
    """`base` overlaid by `changes`; fields of one stage are joined, another stage replaces the old one."""
    merged = dict(base)
    for key, change in changes.items():
        before = merged.get(key)
        if isinstance(change, Mapping) and "stage" not in change and before is not None:
            before = {"stage": before} if isinstance(before, str) else before
            merged[key] = {**before, **change} if isinstance(before, Mapping) else change
        else:
            merged[key] = change
    return merged


def parse(settings: Iterable[str]) -> dict[str, Any]:
    """Changes from texts like `match=fpfh`, `match.radius=1.25`, `voxel=0.3`.

    Raises
    ------
    ValueError
        A text without `=`, or deeper than `slot.field`.
    """
    changes: dict[str, Any] = {}
    for text in settings:
        key, equals, value = text.partition("=")
        slot, dot, field = key.strip().partition(".")
        if not equals or not slot or (dot and not field) or "." in field:
            raise ValueError(
                f"--set {text}: expected slot=name or slot.field=value, such as match.radius=1.25"
            )
        changes = merge(changes, {slot: {field: _value(value)} if dot else _value(value)})
    return changes


def _value(text: str) -> Any:
    from hybridreg.io.structured import parse_toml

    try:
        return parse_toml(f"value = {text}", "--set")["value"]
    except ValueError:
        return text.strip()
