# SPDX-License-Identifier: MIT
"""How many threads there are, who keeps to one, and who gets back what was his."""

from __future__ import annotations

import os
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
from threadpoolctl import threadpool_info

import hybridreg as hr
from hybridreg import testing
from hybridreg.runtime import cores, threads
from hybridreg.runtime.threads import one_thread, single


@pytest.mark.parametrize(
    ("said", "n"), [("3", 3), ("4,2", 4), ("9", 6), ("", 6), ("0", 6), ("all", 6), ("-2", 6), (None, 6)]
)
def test_threads_heed_the_variable_that_numpy_heeds_and_the_cores(
    monkeypatch: pytest.MonkeyPatch, said: str | None, n: int
) -> None:
    monkeypatch.setattr(cores, "cores", lambda: 6)
    if said is None:
        monkeypatch.delenv("OMP_NUM_THREADS", raising=False)
    else:
        monkeypatch.setenv("OMP_NUM_THREADS", said)
    assert cores.n_threads() == n


@pytest.mark.skipif(not hasattr(os, "sched_setaffinity"), reason="cores can be taken away on Linux only")
def test_a_pinned_process_has_one_core(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("OMP_NUM_THREADS", raising=False)
    with threads.on_one_core():
        assert cores.n_threads() == 1
    assert cores.cores() == len(os.sched_getaffinity(0))


@pytest.mark.parametrize(
    ("groups", "files", "n"),
    [
        ("0::/", {"cpu.max": "150000 100000"}, 1.5),
        ("0::/", {"cpu.max": "max 100000"}, np.inf),
        ("0::/a/b", {"a/cpu.max": "50000 100000", "a/b/cpu.max": "max 100000"}, 0.5),
        ("0::/of/the/host", {"cpu.max": "200000 100000"}, 2.0),
        ("3:cpu,cpuacct:/a", {"cpu,cpuacct/a/cpu.cfs_quota_us": "400000",
                              "cpu,cpuacct/a/cpu.cfs_period_us": "100000"}, 4.0),
        ("3:cpu:/", {"cpu/cpu.cfs_quota_us": "-1", "cpu/cpu.cfs_period_us": "100000"}, np.inf),
        ("3:memory:/", {"memory/cpu.max": "1 100000"}, np.inf),
        ("0::/", {"cpu.max": "a word"}, np.inf),
        ("", {}, np.inf),
    ],
)  # fmt: skip
def test_a_quota_counts_as_cores(tmp_path: Path, groups: str, files: dict[str, str], n: float) -> None:
    root = tmp_path / "cgroup"
    for name, text in files.items():
        (root / name).parent.mkdir(parents=True, exist_ok=True)
        (root / name).write_text(text + "\n")
    (tmp_path / "own").write_text(groups + "\n")
    assert cores.quota(tmp_path / "own", root) == n


def test_a_quota_below_one_core_leaves_one_thread(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cores, "_quota", lambda: 0.3)
    assert cores.cores() == 1


# Left out: KISS-Matcher's wheel brings a second kind of threads that nothing but the number of cores holds back.
@pytest.mark.parametrize("refine", ["icp", "gicp", "kiss-icp"])
def test_a_pair_of_a_table_keeps_to_one_core(refine: str) -> None:
    pair, _ = testing.sample_pair(n_points=4_000)
    pipeline = hr.Pipeline(match="none", estimate="identity", refine=refine, voxel=0.8)
    with one_thread():
        pipeline.trace(pair)  # what is imported on first use is no part of it
        cpu, wall = time.process_time(), time.perf_counter()
        pipeline.trace(pair)
        cpu, wall = time.process_time() - cpu, time.perf_counter() - wall
    assert cpu < 1.1 * wall + 0.05


def counted() -> list[int]:
    """Threads of all libraries, as this Python thread has them."""
    torch = sys.modules["torch"]
    return [torch.get_num_threads(), *(pool["num_threads"] for pool in threadpool_info())]


def test_one_thread_within_and_what_was_there_before_afterwards() -> None:
    torch = pytest.importorskip("torch")
    before = torch.get_num_threads()
    torch.set_num_threads(2)
    try:
        full = counted()
        with single():
            assert set(counted()) == {1}
            with single():
                assert set(counted()) == {1}
            assert set(counted()) == {1}
        assert counted() == full
        with pytest.raises(KeyError), single():
            raise KeyError
        assert counted() == full
    finally:
        torch.set_num_threads(before)


def test_threads_that_overlap_give_nothing_back_too_early_and_all_at_last() -> None:
    torch = pytest.importorskip("torch")
    before = torch.get_num_threads()
    torch.set_num_threads(2)
    os.environ.pop("MKL_NUM_THREADS", None)
    first_is_in, second_is_in, first_is_out = threading.Event(), threading.Event(), threading.Event()
    seen = []

    def first() -> None:
        torch.set_num_threads(2)  # a new thread begins with what OMP_NUM_THREADS says
        with one_thread():
            first_is_in.set()
            assert second_is_in.wait(10)
        seen.append(torch.get_num_threads())
        first_is_out.set()

    def second() -> None:
        assert first_is_in.wait(10)
        with one_thread():
            second_is_in.set()
            assert first_is_out.wait(10)
            seen.append(set(counted()))
            seen.append(os.environ.get("MKL_NUM_THREADS"))

    try:
        full = counted()
        with ThreadPoolExecutor(2) as pool:
            for done in [pool.submit(first), pool.submit(second)]:
                done.result()
        assert seen == [2, {1}, "1"]
        assert counted() == full
        assert "MKL_NUM_THREADS" not in os.environ
        with ThreadPoolExecutor(1) as pool:
            assert pool.submit(torch.get_num_threads).result() == 2
    finally:
        torch.set_num_threads(before)


def test_four_python_threads_find_what_one_finds() -> None:
    torch = pytest.importorskip("torch")
    pair, _ = testing.sample_pair(n_points=4_000)
    pipelines = [hr.Pipeline.preset(name) for name in ("birdseye-gicp", "cross3dreg")] * 2
    alone = [pipeline.run(pair).transformation for pipeline in pipelines]
    before = counted()
    with ThreadPoolExecutor(4) as pool:
        found = list(pool.map(lambda pipeline: pipeline.run(pair).transformation, pipelines))
    np.testing.assert_array_equal(found, alone)
    assert counted() == before
    assert torch.get_num_threads() == before[0]
