# SPDX-License-Identifier: MIT
"""Votes of fine points and the uniqueness of matches, against the plain definition."""

from __future__ import annotations

import pytest
import torch
from torch.nn import functional as F

from hybridreg.learned.matching import point_similarity
from hybridreg.learned.matching.point_similarity import Voters, compare_points

TEMPERATURE = 0.1


def voters(seed: int, n: int, size: int) -> Voters:
    generator = torch.Generator().manual_seed(seed)
    owner = torch.randint(-1, size, (n,), generator=generator)
    return Voters(torch.randn(n, 8, generator=generator), owner, size)


@pytest.fixture(params=[2**22, 64], ids=["one block", "many blocks"])
def pair(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> tuple[Voters, Voters]:
    monkeypatch.setattr(point_similarity, "_BLOCK_VALUES", request.param)
    return voters(0, 40, 5), voters(1, 30, 4)


def scores(target: Voters, source: Voters) -> torch.Tensor:
    """(N, M) cosines over the temperature, without the points that take no part."""
    f, g = F.normalize(target.features, dim=1), F.normalize(source.features, dim=1)
    found = f @ g.t() / TEMPERATURE
    found[target.owner < 0] = -torch.inf
    found[:, source.owner < 0] = -torch.inf
    return found


def test_votes_are_shares_of_each_points_best_scores(pair: tuple[Voters, Voters]) -> None:
    target, source = pair
    S = scores(target, source)
    given = torch.zeros(2, target.size, source.size)
    for q in (target.owner >= 0).nonzero()[:, 0]:
        best = torch.stack([S[q, source.owner == j].max() for j in range(source.size)])
        given[0, target.owner[q]] += torch.softmax(best, 0)
    for p in (source.owner >= 0).nonzero()[:, 0]:
        best = torch.stack([S[target.owner == i, p].max() for i in range(target.size)])
        given[1, :, source.owner[p]] += torch.softmax(best, 0)
    votes = compare_points(target, source, TEMPERATURE).votes
    assert torch.allclose(votes, (given + 1e-6).log().sum(0), atol=1e-4)


def test_uniqueness_is_the_product_of_both_softmaxes(pair: tuple[Voters, Voters]) -> None:
    target, source = pair
    S = scores(target, source)
    expected = torch.softmax(S, 1).nan_to_num(0.0) * torch.softmax(S, 0).nan_to_num(0.0)
    found = compare_points(target, source, TEMPERATURE)
    index = torch.cartesian_prod(torch.arange(40), torch.arange(30))
    assert torch.allclose(found.uniqueness(index[:, 0], index[:, 1]), expected.flatten(), atol=1e-5)


def test_a_cloud_without_voters_gives_no_numbers_that_are_none() -> None:
    nobody = Voters(torch.randn(3, 8), torch.full((3,), -1), 2)
    found = compare_points(nobody, voters(0, 10, 4), TEMPERATURE)
    assert found.votes.shape == (2, 4)
    assert not bool(found.votes.isnan().any())
    assert float(found.uniqueness(torch.tensor([0]), torch.tensor([1]))) == 0.0
