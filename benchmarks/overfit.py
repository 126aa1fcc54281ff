# SPDX-License-Identifier: MIT
"""Can a network learn at all? A few pairs, not augmented, shown again and again: losses must fall, matches must become
right.

``python -m benchmarks.overfit fcgf roitr --out docs/training/overfit`` trains the recipes ``fcgf-small`` and
``roitr-small`` on one pair of every tier, at a constant rate, and keeps their logs as ``NAME.csv``.
"""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Annotated

import typer

from hybridreg.io.atomic import write_text
from hybridreg.learned.training import recipe_file
from hybridreg.learned.training.training_run import RunOptions, train

_RECIPE = """
base = "{name}-small"
every = 0
log_every = {log_every}
[augmentation]
rotation = "none"
shift = 0.0
jitter = 0.0
[data]
train = [
    {{ data = "sim:train/near#{each}", name = "near" }},
    {{ data = "sim:train/mid#{each}", name = "mid" }},
    {{ data = "sim:train/far#{each}", name = "far" }},
    {{ data = "sim:train/degenerate#{each}", name = "degenerate" }},
]
val = []
[[phase]]
name = "overfit"
steps = {steps}
rate = {phase.rate}
optimizer = "{phase.optimizer}"
momentum = {phase.momentum}
weight_decay = {phase.weight_decay}
accumulate = {phase.accumulate}
"""


def main(
    names: Annotated[list[str], typer.Argument(help="Networks with a recipe NAME-small.")],
    out: Path = Path("runs/overfit"),
    visits: int = 80,
    pairs: int = 4,
    cache: Path = Path("runs/prepared"),
) -> None:
    """Write ``NAME.csv`` for each: a line every four or more visits."""
    for name in names:
        phase = recipe_file.read(f"{name}-small").phase[0]
        steps, log_every = max(1, visits // phase.accumulate), max(1, pairs // phase.accumulate)
        text = _RECIPE.format(
            name=name, each=max(1, pairs // 4), steps=steps, log_every=log_every, phase=phase
        )
        with TemporaryDirectory() as folder:
            recipe = Path(folder) / "overfit.toml"
            write_text(recipe, text)
            train(
                recipe_file.read(recipe), RunOptions(out=Path(folder) / "run", cache=cache, accelerator="cpu")
            )
            out.mkdir(parents=True, exist_ok=True)
            write_text(out / f"{name}.csv", (Path(folder) / "run" / "log.csv").read_text(encoding="utf-8"))


if __name__ == "__main__":
    typer.run(main)
