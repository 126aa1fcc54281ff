# SPDX-License-Identifier: MIT
"""Processor time a pair of each phase of training, this checkout's over another's.

    python -m benchmarks.training_phases --before ../an/older/checkout

Each phase runs for a few steps and for many on the same twelve pairs, one thread; the difference is the steps' own
time, without imports, preparation and what a frozen backbone computes once. The builds alternate. Processor seconds, so
that other work on the machine matters little; the least of all rounds counts.
"""

from __future__ import annotations

import argparse
import os
import resource
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

ROOT = Path(__file__).resolve().parents[1]

_RECIPE = """
base = "{base}"
start = "{start}"
every = 0
log_every = {steps}
[data]
train = [{{ data = "sim:train/near#4" }}, {{ data = "sim:train/mid#4" }}, {{ data = "sim:train/far#4" }}]
val = []
[[phase]]
name = "measured"
steps = {steps}
rate = 1e-4
accumulate = 1
backbone_rate = {backbone}
losses = {{ infonce = {infonce}, coarse = {others}, fine = {others}, mask = 0.0 }}
"""
# Recipe, factor on the backbone's rate, and weights of the dense loss and of the matching's losses.
PHASES = {
    "warm-up": ("warm-up", 1.0, 1.0, 0.0),
    "trunk": ("trunk", 1.0, 1.0, 1.0),
    "heads": ("geotransformer-small", 0.0, 0.0, 1.0),
}
_START = "geotransformer-small"  # weights that lie in the wheel
_FEW, _MANY = 24, 144  # steps of one pair


def seconds(checkout: Path, phase: str, cache: Path) -> float:
    """Processor seconds of one training step of one pair."""
    few, many = (_processor(checkout, phase, steps, cache) for steps in (_FEW, _MANY))
    return (many - few) / (_MANY - _FEW)


def _processor(checkout: Path, phase: str, steps: int, cache: Path) -> float:
    base, backbone, infonce, others = PHASES[phase]
    recipe = _RECIPE.format(
        base=base, start=_START, steps=steps, backbone=backbone, infonce=infonce, others=others
    )
    with TemporaryDirectory() as folder:
        (Path(folder) / "recipe.toml").write_text(recipe, encoding="utf-8")
        command = [sys.executable, "-m", "hybridreg", "train", str(Path(folder) / "recipe.toml")]
        command += ["--out", str(Path(folder) / "out"), "--cache", str(cache), "--accelerator", "cpu"]
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        environment = {**os.environ, "OMP_NUM_THREADS": "1", "PYTHONPATH": str(checkout)}
        subprocess.run(command, check=True, capture_output=True, cwd=checkout, env=environment)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--before", type=Path, required=True, help="another checkout")
    parser.add_argument("--phases", nargs="*", default=list(PHASES))
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--cache", type=Path, default=Path("runs/prepared"))
    options = parser.parse_args()
    builds = {"before": options.before.resolve(), "now": ROOT}
    print("| phase | before, ms a pair | now | pairs a second, now over before |\n|---|---|---|---|")
    for phase in options.phases:
        taken = {name: float("inf") for name in builds}
        for _ in range(options.rounds):
            for name, checkout in builds.items():
                taken[name] = min(taken[name], seconds(checkout, phase, options.cache.resolve()))
        before, now = (1e3 * taken[name] for name in builds)
        print(f"| {phase} | {before:.0f} | {now:.0f} | {before / now:.2f} |", flush=True)


if __name__ == "__main__":
    main()
