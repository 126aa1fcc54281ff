# SPDX-License-Identifier: MIT
"""Registrations by this checkout beside another's, in turn, each pair as two plain arrays.

    python -m benchmarks.builds --before ../an/older/checkout --data sim:val/disjoint#12
    python -m benchmarks.builds --before ../an/older/checkout --hard 211,213 --kinds depth-room tunnel mirrored

One process a checkout, which keeps its imports. A line a pair, then a line a build; a pair that either refuses is in
neither line.
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import subprocess
import sys
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hybridreg.data import hard, open_dataset
from hybridreg.data.hard import Sample
from hybridreg.geometry import se3

ROOT = Path(__file__).resolve().parents[1]
Array = NDArray[np.float64]

# Reads names of files, registers their clouds, and answers with seconds, verdict and pose.
_WORKER = """
import json, sys, time
import numpy as np
import hybridreg as hr
pipeline = hr.Pipeline.preset(sys.argv[1])
for line in sys.stdin:
    with np.load(line.strip()) as clouds:
        source, target = clouds["source"], clouds["target"]
    start = time.perf_counter()
    try:
        result = pipeline(source, target)
        told = [time.perf_counter() - start, result.verdict, result.transformation.tolist()]
    except ValueError as error:
        told = [time.perf_counter() - start, "refused", str(error)]
    print(json.dumps(told), flush=True)
"""


class Answer(NamedTuple):
    """Wall seconds, verdict and pose (4, 4) of one pair; no pose where it was refused."""

    seconds: float
    verdict: str
    T: Array | None

    def is_right(self, one: Sample) -> bool:
        """Whether the pose is right."""
        return self.T is not None and hard.is_right(one, self.T)


class Build:
    """A preset of a checkout, in a process of its own."""

    def __init__(self, checkout: Path, preset: str) -> None:
        environment = {**os.environ, "PYTHONPATH": str(checkout)}
        command = [sys.executable, "-W", "ignore", "-c", _WORKER, preset]
        self._process = subprocess.Popen(
            command, cwd=checkout, env=environment, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )

    def register(self, file: Path) -> Answer:
        """What it says of the clouds in one file."""
        seconds, verdict, pose = json.loads(self._ask(f"{file}\n"))
        return Answer(seconds, verdict, None if verdict == "refused" else np.array(pose))

    def _ask(self, line: str) -> str:
        to, back = self._process.stdin, self._process.stdout
        if to is None or back is None:
            raise RuntimeError("the worker has no pipes")
        to.write(line)
        to.flush()
        return back.readline()


def pairs(data: Sequence[str], seeds: Sequence[int], kinds: Sequence[str], yaws: int) -> Iterator[Sample]:
    """Pairs of data sets, each `yaws` times with its source turned about z, or as it is for 0; and hard kinds."""
    for name in data:
        dataset = open_dataset(name)
        for k in range(len(dataset)):
            try:
                one = dataset[k]
            except ValueError as error:  # a cloud of too few points
                print(f"{dataset.ids[k]}: left out: {error}", flush=True)
                continue
            given = Sample.of(one, name, hopeless="disjoint" in name)
            for yaw in np.random.default_rng(k).uniform(0.0, 360.0, yaws) if yaws else [0.0]:
                T = se3.yaw(float(yaw))
                yield replace(
                    given,
                    name=f"{given.name} {yaw:.0f}",
                    source=se3.apply(T, given.source),
                    truths=tuple(truth @ se3.inverse(T) for truth in given.truths),
                )
    yield from (hard.sample(kind, seed) for seed in seeds for kind in kinds)


def summary(rows: Sequence[tuple[Sample, dict[str, Answer]]]) -> str:
    """Markdown: a line a build, of the pairs that every build took."""
    taken = [row for row in rows if all(answer.T is not None for answer in row[1].values())]
    lines = [
        '| build | pairs | right | right and "ok" | right but "failed" | wrong but "ok" | median s | longest s |'
    ]
    lines += ["|---|---|---|---|---|---|---|---|"]
    for build in rows[0][1]:
        told = [(answers[build], answers[build].is_right(one)) for one, answers in taken]
        right = [answer.verdict for answer, well in told if well]
        wrong = [answer.verdict for answer, well in told if not well]
        seconds = [answer.seconds for answer, _ in told]
        lines.append(
            f"| {build} | {len(told)} | {len(right)} | {right.count('ok')} | {right.count('failed')} "
            f"| {wrong.count('ok')} | {statistics.median(seconds):.2f} | {max(seconds):.2f} |"
        )
    return "\n".join(lines)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--before", type=Path, required=True, help="another checkout")
    parser.add_argument("--data", nargs="*", default=[], help="data sets, as `hybridreg evaluate` takes them")
    parser.add_argument(
        "--hard", default="", metavar="SEEDS", help="seeds of hard kinds, with commas between"
    )
    parser.add_argument("--kinds", nargs="*", default=hard.KINDS, choices=hard.KINDS, metavar="KIND")
    parser.add_argument(
        "--yaws", type=int, default=0, help="random turns of each source about z; 0: as it is"
    )
    parser.add_argument("--preset", default="default")
    options = parser.parse_args()
    if not options.data and not options.hard:
        parser.error("nothing to measure: give --data or --hard")
    seeds = [int(seed) for seed in options.hard.split(",") if seed]
    builds = {
        name: Build(checkout, options.preset)
        for name, checkout in (("before", options.before.resolve()), ("now", ROOT))
    }
    rows: list[tuple[Sample, dict[str, Answer]]] = []
    with TemporaryDirectory() as folder:
        for k, one in enumerate(pairs(options.data, seeds, options.kinds, options.yaws)):
            file = Path(folder) / f"{k}.npz"
            np.savez(file, source=one.source, target=one.target)
            for build in () if rows else builds.values():  # imports and weights are not measured
                build.register(file)
            answers = {name: build.register(file) for name, build in builds.items()}
            file.unlink()
            rows.append((one, answers))
            told = (
                f"{name} {a.seconds:.2f} s {'right' if a.is_right(one) else 'wrong'} {a.verdict}"
                for name, a in answers.items()
            )
            print(f"{one.name:32s} {len(one.source):7d} {len(one.target):7d}  {', '.join(told)}", flush=True)
    print(summary(rows))


if __name__ == "__main__":
    main()
