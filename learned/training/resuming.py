# SPDX-License-Identifier: MIT
"""Whether a checkpoint can continue under this recipe: everything that shaped its past steps must be the same."""

from __future__ import annotations

import logging
from collections.abc import Mapping
from typing import Any

_log = logging.getLogger(__name__)

_SHAPING = ("kind", "network", "seed", "start", "augmentation", "infonce", "clip", "precision")


def check_same(now: Mapping[str, Any], then: Mapping[str, Any], phase: int) -> None:
    """Compare recipes as plain values; later phases, the validation data and the log may differ.

    Raises
    ------
    ValueError
        Something that shaped the run differs: it is named.
    """
    pairs = {name: (now.get(name), then.get(name, now.get(name))) for name in _SHAPING}
    pairs["data.train"] = (now["data"]["train"], then["data"]["train"])
    done = [[_shaping(each) for each in recipe["phase"][: phase + 1]] for recipe in (now, then)]
    pairs[f"phase[:{phase + 1}]"] = (done[0], done[1])
    different = [name for name, (a, b) in pairs.items() if a != b]
    if different:
        raise ValueError(
            f"the checkpoint comes from a recipe with another {', '.join(different)}; resume with its own recipe, "
            "or begin in another folder"
        )


def _shaping(phase: Mapping[str, Any]) -> dict[str, Any]:
    # Without what may differ between machines.
    return {name: value for name, value in phase.items() if name != "packed"}


def tell_changed_data(then: Mapping[str, str], now: Mapping[str, str]) -> None:
    """Log the sources whose pairs have changed since the checkpoint was written; their present content is used."""
    for title in sorted(name for name in now if then.get(name) and now[name] and then[name] != now[name]):
        _log.warning(
            "the data of %s has changed since the checkpoint; changed pairs are prepared again", title
        )
