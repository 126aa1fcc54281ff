# SPDX-License-Identifier: MIT
"""How much could tell the true pose at all? Surfaces on which both clouds agree when they lie as they did.

    python -m benchmarks.observability --data sim:val/degenerate#60

Of each pair's asked points (at most 3,000 of each cloud) it counts those that agree under the true pose and face
another way than most do: on a field all but the ground, beside a wall all but the wall. Where there are hardly any,
clouds may slide and turn on that one surface, and no method can tell where they lay.
"""

from __future__ import annotations

import argparse
from collections import Counter
from collections.abc import Iterator
from itertools import pairwise

import numpy as np

from hybridreg.classical.voxel import VoxelGrid
from hybridreg.data import open_dataset
from hybridreg.verdict import support

# Borders of the table's classes, points.
BORDERS = (0, 5, 20, 50, 100, 200, np.inf)


def agreeing_off_the_commonest(data: str) -> Iterator[float]:
    """Agreeing points of each pair of a data set that do not face the commonest way, under the true pose."""
    for labelled in open_dataset(data):
        scene = VoxelGrid()(labelled.pair)
        agreement, _ = support.seen(scene, labelled.T_target_source)
        yield agreement.rare[1]


def table(counts: list[float]) -> str:
    """Markdown: how many pairs have how many such points."""
    which = Counter(int(k) for k in np.searchsorted(BORDERS, counts, side="right") - 1)
    lines = [
        f"| {low:.0f} to {high - 1:.0f} | {which[k]} |"
        if np.isfinite(high)
        else f"| {low:.0f} or more | {which[k]} |"
        for k, (low, high) in enumerate(pairwise(BORDERS))
    ]
    return "\n".join(["| points that agree off the commonest surface | pairs |", "|---|---|", *lines])


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--data", default="sim:val/degenerate#60")
    print(table(list(agreeing_off_the_commonest(parser.parse_args().data))))


if __name__ == "__main__":
    main()
