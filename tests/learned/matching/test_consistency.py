# SPDX-License-Identifier: MIT
"""Matches that move as one are told from those that do not."""

from __future__ import annotations

import pytest
import torch

from hybridreg.learned.matching import consistency
from hybridreg.learned.matching.consistency import consistent


def planted(n: int, right: int, seed: int = 0) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
    generator = torch.Generator().manual_seed(seed)
    source = 40.0 * torch.rand(n, 3, generator=generator)
    turn = torch.linalg.qr(torch.randn(3, 3, generator=generator))[0]
    target = source @ turn.t() + 5.0
    target[right:] = 40.0 * torch.rand(n - right, 3, generator=generator)
    return target, source, torch.rand(n, generator=generator)


@pytest.mark.parametrize("share", [0.5, 0.2])
def test_the_group_that_moves_as_one_is_found(share: float) -> None:
    n = 400
    right = int(share * n)
    keep = consistent(*planted(n, right), reach=0.5)
    assert bool(keep[:right].all())
    assert float(keep[right:].float().mean()) < 0.05


def test_only_the_heaviest_are_compared(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(consistency, "_MOST", 50)
    target, source, weight = planted(100, 100)
    keep = consistent(target, source, weight, reach=0.5)
    assert int(keep.sum()) == 50
    assert float(weight[keep].min()) >= float(weight[~keep].max())


@pytest.mark.parametrize("n", [0, 1, 2])
def test_too_few_to_tell_all_stay(n: int) -> None:
    assert bool(consistent(*planted(n, n), reach=0.5).all())
    assert len(consistent(*planted(n, n), reach=0.5)) == n
