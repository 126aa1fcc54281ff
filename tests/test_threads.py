# SPDX-License-Identifier: MIT
from __future__ import annotations

import time

import pytest

import hybridreg as hr
from hybridreg import testing
from hybridreg.threads import one_thread
from hybridreg.resources import n_threads


@pytest.mark.parametrize(
    ("said", "n"), [("3", 3), ("4,2", 4), ("", -1), ("0", -1), ("all", -1), ("-2", -1), (None, -1)]
)
def test_trees_heed_the_variable_that_numpy_heeds(
    monkeypatch: pytest.MonkeyPatch, said: str | None, n: int
) -> None:
    if said is None:
        monkeypatch.delenv("OMP_NUM_THREADS", raising=False)
    else:
        monkeypatch.setenv("OMP_NUM_THREADS", said)
    assert n_threads() == n


# KISS-Matcher is left out: its wheel brings threads of its own that no variable holds back.
@pytest.mark.parametrize("refine", ["icp", "gicp"])
def test_a_pair_of_a_table_keeps_to_one_core(refine: str) -> None:
    pair, _ = testing.sample_pair(n_points=4_000)
    pipeline = hr.Pipeline(match="none", estimate="identity", refine=refine, voxel=0.8)
    with one_thread():
        pipeline.trace(pair)  # what is imported on first use is no part of it
        cpu, wall = time.process_time(), time.perf_counter()
        pipeline.trace(pair)
        cpu, wall = time.process_time() - cpu, time.perf_counter() - wall
    assert cpu < 1.1 * wall + 0.05
