# SPDX-License-Identifier: MIT
"""Seconds of a registration on a busy machine, compared with its fair share, and with another checkout's.

Each preset runs alone, beside one and three busy processes, on one core that it shares with one of them, and four
times at once beside one. The busy processes measure what an always-running thread gets of a core in the same seconds,
whoever else uses the machine; for a preset that runs alone, this process measures it just before and after. A
registration that gets as much takes its work divided by that: the fair share. Its work is the least processor time
that any build took alone. The builds alternate, in processes that have warmed up.

    python -m benchmarks.contention --data ../shared/data/real --before ../an/older/checkout

The status is 1 where this checkout takes more than `--limit` times the fair share. Linux only.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[1]

REGISTER = """
import sys, time
from hybridreg import Pipeline
from hybridreg.data import open_dataset
preset, data, name = sys.argv[1:]
pair = next(one.pair for one in open_dataset(data) if one.pair.id == name)
pipeline = Pipeline.preset(preset)
pipeline.run(pair)
print("warm", flush=True)
for _ in sys.stdin:
    wall, processor = time.perf_counter(), time.process_time()
    pipeline.run(pair)
    print(time.perf_counter() - wall, time.process_time() - processor, flush=True)
"""


class Situation(NamedTuple):
    """Simultaneous registrations, busy processes beside them, and whether all share one core."""

    name: str
    at_once: int = 1
    neighbours: int = 0
    one_core: bool = False


SITUATIONS = (
    Situation("alone"),
    Situation("one neighbour", neighbours=1),
    Situation("three neighbours", neighbours=3),
    Situation("one core, one neighbour", neighbours=1, one_core=True),
    Situation("four at once, one neighbour", at_once=4, neighbours=1),
)


@dataclass
class Took:
    """Result of a build: wall and processor seconds of each round's slowest registration, and the busy processes'
    share of a core in that time."""

    wall: list[float]
    processor: list[float]
    share: list[float]


@contextmanager
def process(command: Sequence[str], folder: Path, one_core: bool) -> Iterator[subprocess.Popen[str]]:
    """A child process with modules from `folder`, ended with the block."""
    variables = {name: value for name, value in os.environ.items() if not name.endswith("_NUM_THREADS")}
    pin: Callable[[], None] | None = (
        (lambda: os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})) if one_core else None
    )
    child = subprocess.Popen(
        command,
        cwd=folder,
        env={**variables, "PYTHONPATH": str(folder)},
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        preexec_fn=pin,
    )
    try:
        yield child
    finally:
        child.kill()
        child.wait()


def measure(
    situation: Situation, task: Sequence[str], builds: dict[str, Path], rounds: int
) -> dict[str, Took]:
    """Both builds alternately, with busy processes only while one of them runs."""
    took = {name: Took([], [], []) for name in builds}
    with ExitStack() as stack:
        warm = {
            name: [
                stack.enter_context(
                    process([sys.executable, "-c", REGISTER, *task], folder, situation.one_core)
                )
                for _ in range(situation.at_once)
            ]
            for name, folder in builds.items()
        }
        for children in warm.values():
            for child in children:
                if told(child) != "warm":
                    raise SystemExit(f"{task[0]}: a process ended before it was warm")
        for _ in range(rounds):
            for name, children in warm.items():
                one_round(situation, children, took[name])
    return took


def one_round(situation: Situation, children: Sequence[subprocess.Popen[str]], took: Took) -> None:
    """Let the children register once, all at the same time."""
    busy = [sys.executable, "-c", "while True: pass"]
    with ExitStack() as stack:
        neighbours = [
            stack.enter_context(process(busy, ROOT, situation.one_core)) for _ in range(situation.neighbours)
        ]
        time.sleep(0.5)  # let them start, and threads that still spin after the last round stop
        ours = [] if neighbours else [own_share()]
        began, spent = time.perf_counter(), on_core(neighbours)
        for child in children:
            assert child.stdin is not None
            child.stdin.write("go\n")
            child.stdin.flush()
        answers = [tuple(map(float, told(child).split())) for child in children]
        seconds, spent = time.perf_counter() - began, on_core(neighbours) - spent
    took.wall.append(max(wall for wall, _ in answers))
    took.processor.append(max(processor for _, processor in answers))
    if not neighbours:
        ours.append(own_share())
    took.share.append(spent / seconds / len(neighbours) if neighbours else sum(ours) / len(ours))


def own_share(seconds: float = 0.5) -> float:
    """The share of a core that an always-running thread of this process gets while nothing of ours runs."""
    began, spent = time.perf_counter(), time.thread_time()
    while time.perf_counter() - began < seconds:
        pass
    return (time.thread_time() - spent) / (time.perf_counter() - began)


def told(child: subprocess.Popen[str]) -> str:
    """The next line of a child."""
    assert child.stdout is not None
    return child.stdout.readline().strip()


def on_core(children: Sequence[subprocess.Popen[str]]) -> float:
    """Seconds that processes of one thread have run so far, together."""
    return sum(float(Path(f"/proc/{child.pid}/schedstat").read_text().split()[0]) for child in children) / 1e9


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--data", default="../shared/data/real", help="a folder of pairs")
    parser.add_argument("--pair", default="hdl32-small-gicp")
    parser.add_argument("--presets", nargs="+", default=["default", "cross3dreg"])
    parser.add_argument("--before", type=Path, help="another checkout, to alternate with this one")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--limit", type=float, default=2.0, help="times the fair share")
    options = parser.parse_args()
    data = Path(options.data).resolve()
    if not data.is_dir():
        print(f"no real pairs at {data}: nothing to measure (pass --data)")
        return 0
    builds = {"before": options.before.resolve()} if options.before else {}
    builds["now"] = ROOT
    print(
        f"{len(os.sched_getaffinity(0))} cores, load {os.getloadavg()[0]:.1f} at the start; seconds (x fair share)"
    )
    print(f"{'preset':12s} {'situation':28s} {'fair':>6s}" + "".join(f"{name:>18s}" for name in builds))
    slow = 0
    for preset in options.presets:
        work = None
        for situation in SITUATIONS:
            took = measure(situation, [preset, str(data), options.pair], builds, options.rounds)
            if work is None:  # alone comes first
                work = min(min(one.processor) for one in took.values())
            times = {
                name: median(w * s / work for w, s in zip(one.wall, one.share, strict=True))
                for name, one in took.items()
            }
            fair = median(work / share for share in took["now"].share)
            print(
                f"{preset:12s} {situation.name:28s} {fair:6.2f}"
                + "".join(f"{median(took[name].wall):9.2f} ({times[name]:5.2f})" for name in builds),
                flush=True,
            )
            slow += times["now"] > options.limit
    return 1 if slow else 0


if __name__ == "__main__":
    sys.exit(main())
