# SPDX-License-Identifier: MIT
"""Packages that only some stages need: what is missing, and how to get it on this Python."""

from __future__ import annotations

import importlib
import sys
import warnings
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from importlib.util import find_spec
from typing import Any

# Module to distribution, the extra of ours that brings it (empty: it always comes), and the last Python for which there
# are wheels of it (None: all that we support).
_DISTRIBUTIONS: dict[str, tuple[str, str, tuple[int, int] | None]] = {
    "cv2": ("opencv-python-headless", "image", None),
    "dask": ("dask", "cluster", None),
    "distributed": ("distributed", "cluster", None),
    "embreex": ("embreex", "embree", None),
    "kiss_icp": ("kiss-icp", "kiss", None),
    "kiss_matcher": ("kiss-matcher", "kiss", (3, 12)),
    "imagecodecs": ("imagecodecs", "pcd", None),
    "laspy": ("laspy", "las", None),
    "lightning_fabric": ("lightning-fabric", "train", None),
    "mcap": ("mcap", "ros", None),
    "mcap_protobuf": ("mcap-protobuf-support", "ros", None),
    "matplotlib": ("matplotlib", "report", None),
    "open3d": ("open3d", "open3d", None),
    "plotly": ("plotly", "report", None),
    "pye57": ("pye57", "e57", None),
    "pyarrow": ("pyarrow", "arrow", None),
    "rosbags": ("rosbags", "ros", None),
    "safetensors": ("safetensors", "learned", None),
    "sklearn": ("scikit-learn", "train", None),
    "small_gicp": ("small_gicp", "", None),
    "torch": ("torch", "learned", None),
    "trimesh": ("trimesh", "mesh", None),
    "vtkmodules": ("vtk", "vtk", None),
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
    """How to get the distribution of a module on this Python: by our extra that brings it, where one does."""
    top = module.partition(".")[0]
    name, extra, last = _DISTRIBUTIONS.get(top, (top, "", None))
    if last is not None and sys.version_info[:2] > last:
        here, until = (".".join(map(str, each)) for each in (sys.version_info[:2], last))
        return f"{name}, which has no wheel for Python {here}: use Python 3.10 to {until}"
    what = f"'hybridreg[{extra}]'" if extra else name
    return f"{name}: run `pip install {what}`"


@contextmanager
def told(purpose: str) -> Iterator[None]:
    """Within the block, a module that is not installed and that an extra of ours brings is told as `load` tells it."""
    try:
        yield
    except ModuleNotFoundError as error:
        if (error.name or "").partition(".")[0] not in _DISTRIBUTIONS:
            raise
        raise ImportError(f"{purpose} needs {cure(str(error.name))} ({error})") from error


@contextmanager
def left_out_unless_installed(what: str) -> Iterator[None]:
    """As `told`, but a warning: the block's work is left out, and what follows goes on."""
    try:
        with told(what):
            yield
    except ImportError as error:
        if not isinstance(error.__cause__, ModuleNotFoundError):
            raise
        warnings.warn(f"left out: {error}", UserWarning, stacklevel=3)


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
