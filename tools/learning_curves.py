# SPDX-License-Identifier: MIT
"""Learning curves of training runs, one column a run: losses and validation figures.

    python -m tools.learning_curves docs/training --out docs/training.png

Each folder below the given one holds the `log.csv` and `validation.csv` that `hybridreg train` wrote.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from hybridreg.eval.report.cloud_pictures import new_figure, save
from hybridreg.learned.training.curve_files import CurveFile

# Validation figures: in a warm-up the inlier ratio is that of mutual nearest neighbours.
FOUND = ("inlier_ratio", "pir", "recall", "mask_f1")
COLOURS = ("#1b6ca8", "#d95f02", "#3a7d44", "#8e44ad")


def curve(rows: Sequence[dict[str, str]], name: str) -> tuple[list[int], list[float]]:
    """Steps and values of a column where it has any."""
    found = [(int(row["total"]), float(row[name])) for row in rows if row.get(name) not in (None, "", "nan")]
    return [step for step, _ in found], [value for _, value in found]


def losses(log: Sequence[dict[str, str]]) -> list[str]:
    """The parts of the loss: a log has them between their sum and the share of right matches."""
    columns = list(log[0]) if log else []
    return columns[columns.index("loss") + 1 : columns.index("hits")] if log else []


def smoothed(values: list[float], width: int = 5) -> list[float]:
    """Means of up to `width` neighbours."""
    half = width // 2
    parts = [values[max(0, i - half) : i + half + 1] for i in range(len(values))]
    return [sum(part) / len(part) for part in parts]


def runs(folder: Path) -> Iterator[Path]:
    """Folders with a log, oldest training first as far as their names show."""
    order = {"warm-up": 0, "trunk": 1}
    found = [file.parent for file in folder.glob("*/log.csv")]
    yield from sorted(found, key=lambda run: (order.get(run.name, 2), run.name))


def draw(figure: Any, chosen: list[Path]) -> None:
    """Losses above, validation below."""
    panels = figure.subplots(2, len(chosen), squeeze=False)
    for (above, below), run in zip(panels.T, chosen, strict=True):
        log, validation = (CurveFile(run / name, ()).rows() for name in ("log.csv", "validation.csv"))
        for name, colour in zip(losses(log), COLOURS, strict=False):
            steps, values = curve(log, name)
            if steps and any(values):
                above.plot(steps, smoothed(values), color=colour, label=name)
        above.set(title=run.name, ylabel="loss")
        for name, colour in zip(FOUND, COLOURS, strict=True):
            for title, style in (("near", "-"), ("mid", "--"), ("far", ":")):
                steps, values = curve([row for row in validation if row["title"] == title], name)
                if steps:
                    below.plot(steps, values, style, color=colour, marker=".", label=f"{name}, {title}")
        below.set(ylim=(0, 1), xlabel="steps")
        for axes in (above, below):
            axes.grid(alpha=0.3)
            if axes.lines:
                axes.legend(fontsize=6)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folder", type=Path)
    parser.add_argument("--out", type=Path, required=True)
    given = parser.parse_args()
    chosen = list(runs(given.folder))
    if not chosen:
        parser.error(f"no */log.csv below {given.folder}")
    figure = new_figure((3.6 * len(chosen), 6.0))
    draw(figure, chosen)
    save(figure, given.out)


if __name__ == "__main__":
    main()
