# SPDX-License-Identifier: MIT
"""Time and memory of the preset `default` on increasingly large clouds, with its voxel grid and verdict separately.

A real pair is made denser by copies of its points with a little noise, so that the scene and the points after the grid
stay the same: what grows, grows with the points. Each size runs in a process of its own. Processor seconds
do not count what else the machine does; wall seconds do.

    python -m benchmarks.large --data ../shared/data/real --points 1000000 20000000
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import time
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.measuring.alternate import real_pairs
from hybridreg import Pipeline
from hybridreg.classical.voxel import VoxelGrid
from hybridreg.geometry import se3
from hybridreg.pair import Pair
from hybridreg.runtime.resources import peak_memory_mb, reset_peak_memory
from hybridreg.verdict import judge

Array = NDArray[np.float64]

_NOISE = 0.02  # metres, about a LiDAR's own


def denser(points: Array, n: int, seed: int) -> Array:
    """`n` points: sampled from the cloud, copies with a LiDAR's noise."""
    rng = np.random.default_rng(seed)
    if n <= len(points):
        return points[np.sort(rng.choice(len(points), n, replace=False))]
    copies = points[rng.integers(0, len(points), n - len(points))]
    return np.concatenate([points, copies + rng.normal(0.0, _NOISE, copies.shape)])


def timed(work: Callable[[], Any]) -> tuple[Any, float, float]:
    """The result of the work, its processor seconds and its wall seconds."""
    wall, processor = time.perf_counter(), time.process_time()
    made = work()
    return made, time.process_time() - processor, time.perf_counter() - wall


def measure(data: str, name: str, n: int) -> dict[str, Any]:
    """One size, in this process."""
    labelled = next(iter(real_pairs(data, [name])))
    clouds = [
        denser(cloud.points, n, k) for k, cloud in enumerate((labelled.pair.source, labelled.pair.target))
    ]
    Pipeline.preset("default").run(labelled.pair)  # imports are not measured
    pair, gate, gate_wall = timed(lambda: Pair.of(*clouds, id=name))
    scene, grid, grid_wall = timed(lambda: VoxelGrid()(pair))
    _, after, _ = timed(lambda: Pipeline.preset("default").run(scene.pair))
    reset_peak_memory()
    before = peak_memory_mb() or np.nan
    result, total, wall = timed(lambda: Pipeline.preset("default").run(pair))
    peak = peak_memory_mb() or np.nan
    trace = Pipeline(match="none", estimate="identity", refine="none").trace(pair)
    _, verdict, _ = timed(lambda: judge(trace.scene, trace.refined, trace.matches))
    truth = labelled.T_target_source
    return {
        "points": n,
        "left": len(trace.scene.source) + len(trace.scene.target),
        "gate": gate,
        "grid": grid,
        "entered": gate_wall + grid_wall,
        "verdict": verdict,
        "total": total,
        "wall": wall,
        "after": after,
        "before": before,
        "peak": peak,
        "word": result.verdict,
        "rre": se3.angle_deg(result.transformation[:3, :3].T @ truth[:3, :3]),
        "stages": dict(result.seconds),
    }


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--data", default="../shared/data/real")
    parser.add_argument("--pair", default="kitti-odo-5-to-0")
    parser.add_argument(
        "--points", type=int, nargs="*", default=[100_000, 300_000, 1_000_000, 5_000_000, 20_000_000]
    )
    parser.add_argument("--one", type=int, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.one:
        print(json.dumps(measure(options.data, options.pair, options.one)))
        return
    print("processor seconds, both clouds together; MB of the whole process")
    print(
        "after: of `default` on what the grid left; entry: wall seconds of gate and grid; wall: of `default`"
    )
    print(
        f"{'points a cloud':>14s} {'after grid':>10s} {'gate':>7s} {'grid':>7s} {'verdict':>8s} {'default':>8s} "
        f"{'after':>7s} {'entry':>7s} {'wall':>7s} {'before':>7s} {'peak':>6s}  verdict, error"
    )
    for n in options.points:
        command = [sys.executable, "-m", "benchmarks.large", "--data", options.data, "--pair", options.pair]
        done = subprocess.run([*command, "--one", str(n)], capture_output=True, text=True, check=True)
        m = json.loads(done.stdout.splitlines()[-1])
        print(
            f"{n:14d} {m['left']:10d} {m['gate']:7.2f} {m['grid']:7.2f} {m['verdict']:8.2f} {m['total']:8.2f} "
            f"{m['after']:7.2f} {m['entered']:7.2f} {m['wall']:7.2f} {m['before']:7.0f} {m['peak']:6.0f}  {m['word']}, "
            f"{m['rre']:.2f} deg",
            flush=True,
        )


if __name__ == "__main__":
    main()
