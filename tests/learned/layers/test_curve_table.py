# SPDX-License-Identifier: MIT
"""Tabulated curves against the curves themselves; bags against a dense matrix."""

from __future__ import annotations

import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from hybridreg.learned.layers.curve_table import interpolate, sample_positions
from hybridreg.learned.layers.positions import frequencies, sinusoids
from hybridreg.learned.layers.sparse_rows import Bags


@settings(max_examples=20, deadline=None)
@given(st.floats(0.0, 60.0), st.integers(0, 10**6))
def test_interpolated_embedding_equals_the_embedding(highest: float, seed: int) -> None:
    torch.manual_seed(seed)
    layer, frequency = torch.nn.Linear(64, 32), frequencies(64)
    values = torch.cat([torch.rand(500) * highest, torch.tensor([0.0, highest])])
    samples = layer(sinusoids(sample_positions(highest, values), frequency))
    assert (interpolate(samples, values) - layer(sinusoids(values, frequency))).abs().max() < 5e-6


def test_cubics_are_met_exactly() -> None:
    at = sample_positions(3.0, torch.zeros(0, dtype=torch.float64))
    values = torch.linspace(0, 3, 77, dtype=torch.float64)
    got = interpolate((at**3 - 2 * at)[:, None], values)[:, 0]
    assert torch.allclose(got, values**3 - 2 * values, atol=1e-12)


@settings(max_examples=25, deadline=None)
@given(st.lists(st.integers(0, 4), min_size=1, max_size=8), st.integers(1, 6), st.integers(0, 10**6))
def test_bags_are_a_sparse_matrix(sizes: list[int], n_rows: int, seed: int) -> None:
    gen = torch.Generator().manual_seed(seed)
    counts = torch.tensor(sizes)
    index = torch.randint(0, n_rows, (int(counts.sum()),), generator=gen)
    weight = torch.rand(len(index), dtype=torch.float64, generator=gen)
    bags = Bags(index, weight, counts.cumsum(0) - counts, n_rows)
    dense = torch.zeros(len(sizes), n_rows, dtype=torch.float64)
    dense.index_put_((torch.arange(len(sizes)).repeat_interleave(counts), index), weight, accumulate=True)
    rows = torch.randn(n_rows, 3, dtype=torch.float64, generator=gen, requires_grad=True)
    assert torch.allclose(bags.sum(rows), dense @ rows)
    assert torch.autograd.gradcheck(bags.sum, (rows,))
