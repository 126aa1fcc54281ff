# SPDX-License-Identifier: MIT
"""Pairs a second that training takes on this machine: one process on the CPU, one and several on a GPU.

``python -m benchmarks.training_speed --processes 1,4 --batch 32 --packed 32`` trains the recipe `warm-up` with each and
reads its log. Prepared pairs are stored in ``--cache``.
"""

from __future__ import annotations

import csv
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import torch
import typer

_STEPS = 30  # optimiser steps, by hand
_PAIRS = 40  # of each tier, by hand
_RECIPE = """
base = "warm-up"
every = 0
log_every = {half}
[data]
train = [{{ data = "sim:train/near#{pairs}" }}, {{ data = "sim:train/mid#{pairs}" }}]
val = []
[[phase]]
name = "speed"
steps = {steps}
rate = 1e-3
accumulate = {batch}
packed = {packed}
losses = {{ infonce = 1.0, coarse = {others}, fine = {others}, mask = 0.0 }}
"""


def main(
    processes: str = "1",
    batch: int = 8,
    packed: int = 1,
    cache: Path = Path("runs/prepared"),
    workers: int = 2,
    matching: bool = False,
) -> None:
    """Print a Markdown table; ``--matching`` trains superpoint and point matching too.

    ``--batch`` is the pairs of a step, ``--packed`` how many of them go through the backbone at once.
    """
    recipe = _RECIPE.format(
        half=_STEPS // 2, pairs=_PAIRS, steps=_STEPS, batch=batch, packed=packed, others=float(matching)
    )
    kinds = [("cpu", 1)]
    if torch.cuda.is_available():
        kinds += [("cuda", int(n)) for n in processes.split(",")]
    print("| device | processes | pairs a second | ratio |\n|---|---|---|---|")
    first = 0.0
    for accelerator, n in kinds:
        with TemporaryDirectory() as folder:
            (Path(folder) / "speed.toml").write_text(recipe)
            speed = batch * _steps_a_second(Path(folder), accelerator, n, cache, workers)
        first = first or speed
        name = torch.cuda.get_device_name() if accelerator == "cuda" else "CPU"
        print(f"| {name} | {n} | {speed:.1f} | {speed / first:.1f} |", flush=True)


def _steps_a_second(folder: Path, accelerator: str, processes: int, cache: Path, workers: int) -> float:
    command = [
        *(sys.executable, "-m", "torch.distributed.run", f"--nproc-per-node={processes}", "-m", "hybridreg"),
        *("train", str(folder / "speed.toml"), "--out", str(folder / "out"), "--cache", str(cache)),
        *("--accelerator", accelerator, "--workers", str(workers)),
    ]
    subprocess.run(command, check=True, capture_output=True)
    *_, last = csv.DictReader((folder / "out" / "log.csv").open())
    return float(last["steps_per_s"])


if __name__ == "__main__":
    typer.run(main)
