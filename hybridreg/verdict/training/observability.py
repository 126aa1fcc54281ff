# SPDX-License-Identifier: MIT
"""How much could tell the true pose at all? Surfaces on which both clouds agree when they lie as they did.

    python -m hybridreg.verdict.training.observability --data sim:val/degenerate#60

Of each pair's asked points (at most 3,000 of each cloud) it counts those that agree under the true pose and face
another way than most do: on a field all but the ground, beside a wall all but the wall. Where there are hardly any,
clouds may slide and turn on that one surface, and only its relief can tell where they lay: the last column counts the
pairs whose ground is alike under the true pose.
"""

from __future__ import annotations

import argparse
from collections import Counter
from collections.abc import Iterator
from itertools import pairwise

import numpy as np

from hybridreg.classical.voxel import VoxelGrid
from hybridreg.data import open_dataset
from hybridreg.evidence import views
from hybridreg.evidence.agreement import compare
from hybridreg.geometry.ground_relief import TELLS

# Borders of the table's classes, points.
BORDERS = (0, 5, 20, 50, 100, 200, np.inf)


def observed(data: str) -> Iterator[tuple[float, bool]]:
    """Of each pair of a data set, under the true pose: agreeing points that do not face the commonest way, and whether
    the ground is alike."""
    for labelled in open_dataset(data):
        agreement = compare(views.of(VoxelGrid()(labelled.pair)), labelled.T_target_source)
        yield agreement.rare[1], agreement.relief.information >= TELLS


def table(found: list[tuple[float, bool]]) -> str:
    """Markdown: how many pairs have how many such points, and how many of these pairs a relief that tells."""
    classes = np.searchsorted(BORDERS, [points for points, _ in found], side="right") - 1
    which = Counter(int(k) for k in classes)
    alike = Counter(int(k) for k, (_, tells) in zip(classes, found, strict=True) if tells)
    lines = [
        f"| {low:.0f} {f'to {high - 1:.0f}' if np.isfinite(high) else 'or more'} | {which[k]} | {alike[k]} |"
        for k, (low, high) in enumerate(pairwise(BORDERS))
    ]
    head = ["| points that agree off the commonest surface | pairs | with ground alike |", "|---|---|---|"]
    return "\n".join([*head, *lines])


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--data", default="sim:val/degenerate#60")
    print(table(list(observed(parser.parse_args().data))))


if __name__ == "__main__":
    main()
