# SPDX-License-Identifier: MIT
"""The learned stages owe a pipeline what all stages do."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

import hybridreg as hr
from hybridreg import registry, testing

ROOT = Path(__file__).resolve().parents[3]
STAGES = [
    hr.Omp(untrained=True),
    hr.Vgam(untrained=True),
    hr.GeoTransformer(untrained=True),
    hr.DenseFeatures(untrained=True),
    hr.Lgr(),
]


@pytest.mark.parametrize("check", testing.checks(), ids=lambda check: check.__name__)
@pytest.mark.parametrize("stage", STAGES, ids=lambda stage: type(stage).__name__)
def test_the_suite(stage: Any, check: testing.stages.Check) -> None:
    check(stage, testing.slot_of(stage))


@pytest.mark.parametrize("stage", STAGES, ids=lambda stage: type(stage).__name__)
def test_scikit_learn_clones_them(stage: Any) -> None:
    clone = pytest.importorskip("sklearn.base").clone
    assert clone(stage) == stage
    assert clone(stage) is not stage


def run(code: str) -> str:
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT, env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_naming_a_stage_loads_no_torch() -> None:
    built = "hr.Pipeline(overlap=hr.Omp(untrained=True), match=hr.Vgam(untrained=True), estimate='lgr')"
    run(f"import sys, hybridreg as hr; {built}; assert 'torch' not in sys.modules")


def test_they_run_where_open3d_is_absent() -> None:
    run(
        "import sys; sys.modules['open3d'] = None\n"
        "import hybridreg as hr, hybridreg.learned, hybridreg.testing as t\n"
        "pipe = hr.Pipeline(voxel=0.5, overlap=hr.Omp(untrained=True), match=hr.Vgam(untrained=True),\n"
        "                   estimate='lgr', refine='none')\n"
        "assert len(pipe.run(t.sample_pair(n_points=1000)[0]).matches)\n"
    )


def test_a_misfit_names_the_matchers_that_give_groups() -> None:
    with pytest.raises(ValueError, match=r"needs 'group'.*cofinet, fpfh, geotransformer, given, roitr, vgam"):
        hr.Pipeline(match=hr.DenseFeatures(untrained=True), estimate="lgr")


def test_all_are_registered_under_their_names() -> None:
    expected = ["overlap.omp", "match.vgam", "match.geotransformer", "match.dense", "estimate.lgr"]
    assert [registry.name_of(stage) for stage in STAGES] == expected
