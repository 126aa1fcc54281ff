# SPDX-License-Identifier: MIT
"""Arrays of a result, which no caller changes behind its verdict."""

from __future__ import annotations

from typing import Any

import numpy as np


def lock(holder: Any, *names: str) -> None:
    """Put read-only copies of some arrays in the place of these, in a frozen dataclass that has just been made."""
    for name in names:
        array = np.array(getattr(holder, name))
        array.setflags(write=False)
        object.__setattr__(holder, name, array)
