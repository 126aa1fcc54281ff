# SPDX-License-Identifier: MIT
"""Patches, pairs and superpoint matching."""

from __future__ import annotations

import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from hybridreg.learned.matching import patch_pairs
from hybridreg.learned.matching.patch_pairs import pair_patches, size_chunks
from hybridreg.learned.matching.point_matching import mutual_top_k
from hybridreg.learned.matching.superpoint_matching import match_superpoints
from hybridreg.learned.pyramid import patches
from hybridreg.learned.pyramid.patches import build_patches


@settings(max_examples=30, deadline=None)
@given(st.integers(1, 80), st.integers(1, 12), st.integers(1, 20), st.integers(0, 10**6))
def test_patches_equal_brute_force(n: int, n_nodes: int, limit: int, seed: int) -> None:
    gen = torch.Generator().manual_seed(seed)
    points, nodes = torch.rand(n, 3, generator=gen), torch.rand(n_nodes, 3, generator=gen)
    found = build_patches(points, nodes, limit)
    distance = torch.cdist(points.double(), nodes.double())
    for node in range(n_nodes):
        mine = (distance.argmin(1) == node).nonzero()[:, 0]
        nearest = mine[distance[mine, node].argsort()][:limit]
        row = found.index[node]
        assert row[found.mask[node]].tolist() == nearest.tolist()
        assert (row[~found.mask[node]] == n).all()
        assert bool(found.occupied[node]) == (len(mine) > 0)
    assert found.index.shape == (n_nodes, min(limit, n))


def test_chunked_assignment_is_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    points, nodes = torch.rand(100, 3), torch.rand(7, 3)
    whole = build_patches(points, nodes, 9)
    monkeypatch.setattr(patches, "_CHUNK_PAIRS", 50)
    assert torch.equal(build_patches(points, nodes, 9).index, whole.index)


def test_chunks_hold_every_pair_and_point_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(patch_pairs, "_CHUNK_VALUES", 300)
    target, source = (build_patches(torch.rand(n, 3), torch.rand(10, 3), 30) for n in (90, 70))
    nodes = [p.occupied.nonzero()[:, 0] for p in (target, source)]
    pairs = pair_patches(target, source, nodes[0].repeat(3)[:12], nodes[1].repeat(3)[:12])
    chunks = size_chunks(pairs)
    assert len(chunks) > 1
    assert sorted(torch.cat([c.group for c in chunks]).tolist()) == list(range(12))
    for chunk in chunks:
        assert torch.equal(chunk.target_mask.sum(1), pairs.target_mask[chunk.group].sum(1))
        assert torch.equal(chunk.source_mask.sum(1), pairs.source_mask[chunk.group].sum(1))
    assert size_chunks(pairs.take(torch.zeros(0, dtype=torch.int64))) == []


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 6), st.integers(0, 6), st.integers(1, 50), st.booleans(), st.integers(0, 10**6))
def test_superpoint_matching(m: int, n: int, wanted: int, dual: bool, seed: int) -> None:
    gen = torch.Generator().manual_seed(seed)
    unit = torch.nn.functional.normalize
    target, source = (
        unit(torch.randn(m, 8, generator=gen), dim=1),
        unit(torch.randn(n, 8, generator=gen), dim=1),
    )
    found = match_superpoints(target, source, wanted, dual=dual)
    scores = torch.exp(-torch.cdist(target.double(), source.double()).square())
    if dual:
        scores = scores**2 / (scores.sum(1, keepdim=True) * scores.sum(0, keepdim=True))
    assert len(found) == min(wanted, m * n)
    assert torch.allclose(found.score.double(), scores[found.target, found.source], atol=1e-5)
    best = scores.flatten().sort(descending=True).values[: len(found)]
    assert torch.allclose(found.score.double(), best, atol=1e-5)


def test_mutual_top_k() -> None:
    probability = torch.tensor([[[0.5, 0.4, 0.3], [0.6, 0.02, 0.1]]])
    rows, columns = torch.tensor([[True, True]]), torch.tensor([[True, True, False]])
    both = mutual_top_k(probability, rows, columns, topk=1, threshold=0.05)
    either = mutual_top_k(probability, rows, columns, topk=1, threshold=0.05, mutual=False)
    assert both.nonzero().tolist() == [[0, 1, 0]]
    assert either.nonzero().tolist() == [[0, 0, 0], [0, 0, 1], [0, 1, 0]]
