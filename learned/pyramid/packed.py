# SPDX-License-Identifier: MIT
"""Several pyramids as one: for a GPU a pair is small, and most of a step is spent telling it what to do."""

from __future__ import annotations

from collections.abc import Sequence

import torch
from torch import Tensor

from hybridreg.learned.pyramid.point_pyramid import Pyramid


def packed(pyramids: Sequence[Pyramid]) -> Pyramid:
    """Pyramids of one plan, at least one, their clouds stacked in order; neighbours stay within their clouds."""
    stages = range(pyramids[0].stages)
    lengths = tuple(tuple(n for each in pyramids for n in each.lengths[stage]) for stage in stages)

    def rows(indices: Sequence[Tensor], stage: int) -> Tensor:
        # The padding index is a number of rows: the pyramid's own as it comes, that of all together in the pack.
        counts = [sum(each.lengths[stage]) for each in pyramids]
        moved, first = [], 0
        for index, count in zip(indices, counts, strict=True):
            moved.append(torch.where(index < count, index + first, sum(counts)))
            first += count
        return torch.cat(moved)

    return Pyramid(
        points=tuple(torch.cat([each.points[stage] for each in pyramids]) for stage in stages),
        lengths=lengths,
        neighbors=tuple(rows([each.neighbors[stage] for each in pyramids], stage) for stage in stages),
        subsampling=tuple(
            rows([each.subsampling[stage] for each in pyramids], stage) for stage in stages[:-1]
        ),
        upsampling=tuple(
            rows([each.upsampling[stage] for each in pyramids], stage + 1) for stage in stages[:-1]
        ),
    )
