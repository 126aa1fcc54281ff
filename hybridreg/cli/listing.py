# SPDX-License-Identifier: MIT
"""`hybridreg list`: the names of stages, presets, data sets, tables, protocols, recipes, networks and weights; and what
one of them is."""

from __future__ import annotations

from collections.abc import Iterator
from enum import Enum
from typing import Annotated

import typer

from hybridreg.cli.terminal.error_messages import plainly


class Kind(str, Enum):
    """What to list."""

    stages = "stages"
    presets = "presets"
    datasets = "datasets"
    tables = "tables"
    protocols = "protocols"
    recipes = "recipes"
    networks = "networks"
    weights = "weights"


_KINDS = tuple(kind.value for kind in Kind)
_WHAT = f"{', '.join(_KINDS)} (all of them if not given), or a stage or a preset by its name."


@plainly
def command(what: Annotated[str | None, typer.Argument(help=_WHAT)] = None) -> None:
    """List what comes with the library, or tell what a stage or a preset does and which fields it has."""
    if what is not None and what not in _KINDS:
        from hybridreg.cli.about_names import about

        print(about(what))
        return
    for each in Kind if what is None else [Kind(what)]:
        print(f"{each.value}:")
        for line in lines(each):
            print(f"  {line}")


def lines(kind: Kind) -> Iterator[str]:
    """The names of one kind, each with its meaning."""
    from hybridreg import presets, registry
    from hybridreg.data import catalogue
    from hybridreg.eval import table_file
    from hybridreg.eval.score import protocols
    from hybridreg.learned import recipes
    from hybridreg.slots import SLOTS

    if kind is Kind.stages:
        yield from (f"{slot}: {', '.join(registry.names(slot))}" for slot in SLOTS)
    elif kind is Kind.presets:
        yield from (f"{name}{_remark(name)}" for name in presets.names())
    elif kind is Kind.datasets:
        yield "a folder of pairs, by its path"
        yield from (f"{name}:..." for name in catalogue.names())
    elif kind is Kind.tables:
        yield from table_file.known()
    elif kind is Kind.recipes:
        yield from recipes.names()
    elif kind is Kind.networks:
        yield from (f"{name}: {sizes}" for name, sizes in _networks())
    elif kind is Kind.weights:
        yield from _weights()
    else:
        yield from (each.describe().removeprefix("protocol ") for each in protocols.PROTOCOLS.values())


def _networks() -> Iterator[tuple[str, str]]:
    from hybridreg.learned.network_table import NETWORKS, network_class

    for name in NETWORKS:
        try:
            yield name, ", ".join(network_class(name).sizes)
        except ImportError as error:  # torch may be missing: the other kinds are listed all the same
            yield name, f"does not load: {error}"


def _weights() -> Iterator[str]:
    from hybridreg.io import shipped_weights

    for name in shipped_weights.names():
        visits = shipped_weights.visits(name)
        yield name if visits is None else f"{name}: {visits:,} visits of training pairs"


def _remark(preset: str) -> str:
    from hybridreg import presets
    from hybridreg.io import shipped_weights

    try:
        shipped_weights.require(presets.load(preset), preset)
    except shipped_weights.MissingWeights:
        return " (its weights do not come with this version)"
    return " (default)" if preset == presets.DEFAULT else ""
