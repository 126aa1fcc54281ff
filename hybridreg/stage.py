# SPDX-License-Identifier: MIT
"""What the library's own stages have in common: their fields are their configuration."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING, Any, ClassVar

if TYPE_CHECKING:
    from typing_extensions import Self


class Stage:
    """Mix-in of a frozen keyword-only dataclass with `__call__`.

    `get_params` makes `sklearn.base.clone` work. Third-party stages need not inherit from it.
    """

    needs: ClassVar[frozenset[str]] = frozenset()
    gives: ClassVar[frozenset[str]] = frozenset()

    def get_params(self, deep: bool = True) -> dict[str, Any]:
        """Fields by name; with `deep`, also those of nested stages as `field__name`."""
        params = own_params(self)
        if deep:
            for name, value in list(params.items()):
                if dataclasses.is_dataclass(value):
                    params.update({f"{name}__{k}": v for k, v in own_params(value).items()})
        return params

    def replace(self, **changes: Any) -> Self:
        """A copy with some fields changed; `field__name` reaches into a nested stage."""
        plain = {k: v for k, v in changes.items() if "__" not in k}
        for key, value in changes.items():
            outer, _, inner = key.partition("__")
            if inner:
                nested = plain.get(outer, getattr(self, outer))
                plain[outer] = dataclasses.replace(nested, **{inner: value})
        return dataclasses.replace(self, **plain)  # type: ignore[type-var]


def own_params(stage: Any) -> dict[str, Any]:
    """Fields of a dataclass by name, nested stages as they are."""
    return {f.name: getattr(stage, f.name) for f in dataclasses.fields(stage) if f.init}
