# SPDX-License-Identifier: MIT
"""The data of a recipe: folders that it leaves open, and data that replaces its own."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Mapping, Sequence

from hybridreg.learned.training.recipe import DataPlan, Phase, Recipe, Source

_OPEN = re.compile(r"\{(\w[\w-]*)\}")


def with_data(recipe: Recipe, texts: Sequence[str]) -> Recipe:
    """The recipe with the data that a user names.

    Parameters
    ----------
    texts
        ``NAME=TEXT`` replaces ``{NAME}`` in the recipe's training and validation data by TEXT, or otherwise the
        training source of that name. Texts without a name replace all training sources.
    """
    named = {name: text for name, equals, text in map(_parted, texts) if equals}
    known = missing_data(recipe)
    filled = _filled(recipe, {name: text for name, text in named.items() if name in known})
    rest = [text for text in texts if _parted(text)[0] not in known]
    return _replaced(filled, rest) if rest else filled


def missing_data(recipe: Recipe) -> list[str]:
    """Names of the folders that the recipe leaves open."""
    sources = (*recipe.data.train, *recipe.data.val)
    return list(dict.fromkeys(name for source in sources for name in _OPEN.findall(source.data)))


def require_data(recipe: Recipe) -> None:
    """Refuse a recipe with a folder left open.

    Raises
    ------
    ValueError
        The message names the missing option.
    """
    missing = missing_data(recipe)
    if missing:
        options = " ".join(f"--data {name}=FOLDER" for name in missing)
        raise ValueError(f"recipe {recipe.name} does not come with its data: give {options}")


def _parted(text: str) -> tuple[str, str, str]:
    return text.partition("=")


def _filled(recipe: Recipe, given: Mapping[str, str]) -> Recipe:
    def fill(source: Source) -> Source:
        text = _OPEN.sub(lambda found: given.get(found[1], found[0]), source.data)
        return dataclasses.replace(source, data=text)

    data = recipe.data
    train, val = (tuple(fill(source) for source in sources) for sources in (data.train, data.val))
    return _on(recipe, dataclasses.replace(data, train=train, val=val), recipe.phase)


def _replaced(recipe: Recipe, texts: Sequence[str]) -> Recipe:
    named = {source.title: source for source in recipe.data.train}
    replaced = [_parted(text) for text in texts]
    if all(equals and name in named for name, equals, _ in replaced):
        for name, _, text in replaced:
            named[name] = dataclasses.replace(named[name], data=text, name=name)
        return _on(recipe, dataclasses.replace(recipe.data, train=tuple(named.values())), recipe.phase)
    phases = tuple(dataclasses.replace(phase, data={}) for phase in recipe.phase)
    train = tuple(Source(data=text) for text in texts)
    return _on(recipe, dataclasses.replace(recipe.data, train=train), phases)


def _on(recipe: Recipe, data: DataPlan, phases: tuple[Phase, ...]) -> Recipe:
    # At once: a phase may only name sources that the data has.
    return dataclasses.replace(recipe, data=data, phase=phases)
