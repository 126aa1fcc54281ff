# SPDX-License-Identifier: MIT
"""What the library's own stages have in common: their fields are their configuration."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, ClassVar, NoReturn

import numpy as np

from hybridreg.config.near_name import did_you_mean
from hybridreg.config.typed_fields import typed

if TYPE_CHECKING:
    from typing_extensions import Self


class Stage:
    """Mix-in of a frozen keyword-only dataclass with `__call__`.

    `get_params` makes `sklearn.base.clone` work; `set_params` tells what to do instead. Third-party stages need not
    inherit from it.
    """

    needs: ClassVar[frozenset[str]] = frozenset()
    gives: ClassVar[frozenset[str]] = frozenset()

    def __post_init__(self) -> None:
        """Check the fields by their annotations; a subclass that checks more calls this first.

        Raises
        ------
        ValueError
            Naming the field and its value.
        """
        given = own_params(self)
        for name, value in typed(type(self), given, type(self).__name__).items():
            if value is not given[name]:  # a list as a tuple, a number of numpy as Python's
                object.__setattr__(self, name, value)

    def set_params(self, **changes: Any) -> NoReturn:
        """Refused, as scikit-learn's way to change an estimator in place: a stage is frozen; `replace` gives a copy.

        Raises
        ------
        AttributeError
            Always, with the call of `replace` that means the same.
        """
        told = ", ".join(f"{name}={value!r}" for name, value in changes.items())
        raise dataclasses.FrozenInstanceError(
            f"{type(self).__name__} is frozen, set_params cannot change it; take the copy that replace({told}) gives"
        )

    def get_params(self, deep: bool = True) -> dict[str, Any]:
        """Fields by name; with `deep`, also those of nested stages as `field__name`."""
        params = own_params(self)
        if deep:
            for name, value in list(params.items()):
                if dataclasses.is_dataclass(value):
                    params.update({f"{name}__{k}": v for k, v in own_params(value).items()})
        return params

    def replace(self, **changes: Any) -> Self:
        """A copy with some fields changed; `field__name` reaches into a nested stage, as deep as need be."""
        copy: Self = _replaced(self, changes)
        return copy


def own_changes(stage: Any, changes: Mapping[str, Any]) -> dict[str, Any]:
    """Changes by `field` and `field__name` as changes of the stage's own fields."""
    own = {key: value for key, value in changes.items() if "__" not in key}
    for key, value in changes.items():
        outer, _, inner = key.partition("__")
        if inner:
            if outer not in own and not hasattr(stage, outer):
                own[outer] = value  # refused by whoever takes the changes, with the names that there are
                continue
            own[outer] = _with(own.get(outer, getattr(stage, outer, None)), inner, value, key)
    return own


def _with(nested: Any, field: str, value: Any, key: str) -> Any:
    if isinstance(nested, str):
        nested = {"stage": nested}
    if nested is None or isinstance(nested, Mapping):  # built with all its fields at once: some need others
        outer, _, inner = field.partition("__")
        nested = nested or {}
        return {**nested, outer: _with(nested.get(outer), inner, value, key) if inner else value}
    if not dataclasses.is_dataclass(nested):
        raise TypeError(f"{key}: {nested!r} has no fields")
    return _replaced(nested, {field: value})


def _replaced(stage: Any, changes: Mapping[str, Any]) -> Any:
    own, known = own_changes(stage, changes), list(own_params(stage))
    for name in own:
        if name not in known:
            has = f"its fields are {', '.join(known)}" if known else "it has none"
            raise TypeError(
                f"{type(stage).__name__} has no field {name!r}{did_you_mean(name, known)} ({has})"
            )
    return dataclasses.replace(stage, **own)


def same(one: Any, other: Any) -> bool:
    """Whether two stages, or two values of fields, are equal; arrays are where all their items are."""
    try:
        return one is other or bool(one == other)
    except ValueError:  # an array somewhere inside, which numpy does not reduce to one truth
        pass
    if isinstance(one, np.ndarray) or isinstance(other, np.ndarray):
        return np.array_equal(one, other)
    if type(one) is not type(other):
        return False
    if dataclasses.is_dataclass(one):
        names = [f.name for f in dataclasses.fields(one) if f.compare]
        return all(same(getattr(one, name), getattr(other, name)) for name in names)
    if isinstance(one, Mapping):
        return one.keys() == other.keys() and all(same(one[key], other[key]) for key in one)
    return len(one) == len(other) and all(map(same, one, other))


def own_params(stage: Any) -> dict[str, Any]:
    """Fields of a dataclass by name, nested stages as they are."""
    return {f.name: getattr(stage, f.name) for f in dataclasses.fields(stage) if f.init}
