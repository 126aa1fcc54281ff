# SPDX-License-Identifier: MIT
"""Weighted sums of gathered rows (a sparse matrix times a dense one), and their gradient without a scatter."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import torch
from scipy.sparse import csr_array
from torch import Tensor
from torch.nn import functional as F


@dataclass(frozen=True)
class Bags:
    """A sparse matrix (B, M): bag b sums ``weight`` times row ``index`` from ``offsets[b]`` to the next."""

    index: Tensor  # (E,) int64 rows
    weight: Tensor  # (E,)
    offsets: Tensor  # (B,) int64
    n_rows: int  # M

    @cached_property
    def transposed(self) -> Bags:
        """The same by row, for the gradient. Sorted once, however often it is needed."""
        starts = F.pad(self.offsets, (0, 1), value=len(self.index))
        table = csr_array(
            tuple(part.numpy(force=True) for part in (self.weight, self.index, starts)),
            shape=(len(self.offsets), self.n_rows),
        ).tocsc()
        index, offsets = (
            torch.from_numpy(part.astype(np.int64)).to(self.index.device)
            for part in (table.indices, table.indptr[:-1])
        )
        weight = torch.from_numpy(table.data).to(self.weight.device)
        return Bags(index, weight, offsets, len(self.offsets))

    def sum(self, rows: Tensor) -> Tensor:
        """Rows (M, C) to bags (B, C)."""
        out: Tensor = _Sum.apply(rows, self)
        return out

    def sum_detached(self, rows: Tensor) -> Tensor:
        """The same outside of any graph."""
        return F.embedding_bag(self.index, rows, self.offsets, mode="sum", per_sample_weights=self.weight)


class _Sum(torch.autograd.Function):
    # torch's own gradient sorts the index each time and adds row by row.
    @staticmethod
    def forward(ctx: Any, rows: Tensor, bags: Bags) -> Tensor:
        ctx.bags = bags
        return bags.sum_detached(rows)

    @staticmethod
    def backward(ctx: Any, gradient: Tensor) -> tuple[Tensor, None]:
        # Rows in one piece: of others torch sums at half the speed.
        return ctx.bags.transposed.sum_detached(gradient.contiguous()), None
