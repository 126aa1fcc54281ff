# SPDX-License-Identifier: MIT
"""Seconds of `hybridreg register` in a fresh process over those of a call in a running one, pair by pair.

    python -m benchmarks.first_call --data ../shared/data/real

The last column is what a fresh process spends before any of this library's code runs: the interpreter, numpy and the
parts of scipy that no registration does without.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from statistics import median

import hybridreg as hr

FOREIGN = "import numpy, scipy.fft, scipy.ndimage, scipy.spatial"


def seconds(call: Callable[[], object]) -> float:
    start = time.perf_counter()
    call()
    return time.perf_counter() - start


def fresh(*arguments: str) -> Callable[[], object]:
    command = [sys.executable, *arguments]
    return lambda: subprocess.run(command, check=True, capture_output=True)


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--data", default="../shared/data/real", help="a folder of pairs")
    parser.add_argument("--pairs", type=int, default=8)
    options = parser.parse_args()
    folders = sorted(path.parent for path in Path(options.data).glob("*/source.npz"))[: options.pairs]
    if not folders:
        print(f"no pairs in {options.data}")
        return 2
    ratios, imports = [], []
    print(f"{'pair':32}{'first s':>9}{'running s':>11}{'ratio':>8}{'imports s':>11}")
    for folder in folders:
        pair = [str(folder / f"{side}.npz") for side in ("source", "target")]
        first = seconds(fresh("-m", "hybridreg", "register", *pair))
        hr.register(*pair)
        running = seconds(partial(hr.register, *pair))
        imports.append(seconds(fresh("-c", FOREIGN)))
        ratios.append(first / running)
        print(f"{folder.name:32}{first:9.2f}{running:11.2f}{ratios[-1]:8.2f}{imports[-1]:11.2f}", flush=True)
    print(f"median ratio {median(ratios):.2f}; imports of others {median(imports):.2f} s")
    return 0


if __name__ == "__main__":
    sys.exit(main())
