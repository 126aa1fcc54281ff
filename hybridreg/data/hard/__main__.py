# SPDX-License-Identifier: MIT
"""Show what the kinds contain: `python -m hybridreg.data.hard list --seeds 3`.

Overlap is the share of the source's points with a target point nearby at the (best) true pose: nearer than
twice the median distance between neighbours in the sparser cloud, or 0.6 of the tolerance.
"""

from __future__ import annotations

import argparse
import time

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from hybridreg.data.hard import KINDS, Sample, sample
from hybridreg.geometry import se3

Array = NDArray[np.float64]


def spacing(points: Array) -> float:
    """Median distance between a point and its third neighbour."""
    some = points[:: max(1, len(points) // 2000)]
    return float(np.median(cKDTree(points).query(some, k=4)[0][:, 3]))


def overlap(one: Sample) -> float:
    """Share of the source that lies on the target at the best true pose; nan where there is none."""
    near = 2.0 * max(spacing(one.source), spacing(one.target), 0.3 * one.metres)
    tree = cKDTree(one.target)
    shares = [float((tree.query(se3.apply(T, one.source))[0] < near).mean()) for T in one.truths]
    return max(shares, default=np.nan)


def extent(points: Array) -> float:
    """Radius around the median point, metres, within which nine tenths of the points lie."""
    return float(np.quantile(np.linalg.norm(points - np.median(points, axis=0), axis=1), 0.9))


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("action", choices=["list"])
    parser.add_argument("--seeds", type=int, default=3, help="seeds of each kind, from 0")
    parser.add_argument("--kinds", nargs="*", default=KINDS, choices=KINDS, metavar="KIND")
    options = parser.parse_args()
    print(f"{'name':18}{'points':>16}{'extent, m':>16}{'overlap':>9}  {'solvable':9}{'s':>5}  cure")
    for kind in options.kinds:
        for seed in range(options.seeds):
            start = time.perf_counter()
            one = sample(kind, seed)
            seconds = time.perf_counter() - start
            points = f"{len(one.source)}/{len(one.target)}"
            reach = f"{extent(one.source):.3g}/{extent(one.target):.3g}"
            right = f"{overlap(one):.2f}  {'yes' if one.solvable else 'no':9}"
            print(f"{one.name:18}{points:>16}{reach:>16}{right:>20}{seconds:5.1f}  {one.cure}", flush=True)


if __name__ == "__main__":
    main()
