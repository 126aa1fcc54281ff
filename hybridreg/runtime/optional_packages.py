# SPDX-License-Identifier: MIT
"""Packages that only some stages need: what is missing, and how to get it on this Python."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Iterator, Mapping
from importlib.util import find_spec
from typing import Any

# Module to distribution, and the last Python for which there are wheels of it (None: all that we support).
_DISTRIBUTIONS: dict[str, tuple[str, tuple[int, int] | None]] = {
    "kiss_matcher": ("kiss-matcher", (3, 12)),
    "kiss_icp": ("kiss-icp", None),
    "small_gicp": ("small_gicp", None),
    "open3d": ("open3d", None),
    "torch": ("torch", None),
}


def load(module: str, purpose: str) -> Any:
    """Import a module.

    Raises
    ------
    ImportError
        One sentence that says what needs it, and how to get it on this Python, or that there is no wheel for it.
    """
    try:
        return importlib.import_module(module)
    except ImportError as error:
        raise ImportError(f"{purpose} needs {cure(module)} ({error})") from error


def cure(module: str) -> str:
    """How to get the distribution of a module on this Python."""
    name, last = _DISTRIBUTIONS.get(module, (module, None))
    if last is not None and sys.version_info[:2] > last:
        here, until = (".".join(map(str, each)) for each in (sys.version_info[:2], last))
        return f"{name}, which has no wheel for Python {here}: use Python 3.10 to {until}"
    return f"{name}: run `pip install {name}`"


def left_out(method: Any) -> str:
    """Which entries of a method of several (`Candidates`) will be skipped for lack of a package; empty if none."""
    lacking = dict.fromkeys(
        module
        for stage in _stages(method)
        for entry in getattr(stage, "of", ())
        for module in _lacking(entry.values() if isinstance(entry, Mapping) else ())
    )
    return "; ".join(f"entries that need {cure(module)}" for module in lacking)


def _lacking(stages: Any) -> Iterator[str]:
    return (module for stage in stages for module in getattr(stage, "wheels", ()) if not _is_here(module))


def _is_here(module: str) -> bool:
    try:
        return find_spec(module) is not None
    except (ImportError, ValueError):
        return False


def _stages(method: Any) -> list[Any]:
    pipeline = getattr(method, "pipeline", method)  # of a control
    return [
        getattr(pipeline, slot, None) for slot in ("downsample", "overlap", "match", "estimate", "refine")
    ]
