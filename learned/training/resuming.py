# SPDX-License-Identifier: MIT
"""May a checkpoint go on under this recipe? What shaped the steps behind it must be the same."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

_SHAPING = ("kind", "network", "seed", "start", "augmentation", "infonce", "clip", "precision")


def check_same(now: Mapping[str, Any], then: Mapping[str, Any], phase: int) -> None:
    """Compare recipes as plain values; later phases, the validation data and the log may differ.

    Raises
    ------
    ValueError
        Something that shaped the run is another: it is named.
    """
    pairs = {name: (now.get(name), then.get(name, now.get(name))) for name in _SHAPING}
    pairs["data.train"] = (now["data"]["train"], then["data"]["train"])
    pairs[f"phase[:{phase + 1}]"] = (now["phase"][: phase + 1], then["phase"][: phase + 1])
    different = [name for name, (a, b) in pairs.items() if a != b]
    if different:
        raise ValueError(
            f"the checkpoint comes from a recipe with another {', '.join(different)}; resume with its own recipe, "
            "or begin in another folder"
        )
