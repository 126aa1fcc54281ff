# SPDX-License-Identifier: MIT
"""Recipes as TOML files, by path or by the name of one that comes with the library."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from hybridreg.config.plain_values import build, value_of
from hybridreg.io.structured import read_toml
from hybridreg.learned import recipes
from hybridreg.learned.cross3dreg.config import NetworkConfig
from hybridreg.learned.cross3dreg.sizes import named_config
from hybridreg.learned.network_table import DEFAULT
from hybridreg.learned.training.recipe import Phase, Recipe
from hybridreg.learned.weights import read_network

_NETWORK_KEYS = {"size": "small", "omp": True, "vgam": True}


def read(path: str | os.PathLike[str]) -> Recipe:
    """Read a recipe.

    Raises
    ------
    FileNotFoundError
        Neither a file nor a shipped name.
    ValueError
        Not TOML, an unknown key, or an invalid value.
    """
    name = os.fspath(path)
    table = _content(name)
    try:
        return parse(table, name=Path(name).stem)
    except (ValueError, KeyError) as error:
        raise ValueError(f"{name}: {error.args[0]}") from error


def _content(name: str, behind: tuple[str, ...] = ()) -> dict[str, Any]:
    # ``base`` names a recipe whose values count where this one gives none; tables are merged, lists replaced.
    if name in behind:
        raise ValueError(f"{behind[0]}: base refers to itself: {' -> '.join((*behind, name))}")
    table = read_toml(recipes.find(name))
    base = table.pop("base", None)
    if base is None:
        return table
    if not isinstance(base, str):
        raise ValueError(f"{name}: base={base!r} must be the name or the path of a recipe")
    return _merged(_content(base, (*behind, name)), table)


def parse(table: Mapping[str, Any], *, name: str) -> Recipe:
    """The recipe of a file's content.

    ``network`` names the network, or is a table that alters it (with its name as ``name``); ``size``, and for
    Cross3DReg ``omp`` and ``vgam``, choose its configuration. With ``start`` and none of these the network is that of
    the weights.
    """
    known = {each.name for each in dataclasses.fields(Recipe)} - {"kind"} | {"base", *_NETWORK_KEYS}
    if unknown := sorted(set(table) - known):
        raise ValueError(f"recipe: unknown keys {unknown}; known are {sorted(known)}")
    base: dict[str, Any] = {
        key: value_of(type(default), table.get(key, default), f"recipe.{key}")
        for key, default in _NETWORK_KEYS.items()
    }
    given = table.get("network", {})
    altered = dict(
        value_of(Mapping[str, Any], {"name": given} if isinstance(given, str) else given, "recipe.network")
    )
    network: Any
    kind = value_of(str, altered.pop("name", DEFAULT), "recipe.network.name")
    start = value_of(str, table.get("start", ""), "recipe.start")
    if start and not altered and not set(_NETWORK_KEYS) & set(table):
        held, network = read_network(start)
        if "network" in table and kind != held:
            raise ValueError(
                f"recipe.start: {start!r} holds weights of the network {held!r}, not of {kind!r}"
            )
        kind = held
    elif kind == DEFAULT:
        network = network_of(base["size"], omp=base["omp"], vgam=base["vgam"], changes=altered)
    else:
        parts = sorted({"omp", "vgam"} & set(table))
        if parts:
            raise ValueError(f"recipe.{parts[0]}: a part of {DEFAULT}, which {kind} does not have")
        network = _other_network(kind, base["size"], altered)
    rest = {key: value for key, value in table.items() if key not in _NETWORK_KEYS}
    return build(Recipe, {"name": name, **rest, "network": network, "kind": kind}, "recipe")


def _other_network(kind: str, size: str, changes: Mapping[str, Any]) -> Any:
    from hybridreg.learned.network_table import network_class

    cls = network_class(kind)
    return cls.config_type.from_dict(_merged(cls.named_config(size).to_dict(), changes))


def network_of(size: str, *, omp: bool, vgam: bool, changes: Mapping[str, Any]) -> NetworkConfig:
    """A named configuration with some of its values changed; those of a part that is switched off are left aside, as
    they come from the recipe that another builds on."""
    off = {name for name, on in (("omp", omp), ("vgam", vgam)) if not on}
    kept = {key: value for key, value in changes.items() if key not in off}
    merged = _merged(named_config(size, omp=omp, vgam=vgam).to_dict(), kept)
    return NetworkConfig.from_dict(merged)


def scaled(recipe: Recipe, factor: float) -> Recipe:
    """The recipe with the length of all phases scaled by a factor."""
    if not factor > 0:
        raise ValueError(f"steps-scale {factor}: must be above 0")
    return dataclasses.replace(recipe, phase=tuple(_scaled(phase, factor) for phase in recipe.phase))


def _scaled(phase: Phase, factor: float) -> Phase:
    return dataclasses.replace(
        phase,
        steps=max(1, round(phase.steps * factor)) if phase.steps else 0,
        epochs=phase.epochs * factor,
        warmup=round(phase.warmup * factor),
        decay_every=phase.decay_every * factor,
    )


def _merged(base: Mapping[str, Any], changes: Mapping[str, Any]) -> dict[str, Any]:
    merged = dict(base)
    for key, value in changes.items():
        inner = merged.get(key)
        merged[key] = (
            _merged(inner, value) if isinstance(inner, Mapping) and isinstance(value, Mapping) else value
        )
    return merged
