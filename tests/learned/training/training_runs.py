# SPDX-License-Identifier: MIT
"""Runs, pairs and recipes that the tests of training make and compare."""

from __future__ import annotations

import csv
import json
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import cv2
import numpy as np
import tomli_w
import torch

from hybridreg import testing
from hybridreg.learned.training import checkpoint
from hybridreg.learned.training.recipe import Recipe
from hybridreg.learned.training.training_run import RunOptions

ROOT = Path(__file__).resolve().parents[3]
WARM_UP = {"infonce": 1.0, "coarse": 0.0, "fine": 0.0, "mask": 0.0}
# What a clock decides.
TIMED = ("steps_per_s", "data_share")
MakeRecipe = Callable[..., Recipe]


class Run(NamedTuple):
    """A run that went to its end."""

    recipe: Recipe
    out: Path


def options(out: Path, cache: Path, **more: Any) -> RunOptions:
    """A run on the processor."""
    return RunOptions(out=out, cache=cache, accelerator="cpu", **more)


def write_pair(folder: Path, seed: int, n_points: int = 600) -> None:
    """A made pair with a camera image, as `PairFolder` reads it."""
    folder.mkdir(parents=True)
    pair, T = testing.sample_pair(seed, n_points)
    np.save(folder / "source.npy", pair.source.points)
    np.save(folder / "target.npy", pair.target.points)
    assert pair.image is not None
    cv2.imwrite(str(folder / "image.png"), pair.image)
    (folder / "meta.json").write_text(json.dumps({"T_target_source": T.tolist()}))


def write_recipe(path: Path, content: dict[str, Any]) -> Path:
    """A recipe as a file."""
    path.write_text(tomli_w.dumps(content), encoding="utf-8")
    return path


def environment() -> dict[str, str]:
    """For processes of their own: this checkout, one thread."""
    return {**os.environ, "PYTHONPATH": str(ROOT), "OMP_NUM_THREADS": "1", "CUDA_VISIBLE_DEVICES": ""}


def log(out: Path, name: str = "log.csv") -> list[dict[str, str]]:
    """Lines of a run's log without what a clock decides."""
    with (out / name).open(newline="") as file:
        return [{k: v for k, v in row.items() if k not in TIMED} for row in csv.DictReader(file)]


def state(out: Path) -> dict[str, torch.Tensor]:
    """The network in a run's checkpoint."""
    network: dict[str, torch.Tensor] = checkpoint.load(out / "checkpoint.pt")["network"]
    return network


def same(a: dict[str, torch.Tensor], b: dict[str, torch.Tensor]) -> bool:
    """Are all tensors equal, bit by bit?"""
    return a.keys() == b.keys() and all(torch.equal(a[name], b[name]) for name in a)
