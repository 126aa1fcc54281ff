# SPDX-License-Identifier: MIT
"""Where the time of a registration goes: an easy, a hard and a hopeless pair, by entry of `default` and by part of the
code.

    python -m benchmarks.time_map --data ../shared/data/real

A second thread looks every few milliseconds which function of this library is at work, calls into other libraries
counted with it. Shares are of the wall time of all rounds together.
"""

from __future__ import annotations

import argparse
import sys
import threading
import time
from collections import Counter
from types import FrameType
from typing import Any

import hybridreg as hr
from benchmarks.measuring.alternate import real_pairs
from hybridreg.data import open_dataset
from hybridreg.pair import Pair

_EVERY = 0.002  # seconds between two looks
_FOLDERS = ("hybridreg", "classical", "learned")
_LISTED = 12  # functions a pair

EASY, HARD, HOPELESS = "kitti-odo-5-to-0", "sim:val/degenerate#1", "sim:val/disjoint#1"


class Sampler:
    """Seconds by function while the block runs, of the thread that enters it."""

    def __enter__(self) -> Sampler:
        self.seconds: Counter[str] = Counter()
        self._stop = threading.Event()
        self._watched = threading.get_ident()
        self._thread = threading.Thread(target=self._look, daemon=True)
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._stop.set()
        self._thread.join()

    def _look(self) -> None:
        last = time.perf_counter()
        while not self._stop.wait(_EVERY):
            now = time.perf_counter()
            # Weighted by the time since the last look: a call that keeps the interpreter's lock delays this thread.
            self.seconds[_place(sys._current_frames().get(self._watched))] += now - last
            last = now


def _place(frame: FrameType | None) -> str:
    """The innermost function of this library, as ``folder/module.function``."""
    while frame is not None:
        parts = frame.f_globals.get("__name__", "").split(".")
        if parts[0] in _FOLDERS:
            code = frame.f_code
            name = code.co_qualname if sys.version_info >= (3, 11) else code.co_name
            return f"{'/'.join(parts[-2:])}.{name}"
        frame = frame.f_back
    return "elsewhere"


def measure(pair: Pair, rounds: int) -> tuple[Any, float, Counter[str]]:
    """The last result, median wall seconds, and seconds by function of all rounds."""
    pipeline = hr.Pipeline.preset("default")
    pipeline.run(pair)  # imports and weights are not measured
    walls = []
    with Sampler() as sampler:
        for _ in range(rounds):
            start = time.perf_counter()
            result = pipeline.run(pair)
            walls.append(time.perf_counter() - start)
    return result, sorted(walls)[rounds // 2], sampler.seconds


def report(title: str, pair: Pair, rounds: int) -> str:
    """Markdown: entries with their seconds, then functions with their share of the time."""
    result, median, seconds = measure(pair, rounds)
    stages = ", ".join(f"{name} {spent:.2f}" for name, spent in result.seconds.items() if spent >= 0.005)
    lines = [f'**{title}**, {pair.id}: {median:.2f} s, "{result.verdict}". Stages: {stages} s.', ""]
    lines += ["| entry | s | poses | won |", "|---|---|---|---|"]
    lines += [
        f"| {trace.entry} | {trace.seconds:.2f} | {trace.poses} | {'yes' if trace.won else ''} |"
        for trace in result.entries
    ]
    total = sum(seconds.values())
    lines += ["", "| function | share % |", "|---|---|"]
    lines += [f"| `{name}` | {100 * spent / total:.0f} |" for name, spent in seconds.most_common(_LISTED)]
    return "\n".join(lines)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "--data", default="../shared/data/real", help="folder of real pairs with the easy one"
    )
    parser.add_argument("--rounds", type=int, default=5)
    options = parser.parse_args()
    pairs = [("Easy", labelled.pair) for labelled in real_pairs(options.data, [EASY])]
    pairs += [
        (title, list(open_dataset(name))[-1].pair) for title, name in (("Hard", HARD), ("Hopeless", HOPELESS))
    ]
    print("\n\n".join(report(title, pair, options.rounds) for title, pair in pairs))


if __name__ == "__main__":
    main()
