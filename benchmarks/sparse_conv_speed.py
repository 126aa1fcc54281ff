# SPDX-License-Identifier: MIT
"""Forward pass of full FCGF compared with a lower bound: ``python -m benchmarks.sparse_conv_speed --points 6000
--threads 1``.

The lower bound is the time of large matrix products with the same multiply-adds on the same threads. They run before
and after every pass, so that a busy machine slows both: the ratio of processor times is the median over the repeats.
The pair is real where the data folder is there, cropped about the sensor; where the network's grid holds fewer voxels
than wanted, the clouds are enlarged until it does. Memory is the process's, so run one size a process.
"""

from __future__ import annotations

import argparse
import statistics
import time
from collections.abc import Callable

import torch

from benchmarks.forward import peak_gb, real_cloud, resident_gb
from hybridreg.learned.fcgf.batch import FcgfBatch, make_batch
from hybridreg.learned.fcgf.config import FcgfConfig, named_config
from hybridreg.learned.fcgf.network import FcgfNetwork
from hybridreg.learned.layers.sparse_conv import SparseConv
from hybridreg.learned.layers.voxels import quantise

_GROWTH = 1.05


def cloud_of(name: str, n_voxels: int, config: FcgfConfig) -> torch.Tensor:
    """The nearest part of a cloud, one point a voxel, with exactly this many voxels."""
    points = real_cloud(name)
    while len(rows := quantise(points, config.voxel)[0]) < n_voxels:
        points = points * _GROWTH
    inside = points[rows]
    return inside[inside[:, :2].norm(dim=1).argsort()[:n_voxels].sort().values]


def multiply_adds(network: FcgfNetwork, batch: FcgfBatch) -> int:
    """Of all sparse convolutions in a forward pass: one for each pair of connected voxels."""
    counted = []

    def count(layer: SparseConv, args: tuple, out: torch.Tensor) -> None:  # type: ignore[type-arg]
        products = len(out) if layer.size == 1 else args[1].n_pairs
        counted.append(products * layer.kernel.shape[-2] * layer.kernel.shape[-1])

    hooks = [m.register_forward_hook(count) for m in network.modules() if isinstance(m, SparseConv)]
    network(batch)
    for hook in hooks:
        hook.remove()
    return sum(counted)


def seconds(work: Callable[[], object]) -> tuple[float, float]:
    """Wall and processor seconds of one call."""
    start, used = time.perf_counter(), time.process_time()
    work()
    return time.perf_counter() - start, time.process_time() - used


@torch.no_grad()
def report(size: str, n_voxels: int, repeats: int) -> None:
    """Print one run."""
    config = named_config(size)
    clouds = [cloud_of(name, n_voxels, config).numpy() for name in ("target", "source")]
    network = FcgfNetwork(config).eval()
    batch = make_batch(*clouds, config)
    held = resident_gb()
    network(batch)
    print(f"forward's own peak {peak_gb() - held:.3f} GB, estimated {network.memory(batch) / 1e9:.3f} GB")
    total, floors = multiply_adds(network, batch), []
    a, b = torch.randn(2048, 1024), torch.randn(1024, 1024)
    products, fresh = max(1, round(total / (2048 * 1024 * 1024))), []
    calls: dict[str, Callable[[], object]] = {
        "forward, maps kept": lambda: network(batch),
        "forward, maps made": lambda: network(fresh.pop()),
        "quantisation and levels": lambda: make_batch(*clouds, config),
    }
    found: dict[str, list[tuple[float, float, float]]] = {name: [] for name in calls}
    scale = total / (products * 2048 * 1024 * 1024)
    for _ in range(repeats):
        for name, call in calls.items():
            fresh.append(make_batch(*clouds, config))
            before = seconds(lambda: [a @ b for _ in range(products)])
            wall, processor = seconds(call)
            after = seconds(lambda: [a @ b for _ in range(products)])
            floor = scale * (before[1] + after[1]) / 2
            found[name].append((processor / floor, wall, processor))
            floors.append(floor)
    voxels = [len(side.points) for side in (batch.source, batch.target)]
    rate = total / statistics.median(floors) / 1e9
    print(f"{voxels[0]} + {voxels[1]} voxels, {total / 1e9:.2f} G multiply-adds")
    print(f"{'floor':26s} {statistics.median(floors):.3f} s processor, {rate:.0f} G multiply-adds a second")
    for name, runs in found.items():
        ratio, wall, processor = (statistics.median(column) for column in zip(*runs, strict=True))
        print(f"{name:26s} {processor:.3f} s processor, {wall:.3f} s wall, {ratio:.2f}x the floor")


def main() -> None:
    """Read the arguments and print the report."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--size", default="fcgf-kitti")
    parser.add_argument("--points", type=int, default=6000, help="voxels of each cloud")
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--repeats", type=int, default=11)
    options = parser.parse_args()
    torch.set_num_threads(options.threads)
    report(options.size, options.points, options.repeats)


if __name__ == "__main__":
    main()
