# SPDX-License-Identifier: MIT
"""RoITr's position codes, fused compared with unfused as published: ``python -m benchmarks.roitr_codes``.

Both are timed alternately on the same level, layer by layer of the published network, with the same weights. The floor
is the time of the multiply-adds at the speed of one large matrix product, measured in the same run. The pair is real
where the data folder is there.
"""

from __future__ import annotations

import argparse
import statistics
import time

import numpy as np
import torch
from torch import Tensor

from benchmarks.forward import crop, matrix_rate, real_cloud
from hybridreg.learned.roitr.batch import make_batch
from hybridreg.learned.roitr.config import RoitrConfig, named_config
from hybridreg.learned.roitr.encoder_decoder import LevelFeatures
from hybridreg.learned.roitr.local_attention import LocalAttention, LocalBlock
from hybridreg.learned.roitr.network import RoitrNetwork


def multiply_adds(points: int, neighbors: int, dim: int, heads: int, *, fused: bool) -> tuple[float, float]:
    """Of one attention layer's position codes, and of the rest of it."""
    pairs = points * neighbors
    rest = points * dim * dim * 6 + pairs * dim * 2
    if not fused:
        return pairs * (4 * dim + 2 * dim * dim + 2 * dim), rest
    # Both products of the two maps, queries down to 4 numbers a head, scores, weighted sums, and up again.
    return 2 * 4 * dim * dim + points * dim * 4 * 2 + pairs * heads * 4 * 2, rest


@torch.inference_mode()
def alternate(
    block: LocalBlock, features: Tensor, rows: Tensor, ppf: Tensor, repeats: int
) -> tuple[float, float, float]:
    """Median seconds of the block with and without fused codes, alternately, and the largest relative difference."""
    seconds: dict[bool, list[float]] = {True: [], False: []}
    results: dict[bool, Tensor] = {}
    for _ in range(repeats + 1):
        for fused in (True, False):
            block.attention.fused = fused
            start = time.perf_counter()
            results[fused] = block(features, rows, ppf)
            seconds[fused].append(time.perf_counter() - start)
    block.attention.fused = True
    apart = (results[True] - results[False]).abs().max() / results[False].abs().max()
    return statistics.median(seconds[True][1:]), statistics.median(seconds[False][1:]), float(apart)


@torch.inference_mode()
def whole(network: RoitrNetwork, batch: object, repeats: int) -> dict[bool, float]:
    """Median seconds of encoding a pair, fused and unfused, alternately."""
    seconds: dict[bool, list[float]] = {True: [], False: []}
    layers = [module for module in network.modules() if isinstance(module, LocalAttention)]
    for _ in range(repeats + 1):
        for fused in (True, False):
            for layer in layers:
                layer.fused = fused
            start = time.perf_counter()
            network.encode(batch)  # type: ignore[arg-type]
            seconds[fused].append(time.perf_counter() - start)
    return {fused: statistics.median(times[1:]) for fused, times in seconds.items()}


def report(config: RoitrConfig, points: int, repeats: int) -> None:
    """Print one run."""
    voxel = 0.25
    clouds = [crop(real_cloud(name), points, voxel) for name in ("target", "source")]
    batch = make_batch(*(cloud.astype(np.float64) * (config.voxel / voxel) for cloud in clouds), config)
    torch.manual_seed(0)
    network = RoitrNetwork(config).eval()
    rate = matrix_rate()
    ppf = LevelFeatures.of(batch.source)
    print("level  points  width     fused  code by code  ratio  codes' share  before    floor    apart")
    for level, encoder in enumerate(network.backbone.encoder):
        rows, dim = batch.source.neighbors[level], config.widths[level]
        features = torch.randn(len(rows), dim)
        fast, slow, apart = alternate(encoder.blocks[0], features, rows, ppf.within[level], repeats)  # type:
        shape = (*rows.shape, config.inner[level], config.heads)
        (new, rest), (old, _) = (multiply_adds(*shape, fused=fused) for fused in (True, False))
        shares = f"{new / (new + rest):13.0%} {old / (old + rest):7.0%}"
        print(
            f"{level + 1:5d} {len(rows):7d} {dim:6d} {fast * 1e3:6.1f} ms {slow * 1e3:10.1f} ms {fast / slow:6.2f}"
            f" {shares} {(new + rest) / rate * 1e3:5.1f} ms {apart:8.0e}"
        )
    seconds = whole(network, batch, max(1, repeats // 3))
    print(
        f"encoding the pair: {seconds[True]:.2f} s fused, {seconds[False]:.2f} s code by code, "
        f"ratio {seconds[True] / seconds[False]:.2f}; {rate / 1e9:.0f} G multiply-adds a second"
    )


def main() -> None:
    """Read the arguments and print the report."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--size", default="roitr-3dmatch")
    parser.add_argument("--points", type=int, default=6000, help="of each cloud")
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--repeats", type=int, default=9)
    options = parser.parse_args()
    torch.set_num_threads(options.threads)
    report(named_config(options.size), options.points, options.repeats)


if __name__ == "__main__":
    main()
