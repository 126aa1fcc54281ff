# SPDX-License-Identifier: MIT
"""Recipes as TOML files, by path or by the name of one that comes with the library."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from hybridreg.io.structured import read_toml
from hybridreg.learned import recipes
from hybridreg.learned.config import NetworkConfig
from hybridreg.learned.sizes import named_config
from hybridreg.learned.training.recipe import Phase, Recipe
from hybridreg.plain_values import build, value_of

_NETWORK_KEYS = {"size": "small", "omp": True, "vgam": True}


def read(path: str | os.PathLike[str]) -> Recipe:
    """Read a recipe.

    Raises
    ------
    FileNotFoundError
        Neither a file nor a shipped name.
    ValueError
        Not TOML, an unknown key, or a value that cannot be.
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
        raise ValueError(f"{behind[0]}: base goes round in a circle: {' -> '.join((*behind, name))}")
    table = read_toml(recipes.find(name))
    base = table.pop("base", None)
    if base is None:
        return table
    if not isinstance(base, str):
        raise ValueError(f"{name}: base={base!r} must be the name or the path of a recipe")
    return _merged(_content(base, (*behind, name)), table)


def parse(table: Mapping[str, Any], *, name: str) -> Recipe:
    """The recipe of a file's content: ``size``, ``omp``, ``vgam`` choose the network, ``[network]`` alters it."""
    base: dict[str, Any] = {
        key: value_of(type(default), table.get(key, default), f"recipe.{key}")
        for key, default in _NETWORK_KEYS.items()
    }
    altered = value_of(Mapping[str, Any], table.get("network", {}), "recipe.network")
    network = network_of(base["size"], omp=base["omp"], vgam=base["vgam"], changes=altered)
    rest = {key: value for key, value in table.items() if key not in _NETWORK_KEYS}
    return build(Recipe, {"name": name, **rest, "network": network.to_dict()}, "recipe")


def network_of(size: str, *, omp: bool, vgam: bool, changes: Mapping[str, Any]) -> NetworkConfig:
    """A named configuration with some of its values changed."""
    merged = _merged(named_config(size, omp=omp, vgam=vgam).to_dict(), changes)
    return NetworkConfig.from_dict(merged)


def scaled(recipe: Recipe, factor: float) -> Recipe:
    """The recipe with all phases longer or shorter by a factor."""
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
