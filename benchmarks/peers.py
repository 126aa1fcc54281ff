# SPDX-License-Identifier: MIT
"""Presets compared with other libraries with their documented defaults, on the same pairs in one run.

The other libraries are called as their documentation shows, without any of this library's code: KISS-Matcher then
small_gicp at 0.3 and 0.5 m, and Open3D's FPFH + RANSAC then small_gicp at 0.5 m. `--others` adds ouster-sdk's
`align_clouds`, which is no dependency of ours: `pip install --no-deps ouster-sdk==1.0.1`. Two more were tried and left
out: simpleicp 2.0.15, which is a local method and does not run with pandas 3 (`findings/`), and clireg 1.0.4, whose
command calls a function that it lacks and whose solver refuses a LiDAR pair with its own defaults, as too few matches
pass.

    python -m benchmarks.peers --data ../shared/data/real --starts 3
"""

from __future__ import annotations

import argparse
import dataclasses
import json
import time
import zlib
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import hybridreg as hr
from hybridreg.data import open_dataset, yaw_starts
from hybridreg.geometry import se3
from hybridreg.pair import LabelledPair
from hybridreg.runtime.open3d import load_open3d

Array = NDArray[np.float64]
Method = Callable[[LabelledPair], Array]


def kiss_then_gicp(voxel: float) -> Method:
    """KISS-Matcher with its defaults at one voxel size, refined by small_gicp with its defaults."""

    def run(labelled: LabelledPair) -> Array:
        import kiss_matcher
        import small_gicp

        source, target = labelled.pair.source.points, labelled.pair.target.points
        matcher = kiss_matcher.KISSMatcher(kiss_matcher.KISSMatcherConfig(voxel))
        solution = matcher.estimate(source.astype(np.float32), target.astype(np.float32))
        T = se3.from_rt(np.asarray(solution.rotation), np.ravel(solution.translation))
        return np.asarray(small_gicp.align(target, source, T, num_threads=2).T_target_source)

    return run


def open3d_then_gicp(voxel: float) -> Method:
    """Open3D's global registration example, refined by small_gicp with its defaults."""

    def run(labelled: LabelledPair) -> Array:
        import small_gicp

        o3d = load_open3d()
        reg = o3d.pipelines.registration
        clouds, features = [], []
        for cloud in (labelled.pair.source, labelled.pair.target):
            down = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(cloud.points.copy())).voxel_down_sample(
                voxel
            )
            down.estimate_normals(o3d.geometry.KDTreeSearchParamHybrid(2 * voxel, 30))
            clouds.append(down)
            features.append(
                reg.compute_fpfh_feature(down, o3d.geometry.KDTreeSearchParamHybrid(5 * voxel, 100))
            )
        o3d.utility.random.seed(zlib.crc32(labelled.pair.id.encode()) % 2**31)
        found = reg.registration_ransac_based_on_feature_matching(
            *clouds,
            *features,
            mutual_filter=True,
            max_correspondence_distance=1.5 * voxel,
            estimation_method=reg.TransformationEstimationPointToPoint(False),
            ransac_n=3,
            checkers=[
                reg.CorrespondenceCheckerBasedOnEdgeLength(0.9),
                reg.CorrespondenceCheckerBasedOnDistance(1.5 * voxel),
            ],
            criteria=reg.RANSACConvergenceCriteria(100_000, 0.999),
        )
        init = np.asarray(found.transformation)
        source, target = labelled.pair.source.points, labelled.pair.target.points
        return np.asarray(small_gicp.align(target, source, init, num_threads=2).T_target_source)

    return run


def ouster_align() -> Method:
    """ouster-sdk's global alignment, clouds as they are: all that it asks for is that z points up."""

    def run(labelled: LabelledPair) -> Array:
        from ouster.sdk.algorithm import align_clouds

        source, target = (
            np.ascontiguousarray(c.points) for c in (labelled.pair.source, labelled.pair.target)
        )
        return np.asarray(align_clouds(source, target))

    return run


def preset(name: str) -> Method:
    """One of this library's presets; its verdict is part of the time."""
    pipeline = hr.Pipeline.preset(name)
    return lambda labelled: pipeline.run(labelled.pair).transformation


PEERS: dict[str, Callable[[], Method]] = {
    "kiss-matcher 0.3 + small_gicp": lambda: kiss_then_gicp(0.3),
    "kiss-matcher 0.5 + small_gicp": lambda: kiss_then_gicp(0.5),
    "open3d fpfh-ransac 0.5 + small_gicp": lambda: open3d_then_gicp(0.5),
}
OTHERS: dict[str, Callable[[], Method]] = {"ouster-sdk align_clouds": ouster_align}


@dataclasses.dataclass(frozen=True)
class Outcome:
    """One method on one pair."""

    method: str
    pair: str
    rre_deg: float
    rte_m: float
    seconds: float

    @property
    def success(self) -> bool:
        return self.rre_deg < 2.0 and self.rte_m < 0.5


def read(rows: Path | None) -> list[Outcome]:
    """The results of an earlier run; empty where there are none."""
    if rows is None or not rows.exists():
        return []
    return [Outcome(**json.loads(line)) for line in rows.read_text().splitlines()]


def race(
    pairs: Iterable[LabelledPair], methods: dict[str, Method], done: Iterable[Outcome] = ()
) -> Iterator[Outcome]:
    """Run every method on a pair before the next pair, so that a slow minute of the machine affects all alike."""
    known = {(outcome.method, outcome.pair) for outcome in done}
    for labelled in pairs:
        for name, method in methods.items():
            if (name, labelled.pair.id) in known:
                continue
            start = time.perf_counter()
            T = method(labelled)
            seconds = time.perf_counter() - start
            truth = labelled.T_target_source
            yield Outcome(
                name,
                labelled.pair.id,
                se3.angle_deg(truth[:3, :3].T @ T[:3, :3]),
                float(np.linalg.norm(T[:3, 3] - truth[:3, 3])),
                seconds,
            )


def summary(outcomes: list[Outcome], against: str) -> str:
    """Markdown table: recall at 2 deg and 0.5 m, median seconds; on the pairs that the peer `against` solves, the
    median ratio of time to this peer's, and the ratio of the 90th percentiles."""
    methods = list(dict.fromkeys(o.method for o in outcomes))
    seconds = {m: np.array([o.seconds for o in outcomes if o.method == m]) for m in methods}
    comparable = np.array([o.success for o in outcomes if o.method == against])
    lines = [
        f"| method | recall | solved | median s | time / {against} | 90 % / its 90 % |",
        "|---|---|---|---|---|---|",
    ]
    slow = np.quantile(seconds[against][comparable], 0.9)
    for m in methods:
        solved = [o.success for o in outcomes if o.method == m]
        ratio = np.median((seconds[m] / seconds[against])[comparable])
        tail = np.quantile(seconds[m][comparable], 0.9) / slow
        lines.append(
            f"| {m} | {np.mean(solved):.3f} | {sum(solved)}/{len(solved)} | {np.median(seconds[m]):.2f} "
            f"| {ratio:.2f} | {tail:.2f} |"
        )
    return "\n".join(lines)


def report(outcomes: list[Outcome], data: str, starts: int) -> str:
    """The summary with a caption that says what was run."""
    n = len({o.pair for o in outcomes})
    caption = (
        f"{n} runs: the pairs in `{data}` as they are and under {starts} random yaw rotations. "
        "Success is 2 deg and 0.5 m; seconds are medians of one run on one machine, the ratio one over the pairs that "
        "the peer solves too."
    )
    return f"{caption}\n\n{summary(outcomes, 'kiss-matcher 0.5 + small_gicp')}\n"


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--data", default="../shared/data/real")
    parser.add_argument(
        "--starts", type=int, default=3, help="random yaw rotations in addition to the pair as it is"
    )
    parser.add_argument("--presets", nargs="*", default=["default", "fpfh-ransac-gicp"])
    parser.add_argument("--others", action="store_true", help="also those that are no dependency of ours")
    parser.add_argument("--rows", type=Path, help="one JSON line for each method and pair; resumes from it")
    parser.add_argument("--table", type=Path, help="write the summary as Markdown")
    options = parser.parse_args()
    peers = PEERS | (OTHERS if options.others else {})
    methods = {name: make() for name, make in peers.items()} | {
        name: preset(name) for name in options.presets
    }
    outcomes = read(options.rows)
    for outcome in race(yaw_starts(open_dataset(options.data), options.starts), methods, outcomes):
        outcomes.append(outcome)
        print(outcome, flush=True)
        if options.rows:
            with options.rows.open("a") as rows:
                rows.write(json.dumps(dataclasses.asdict(outcome)) + "\n")
    text = report(outcomes, options.data, options.starts)
    print(f"\n{text}")
    if options.table:
        options.table.write_text(text)


if __name__ == "__main__":
    main()
