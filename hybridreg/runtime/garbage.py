# SPDX-License-Identifier: MIT
"""How often Python's garbage collector looks for cycles."""

from __future__ import annotations

import atexit
import gc

# Objects made before the collector looks, and rounds before it looks among older ones: what is imported is no garbage,
# and looking takes a tenth of a short command's time.
_SELDOM = (100_000, 50, 100)
_USUAL = gc.get_threshold()


def collect_seldom() -> None:
    """For a command that does one thing and ends."""
    gc.set_threshold(*_SELDOM)
    atexit.register(gc.freeze)  # what goes with the process need not be searched at its end


def collect_as_usual() -> None:
    """For work that may go on for days, whose garbage holds much memory in few objects."""
    gc.set_threshold(*_USUAL)
