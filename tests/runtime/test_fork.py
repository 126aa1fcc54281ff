# SPDX-License-Identifier: MIT
"""A process forked from one that registered, or used the same libraries, registers as well."""

from __future__ import annotations

import importlib.util
import multiprocessing
import os
import subprocess
import sys
from pathlib import Path

import pytest

HERE = Path(__file__).resolve().parent
SECONDS = 100.0
_NEEDS = {
    "after_others": ("torch", "open3d", "kiss_matcher"),
    "on_dask": ("distributed",),
    "kiss-gicp": ("kiss_matcher",),
    "fpfh-ransac-gicp": ("open3d",),
    "cross3dreg": ("torch",),
}

pytestmark = pytest.mark.skipif(
    "fork" not in multiprocessing.get_all_start_methods(), reason="this system does not fork"
)


def run(script: str, preset: str) -> None:
    """A script of `forking.py`, with what it may need and the bound that it must keep."""
    for name in (*_NEEDS.get(script, ()), *_NEEDS.get(preset, ())):
        if importlib.util.find_spec(name) is None:
            pytest.skip(f"{name} is not installed")
    variables = {name: value for name, value in os.environ.items() if name != "OMP_NUM_THREADS"}
    done = subprocess.run(
        [sys.executable, str(HERE / "forking.py"), script, preset],
        cwd=HERE.parent,
        env={**variables, "PYTHONPATH": str(HERE.parent)},
        capture_output=True,
        text=True,
        timeout=SECONDS,
        check=False,
    )
    assert done.returncode == 0, done.stderr[-2_000:]
    assert done.stdout.endswith("done\n")


@pytest.mark.parametrize("preset", ["default", "kiss-gicp", "fpfh-ransac-gicp", "cross3dreg"])
def test_after_the_parent_registered(preset: str) -> None:
    run("after_register", preset)


@pytest.mark.parametrize("preset", ["default", "cross3dreg"])
def test_after_the_parent_used_the_libraries_itself(preset: str) -> None:
    run("after_others", preset)


@pytest.mark.parametrize("script", ["beside_a_thread", "in_a_loader", "on_loky", "on_dask"])
def test_in_other_processes_after_a_network(script: str) -> None:
    run(script, "cross3dreg")
