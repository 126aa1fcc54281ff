# SPDX-License-Identifier: MIT
"""Compares simulated clouds with real ones; prints the table of docs/simulator.md.

python -m tools.simulator_realism [--clouds 12] [--real ../shared/data/real]

Every figure is computed by the same code on the real clouds of one sensor model and on simulated clouds of that
model, at the height of the real mount, in the kinds of scene where the real ones were recorded.

Variation among real clouds: most models were recorded at only one or two places, so their minimum and maximum are
widened by the spread between places (standard deviation, pooled over the models recorded at three or
more; as a share of the mean for counts and distances). A simulated median inside that range counts as agreeing.
"""

from __future__ import annotations

import argparse
import itertools
import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

from hybridreg.data.simulate import SCENES, SENSORS
from hybridreg.data.simulate.drawn import world_with
from hybridreg.data.simulate.sensing.overlaps import thin
from hybridreg.data.simulate.sensing.scan import scan
from hybridreg.data.simulate.sensing.stands import single_stand
from hybridreg.data.simulate.world.carriers import Carrier
from hybridreg.data.simulate.world.mesh import EMPTY
from hybridreg.geometry import se3

RANGE_EDGES = (0, 5, 10, 20, 30, 50, 500)
ROOT = Path(__file__).resolve().parent.parent


@dataclass(frozen=True)
class Match:
    """Real clouds of one sensor, and the scenes and carrier that resemble their recording."""

    sensor: str
    files: tuple[str, ...]
    scenes: tuple[str, ...]
    height: float  # of the real sensor over the ground, metres
    places: int  # where the clouds were recorded
    forward: bool = False  # looks along the road: of eight headings the one that sees farthest


PANDARGT = tuple(
    f"pandaset-{name}/source" for name in ("001-gt-to-p64", "002-gt-to-p64", "002-gt60-to-p64-00")
)
MATCHES = (
    Match("hdl64e", ("kitti-city-20-to-0/source", "kitti-city-20-to-0/target", "kitti-odo-5-to-0/source",
                     "frames/kitti-object-000000/cloud", "frames/kitti-object-000001/cloud"),
          ("street", "street", "campus"), 1.73, 4),
    Match("pandar64", ("opencalib-hesai1-qt201-to-p64/target", "opencalib-road1-qt-left-to-p64/target",
                       "frames/opencalib-cam-1/cloud", "frames/opencalib-cam-3/cloud"),
          ("street", "street", "parking", "campus"), 2.35, 4),
    Match("pandar40", ("sustech-965-to-950/source", "sustech-965-to-950/target", "sustech-970-to-965/source",
                       "sustech-975-to-965/source"), ("street",), 2.3, 1),
    Match("vlp32c", ("av2-7fab-up-to-down/source", "av2-7fab-up-to-down/target", "rellis-vlp32-to-os64/source"),
          ("street", "street", "park"), 1.9, 2),
    Match("hdl32e", ("hdl32-small-gicp/source", "hdl32-small-gicp/target"), ("street", "campus"), 1.9, 1),
    Match("pandargt", PANDARGT, ("street", "street", "campus"), 1.86, 2, forward=True),
    # The sensor of the frozen tiers, which was made before any cloud of a real one was at hand.
    Match("raster", PANDARGT, ("street", "street", "campus"), 1.86, 2, forward=True),
    Match("os1-64", ("rellis-vlp32-to-os64/target",), ("park", "woods"), 1.55, 1),
)  # fmt: skip


def range_shares(points: np.ndarray) -> dict[str, float]:
    """Share of the points in each range bin; without the sensor's own carrier (under 2.5 m)."""
    distance = np.linalg.norm(points, axis=1)
    counts, _ = np.histogram(distance[distance > 2.5], RANGE_EDGES)
    labels = [f"{a}-{b} m" if b < 500 else f"over {a} m" for a, b in itertools.pairwise(RANGE_EDGES)]
    return {f"points at {k}": float(v) for k, v in zip(labels, counts / max(counts.sum(), 1), strict=True)}


def ground_share(points: np.ndarray) -> float:
    """Share of points within 0.3 m of the lowest of their 4 m cell, where that lies below the sensor."""
    cell = np.floor(points[:, :2] / 4).astype(np.int64)
    _, inverse = np.unique(cell, axis=0, return_inverse=True)
    inverse = inverse.ravel()
    order = np.lexsort((points[:, 2], inverse))
    first = np.searchsorted(inverse[order], np.arange(inverse.max() + 1))
    count = np.bincount(inverse)
    low = points[order[first + (count * 0.03).astype(int)], 2]
    return float(((points[:, 2] - low[inverse] < 0.3) & (low[inverse] < -0.4)).mean())


def shape_shares(points: np.ndarray, radius: float = 1.0) -> dict[str, float]:
    """Shares of planar, linear and scattered neighbourhoods (largest of the three eigenvalue features)."""
    rng = np.random.default_rng(0)
    centres = points[rng.permutation(len(points))[:2500]]
    wins = np.zeros(3)
    for neighbours in cKDTree(points).query_ball_point(centres, radius):
        if len(neighbours) < 6:
            continue
        values = np.sqrt(np.maximum(np.linalg.eigvalsh(np.cov(points[neighbours].T))[::-1], 0))
        features = [
            (values[1] - values[2]) / values[0],
            (values[0] - values[1]) / values[0],
            values[2] / values[0],
        ]
        wins[int(np.argmax(features))] += 1
    return dict(zip(("planar", "linear", "scattered"), wins / max(wins.sum(), 1), strict=True))


def figures(points: np.ndarray) -> dict[str, float]:
    """All figures of one cloud (n,3) in its sensor's frame."""
    points = points[np.linalg.norm(points, axis=1) > 2.5].astype(np.float64)
    grid = thin(points, 0.25)
    near = cKDTree(grid).query(grid, k=2)[0][:, 1]
    return {
        "points": float(len(points)),
        "points after 0.25 m grid": float(len(grid)),
        **range_shares(points),
        "nearest neighbour, median (m)": float(np.median(near)),
        "nearest neighbour, 90 % (m)": float(np.percentile(near, 90)),
        "ground": ground_share(points),
        **shape_shares(grid),
    }


def real_clouds(match: Match, root: Path) -> Iterator[np.ndarray]:
    """The real clouds of one sensor."""
    for name in match.files:
        yield np.load(root / f"{name}.npz")["xyz"]


def simulated_clouds(match: Match, n: int) -> Iterator[np.ndarray]:
    """`n` clouds of the same sensor in scenes of the same kinds."""
    for k in range(n):
        rng = np.random.default_rng([20, k])
        layout = SCENES[match.scenes[k % len(match.scenes)]](rng)
        # No body under the sensor: its points are left out of the figures, and real mounts clear their roofs.
        stand = single_stand(layout, rng, Carrier(EMPTY, match.height, 1.6))
        world, sensor = world_with(layout, stand), SENSORS[match.sensor]
        headings = range(0, 360, 45) if match.forward else (0,)
        clouds = [
            scan(world, layout.surface, sensor, stand.T_world_sensor @ se3.yaw(heading), rng)
            for heading in headings
        ]
        yield max(clouds, key=lambda cloud: float(np.median(np.linalg.norm(cloud, axis=1))))


Figures = list[dict[str, float]]


def is_share(key: str) -> bool:
    """Whether a figure is a share in [0,1] rather than a count or a distance."""
    return not (key.startswith("nearest") or key in ("points", "points after 0.25 m grid"))


def place_spread(measured: list[tuple[Match, Figures]]) -> dict[str, float]:
    """Standard deviation between places, pooled over the models recorded at three or more."""
    spread = {}
    for key in measured[0][1][0]:
        parts = []
        for match, rows in measured:
            values = np.array([row[key] for row in rows])
            if match.places >= 3:
                parts.append(values.std(ddof=1) / (1.0 if is_share(key) else values.mean()))
        spread[key] = float(np.sqrt(np.mean(np.square(parts))))
    return spread


def table(match: Match, real: Figures, simulated: Figures, spread: dict[str, float]) -> tuple[list[str], int]:
    """Rows of one sensor, and how many simulated medians agree."""
    rows = [
        f"\n### {match.sensor}: {len(real)} real clouds from {match.places} place(s), {len(simulated)} simulated\n",
        "| figure | real: least to most | widened | simulated: median (10 % to 90 %) | agrees |",
        "|---|---|---|---|---|",
    ]
    agreeing = 0
    for key in real[0]:
        a, b = np.array([f[key] for f in real]), np.array([f[key] for f in simulated])
        middle, low, high = np.median(b), *np.percentile(b, [10, 90])
        slack = spread[key] * (1.0 if is_share(key) else a.mean())
        least, most = max(a.min() - slack, 0.0), a.max() + slack
        good = least <= middle <= most
        agreeing += good
        d = 0 if a.mean() > 1 else 3
        rows.append(
            f"| {key} | {a.min():.{d}f} to {a.max():.{d}f} | {least:.{d}f} to {most:.{d}f} "
            f"| {middle:.{d}f} ({low:.{d}f} to {high:.{d}f}) | {'yes' if good else '**no**'} |"
        )
    return rows, agreeing


def main() -> None:
    """All sensors."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--clouds", type=int, default=12)
    data = Path(os.environ.get("HYBRIDREG_DATA", ROOT.parent / "shared" / "data"))
    parser.add_argument("--real", type=Path, default=data / "real")
    options = parser.parse_args()
    measured = [(match, [figures(cloud) for cloud in real_clouds(match, options.real)]) for match in MATCHES]
    spread = place_spread(measured)
    summary = ["\n| sensor | figures that agree |", "|---|---|"]
    for match, real in measured:
        simulated = [figures(cloud) for cloud in simulated_clouds(match, options.clouds)]
        rows, agreeing = table(match, real, simulated, spread)
        print("\n".join(rows), flush=True)
        summary.append(f"| {match.sensor} | {agreeing} of {len(real[0])} |")
    print("\n".join(summary))


if __name__ == "__main__":
    main()
