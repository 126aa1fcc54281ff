# SPDX-License-Identifier: MIT
"""Results of methods where one sensor sees only its immediate surroundings, by the extent of its cloud.

    hybridreg table default.toml --data "sim:val/mid#100" --starts 0 --out runs/val-mid
    python -m benchmarks.reach runs/val-mid --data "sim:val/mid#100"

A cloud's extent is the distance from its middle within which nine tenths of its points lie; a pair's is the shorter of
the two. A narrow sensor a few metres in front of a wall or a hedge gives a cloud of a few metres, with hardly more
than one surface of a place that the other sensor sees completely.
"""

from __future__ import annotations

import argparse
from itertools import pairwise
from pathlib import Path

import numpy as np

from hybridreg.data import open_dataset
from hybridreg.geometry.extent import reach
from hybridreg.verdict.training.calibration import answered, is_right

# Metres.
BORDERS = (0.0, 6.0, 12.0, 25.0, np.inf)


def outcomes(folder: Path, data: str) -> list[tuple[float, bool, bool]]:
    """For each pair: extent in metres, whether its pose is right, and whether it was called ok."""
    clouds = {labelled.pair.id: labelled.pair for labelled in open_dataset(data)}
    return [
        (min(reach(cloud.radii) for cloud in (pair.source, pair.target)), is_right(row), row.verdict == "ok")
        for row in answered(folder)
        if (pair := clouds.get(row.id)) is not None
    ]


def table(found: list[tuple[float, bool, bool]]) -> str:
    """Markdown: pairs, right poses, and right ones that were called ok, for each class of extent."""
    metres, right, ok = (np.array(column) for column in zip(*found, strict=True))
    lines = ["| extent, m | pairs | right | right and ok |", "|---|---|---|---|"]
    for low, high in pairwise(BORDERS):
        here = (metres >= low) & (metres < high)
        name = f"{low:.0f} to {high:.0f}" if np.isfinite(high) else f"beyond {low:.0f}"
        lines.append(f"| {name} | {here.sum()} | {right[here].sum()} | {(right & ok)[here].sum()} |")
    return "\n".join(lines)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("run", type=Path, help="folder that `hybridreg table` wrote")
    parser.add_argument("--data", required=True, help="the data set of the run")
    options = parser.parse_args()
    print(table(outcomes(options.run, options.data)))


if __name__ == "__main__":
    main()
