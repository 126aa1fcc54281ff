# SPDX-License-Identifier: MIT
"""Full simulated pairs a second (scene, two scans, camera image, overlap) and what one costs.

python -m benchmarks.simulator_speed [--pairs 30] [--workers 1 2]

Each worker first generates a few pairs that do not count: importing and filling the pools of trees and cars happens
once, while a training run generates thousands. Pairs a second depend on what else the machine does, CPU seconds a pair
much less so; the load average is printed for that reason.
"""

from __future__ import annotations

import argparse
import os
import time

from joblib import Parallel, delayed

from hybridreg.data.simulate import draw, pair_number

MIX = ("near", "mid", "far")
WARM_UP = 12


def cost(index: int) -> float:
    """CPU seconds of one pair."""
    start = time.process_time()
    draw(MIX[index % len(MIX)], pair_number("train", 77, index))
    return time.process_time() - start


def warm_up(worker: int) -> int:
    """Fill a worker's pools; slow enough that no worker takes another one's share."""
    for index in range(WARM_UP):
        cost(1000 * (worker + 1) + index)
    return os.getpid()


def measure(workers: int, pairs: int) -> tuple[float, float]:
    """Pairs a second, and mean CPU seconds of a pair."""
    with Parallel(n_jobs=workers, backend="loky" if workers > 1 else "sequential", batch_size=1) as pool:
        ready = set(pool(delayed(warm_up)(k) for k in range(workers)))
        if len(ready) < workers:
            print(f"only {len(ready)} of {workers} workers were warm")
        start = time.perf_counter()
        costs = pool(delayed(cost)(index) for index in range(pairs))
        return pairs / (time.perf_counter() - start), sum(costs) / pairs


def main() -> None:
    """One line for each number of workers."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--pairs", type=int, default=30)
    parser.add_argument("--workers", type=int, nargs="+", default=[1, 2])
    options = parser.parse_args()
    print(f"{os.cpu_count()} cores, load average {os.getloadavg()[0]:.1f}")
    for workers in options.workers:
        rate, cpu = measure(workers, options.pairs)
        print(f"{workers} worker(s): {rate:.2f} pairs/s, {cpu:.3f} CPU s a pair")


if __name__ == "__main__":
    main()
