# SPDX-License-Identifier: MIT
"""Time and memory of one forward pass by part: ``python -m benchmarks.forward --size full --points 6000``.

The pair is real where the data folder is there: the two clouds are cropped about the sensor until a 0.25 m
grid holds the wanted number of points. Seconds are the median of the repeats, wall and processor; the
multiply-adds
are counted from the tensors' shapes, and the lower bound is their time at the speed of one large matrix product on the
same threads, measured in the same run. Peak memory is the process's, so run one size a process.
"""

from __future__ import annotations

import argparse
import os
import resource
import statistics
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import torch

from benchmarks.measuring.multiply_adds import count_multiply_adds
from hybridreg.learned.cross3dreg.batch import Batch, make_batch
from hybridreg.learned.cross3dreg.config import NetworkConfig
from hybridreg.learned.cross3dreg.network import RegistrationNetwork
from hybridreg.learned.cross3dreg.sizes import named_config
from hybridreg.learned.matching.local_to_global import local_to_global
from hybridreg.learned.memory_estimate import forward_bytes
from hybridreg.learned.pyramid.grid_subsample import grid_subsample

ROOT = Path(__file__).resolve().parents[1]


def real_cloud(name: str) -> torch.Tensor:
    """One cloud (N, 3) of the real pair, or of a synthetic street where the data is absent."""
    places = [
        Path(os.environ.get("HYBRIDREG_DATA", "")),
        ROOT / "../shared/data/real",
        ROOT / "../../shared/data/real",
    ]
    for place in places:
        file = place / "hdl32-small-gicp" / f"{name}.npz"
        if file.is_file():
            return torch.from_numpy(np.load(file)["xyz"].astype(np.float32))
    rng = np.random.default_rng(len(name))
    xyz = rng.uniform(-60, 60, (200_000, 3)) * [1, 1, 0.02]
    return torch.from_numpy(xyz.astype(np.float32))


def crop(cloud: torch.Tensor, n_points: int, voxel: float) -> np.ndarray:
    """The nearest part of the cloud whose grid holds ``n_points``."""
    grid = grid_subsample(cloud, voxel)
    nearest = grid[:, :2].norm(dim=1).argsort()[:n_points]
    return grid[nearest].numpy()


def timed(work: Callable[[], object], repeats: int) -> tuple[float, float]:
    """Median wall and processor seconds."""
    wall, processor = [], []
    for _ in range(repeats):
        start, used = time.perf_counter(), time.process_time()
        work()
        wall.append(time.perf_counter() - start)
        processor.append(time.process_time() - used)
    return statistics.median(wall), statistics.median(processor)


def peak_gb() -> float:
    """Largest resident memory of this process so far, GB."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6


def resident_gb() -> float:
    """Memory of this process now, GB (Linux)."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * resource.getpagesize() / 1e9


def matrix_rate() -> float:
    """Multiply-adds a second of one large matrix product."""
    a = torch.randn(2048, 1024)
    b = torch.randn(1024, 1024)
    return 2048 * 1024 * 1024 / min(timed(lambda: a @ b, 1)[0] for _ in range(7))


@torch.no_grad()
def parts(network: RegistrationNetwork, batch: Batch) -> dict[str, Callable[[], object]]:
    """The parts of a forward pass, each ready to be called."""
    encoding = network.encode(batch)
    overlap = network.predict_overlap(encoding)
    kept = network.keep(encoding, overlap)
    features = network.attend(encoding, kept)
    superpoints = network.match_superpoints(encoding, kept, features)
    matches = network.match_points(encoding, superpoints)
    calls: dict[str, Callable[[], object]] = {
        "backbone": lambda: network.backbone(batch.features, batch.pyramid),
        "encode (backbone, image, patches)": lambda: network.encode(batch),
        "attention": lambda: network.attend(encoding, kept),
        "superpoint matching": lambda: network.match_superpoints(encoding, kept, features),
        "point matching (Sinkhorn)": lambda: network.match_points(encoding, superpoints),
        "forward": lambda: network(batch),
    }
    if len(matches):
        calls["LGR"] = lambda: local_to_global(
            matches.target, matches.source, matches.weight, matches.group, network.config.lgr
        )
    return calls


def report(config: NetworkConfig, n_points: int, repeats: int) -> None:
    """Print one run."""
    clouds = [crop(real_cloud(name), n_points, config.backbone.voxel) for name in ("target", "source")]
    before = peak_gb()
    start = time.perf_counter()
    batch = make_batch(*clouds, config, subsample=False)
    print(f"pyramid {time.perf_counter() - start:.2f} s, stages {[sum(n) for n in batch.pyramid.lengths]}")
    torch.manual_seed(0)
    network = RegistrationNetwork(config).eval()
    held = resident_gb()
    with torch.no_grad():
        network(batch)
        estimate = forward_bytes(batch.pyramid, config) / 1e9
        print(f"forward's own peak {peak_gb() - held:.3f} GB, estimated {estimate:.3f} GB")
        print(f"peak memory {peak_gb():.2f} GB ({before:.2f} GB before pyramid and network)")
        rate = matrix_rate()
        for name, call in parts(network, batch).items():
            wall, processor = timed(call, repeats)
            print(f"{name:36s} {wall:6.3f} s wall  {processor:6.3f} s processor")
    counted = count_multiply_adds(network, batch)
    for name, number in counted.items():
        print(f"{name:36s} {number / 1e9:6.2f} G multiply-adds  floor {number / rate:6.3f} s")
    total = sum(counted.values())
    print(
        f"{'all':36s} {total / 1e9:6.2f} G multiply-adds  floor {total / rate:6.3f} s at {rate / 1e9:.0f} G/s"
    )


def main() -> None:
    """Read the arguments and print the report."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--size", default="full")
    parser.add_argument("--points", type=int, default=6000, help="of each cloud on the first grid")
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--cross3dreg", action="store_true", help="with OMP and VGAM")
    options = parser.parse_args()
    torch.set_num_threads(options.threads)
    config = named_config(options.size, omp=options.cross3dreg, vgam=options.cross3dreg)
    report(config, options.points, options.repeats)


if __name__ == "__main__":
    main()
