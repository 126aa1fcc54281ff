# SPDX-License-Identifier: MIT
"""The same rows whoever computes them: one process, two, or a cluster that loses a worker."""

from __future__ import annotations

import os
import signal
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import joblib
import numpy as np
import pytest
from eval_stubs import Logged, Moody, RowByRow, Scattered

from hybridreg.eval import predict
from hybridreg.runtime.threads import one_thread

N = 8


@pytest.fixture(scope="module")
def alone(tmp_path_factory: pytest.TempPathFactory) -> list[dict[str, Any]]:
    rows = predict(RowByRow(slip=0.1), Scattered(N), tmp_path_factory.mktemp("alone") / "p.jsonl", seed=3)
    return [row.timeless for row in rows]


def test_two_workers_give_the_same_rows(tmp_path: Path, alone: list[dict[str, Any]]) -> None:
    rows = predict(RowByRow(slip=0.1), Scattered(N), tmp_path / "p.jsonl", seed=3, workers=2)
    np.testing.assert_equal([row.timeless for row in rows], alone)


@pytest.mark.parametrize("workers", [0, 1.5, "2", True])
def test_what_is_no_number_of_processes_is_refused(tmp_path: Path, workers: Any) -> None:
    with pytest.raises(ValueError, match=f"workers={workers!r} must be 1 or more processes"):
        predict(RowByRow(slip=0.1), Scattered(N), tmp_path / "p.jsonl", workers=workers)


def test_rows_reach_the_disk_while_others_still_run(tmp_path: Path) -> None:
    path, seen = tmp_path / "p.jsonl", []
    method = Moody(moods=("right",), seconds=0.15)
    predict(
        method, Scattered(6), path, workers=2,
        on_row=lambda row: seen.append(len(path.read_text().splitlines()) - 1),
    )  # fmt: skip
    assert seen == [1, 2, 3, 4, 5, 6]


def test_a_pair_that_kills_its_process_is_a_failed_row(tmp_path: Path) -> None:
    method = Moody(moods=("right", "right", "die", "right"))
    rows = predict(method, Scattered(6), tmp_path / "p.jsonl", workers=2)
    assert [row.T is not None for row in rows] == [True, True, False, True, True, True]
    assert "process died" in str(rows[2].error)


def test_one_thread_holds_inside_and_gives_back_after(monkeypatch: pytest.MonkeyPatch) -> None:
    from threadpoolctl import threadpool_info

    monkeypatch.setenv("OMP_NUM_THREADS", "2")
    monkeypatch.delenv("MKL_NUM_THREADS", raising=False)
    before = [pool["num_threads"] for pool in threadpool_info()]
    with one_thread():
        assert {pool["num_threads"] for pool in threadpool_info()} == {1}
        assert os.environ["OMP_NUM_THREADS"] == os.environ["MKL_NUM_THREADS"] == "1"
    assert [pool["num_threads"] for pool in threadpool_info()] == before
    assert os.environ["OMP_NUM_THREADS"] == "2"
    assert "MKL_NUM_THREADS" not in os.environ


@pytest.fixture(scope="module")
def cluster() -> Iterator[Any]:
    distributed = pytest.importorskip("distributed")
    with (
        distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None
        ) as local,
        distributed.Client(local) as client,
    ):
        yield client


def test_a_dask_cluster_gives_the_same_rows(
    tmp_path: Path, alone: list[dict[str, Any]], cluster: Any
) -> None:
    with joblib.parallel_config(backend="dask", wait_for_workers_timeout=30):
        rows = predict(RowByRow(slip=0.1), Scattered(N), tmp_path / "p.jsonl", seed=3)
    np.testing.assert_equal([row.timeless for row in rows], alone)


@pytest.mark.parametrize(
    ("workers", "said", "at_once"), [(None, None, 2), (1, None, 1), (2, None, 2), (None, 1, 1), (2, 1, 2)]
)
def test_workers_hold_on_a_cluster(
    tmp_path: Path, cluster: Any, workers: int | None, said: int | None, at_once: int
) -> None:
    method = Logged(str(tmp_path / "log"))
    with joblib.parallel_config(backend="dask", wait_for_workers_timeout=30, n_jobs=said):
        predict(method, Scattered(6), tmp_path / "p.jsonl", workers=workers)
    assert method.at_once() == at_once


def test_both_workers_of_a_cluster_work_and_one_may_be_killed(tmp_path: Path, cluster: Any) -> None:
    log = tmp_path / "log"
    method = Moody(moods=("right", "raise"), seconds=0.3, log=str(log))
    expected = predict(Moody(moods=("right", "raise")), Scattered(N), tmp_path / "alone.jsonl")
    pids = set(cluster.run(os.getpid).values())
    victim = min(pids)

    def kill_half_way() -> None:
        while not log.exists() or len(log.read_text().splitlines()) < N // 2:
            time.sleep(0.02)
        os.kill(victim, signal.SIGKILL)

    killer = threading.Thread(target=kill_half_way)
    killer.start()
    with joblib.parallel_config(backend="dask", wait_for_workers_timeout=30):
        rows = predict(method, Scattered(N), tmp_path / "p.jsonl")
    killer.join()
    assert {int(line.split()[1]) for line in log.read_text().splitlines()} >= pids
    np.testing.assert_equal([row.timeless for row in rows], [row.timeless for row in expected])
