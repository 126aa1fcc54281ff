# SPDX-License-Identifier: MIT
"""Scripts of `test_fork.py`, each run in a process of its own: what they guard against is a hang."""

from __future__ import annotations

import multiprocessing
import os
import sys
import tempfile
import threading
import time
from dataclasses import replace
from typing import Any

import numpy as np

import hybridreg as hr
from hybridreg import testing
from hybridreg.eval import predict
from hybridreg.pair import LabelledPair
from hybridreg.runtime.threads import one_thread

SECONDS = 60.0  # a child's; it takes 1 to 5


def found(preset: str) -> Any:
    """Pose that a preset finds for the sample pair."""
    pair, _ = testing.sample_pair(n_points=4_000)
    return hr.Pipeline.preset(preset).run(pair).transformation


def in_child(preset: str, expected: Any) -> None:
    """Fork, and see that the child finds the same."""
    child = multiprocessing.get_context("fork").Process(target=_same, args=(preset, expected))
    child.start()
    child.join(SECONDS)
    if child.is_alive():
        child.kill()
        sys.exit(f"{preset}: the forked process hangs")
    if child.exitcode != 0:
        sys.exit(f"{preset}: the forked process ended with {child.exitcode}")


def _same(preset: str, expected: Any) -> None:
    np.testing.assert_array_equal(found(preset), expected)


def after_register(preset: str) -> None:
    """The parent did what the child does."""
    in_child(preset, found(preset))


def after_others(preset: str) -> None:
    """The parent used the same libraries by itself, with the threads that they take by default."""
    import torch

    from hybridreg.runtime.open3d import load_open3d

    matrix = torch.rand(1_000, 1_000)
    for _ in range(3):
        matrix = torch.relu(matrix @ matrix).clamp(max=1.0)
    points = np.random.default_rng(0).uniform(size=(5_000, 3)) * 10.0
    _small_gicp(points)
    _kiss_matcher(points)
    o3d = load_open3d()
    cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points))
    cloud.estimate_normals()
    o3d.pipelines.registration.compute_fpfh_feature(cloud, o3d.geometry.KDTreeSearchParamHybrid(1.0, 50))
    before = torch.get_num_threads()
    in_child(preset, _of_spawned(preset))
    assert torch.get_num_threads() == before


def _small_gicp(points: Any) -> None:
    import small_gicp

    small_gicp.preprocess_points(points, downsampling_resolution=0.1, num_threads=2)


def _kiss_matcher(points: Any) -> None:
    import kiss_matcher

    matcher = kiss_matcher.KISSMatcher(kiss_matcher.KISSMatcherConfig(0.5))
    matcher.match(points[:2_000].T.copy(), points[:2_000].T.copy())


def _of_spawned(preset: str) -> Any:
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        return pool.apply_async(found, (preset,)).get(SECONDS)


def beside_a_thread(preset: str) -> None:
    """Another Python thread of the parent holds its libraries to one thread, for longer than the child lives."""
    import torch

    torch.set_num_threads(2)
    said = os.environ.get("MKL_NUM_THREADS")
    inside, over = threading.Event(), threading.Event()

    def hold() -> None:
        with one_thread():
            inside.set()
            over.wait()

    expected = found(preset)
    thread = threading.Thread(target=hold)
    thread.start()
    inside.wait()
    child = os.fork()
    if child == 0:
        given_back = torch.get_num_threads() == 2 and os.environ.get("MKL_NUM_THREADS") == said
        _same(preset, expected)
        os._exit(0 if given_back else 3)
    status = _waited(child)
    over.set()
    thread.join()
    if status != 0:
        sys.exit(f"{preset}: the process forked beside a thread ended with {status}")


def _waited(child: int) -> int | str:
    end = time.monotonic() + SECONDS
    while time.monotonic() < end:
        pid, status = os.waitpid(child, os.WNOHANG)
        if pid:
            return os.waitstatus_to_exitcode(status)
        time.sleep(0.05)
    os.kill(child, 9)
    os.waitpid(child, 0)
    return "a hang"


def in_a_loader(preset: str) -> None:
    """Workers of torch's DataLoader, which it forks."""
    from torch.utils.data import DataLoader

    expected = found(preset)
    loader = DataLoader([preset] * 2, batch_size=None, num_workers=1, collate_fn=found, timeout=SECONDS)
    for answer in loader:
        np.testing.assert_array_equal(answer, expected)


def on_loky(preset: str) -> None:
    """A table's workers after the parent ran the preset; then those of a process forked after that."""
    expected = found(preset)
    _table(preset, expected)
    child = multiprocessing.get_context("fork").Process(target=_table, args=(preset, expected))
    child.start()
    child.join(SECONDS)
    if child.exitcode != 0:
        child.kill()
        sys.exit(f"{preset}: a forked process with workers ended with {child.exitcode}")


def _table(preset: str, expected: Any) -> None:
    pair, truth = testing.sample_pair(n_points=4_000)
    pairs = [LabelledPair(pair=replace(pair, id=f"pair-{k}"), T_target_source=truth) for k in range(2)]
    with tempfile.TemporaryDirectory() as folder:
        rows = predict(hr.Pipeline.preset(preset), pairs, f"{folder}/rows.jsonl", workers=2)
    assert [row.error for row in rows] == [None] * 2
    for row in rows:
        np.testing.assert_allclose(row.T, expected, atol=0.2)  # another id, another seed


def on_dask(preset: str) -> None:
    """Processes of dask's, after the parent ran the preset."""
    from distributed import Client, LocalCluster

    expected = found(preset)
    with (
        LocalCluster(n_workers=2, threads_per_worker=2, processes=True, dashboard_address=None) as local,
        Client(local) as client,
    ):
        for future in client.map(found, [preset] * 4, pure=False):
            np.testing.assert_array_equal(future.result(timeout=SECONDS), expected)


if __name__ == "__main__":
    globals()[sys.argv[1]](sys.argv[2])
    print("done")
