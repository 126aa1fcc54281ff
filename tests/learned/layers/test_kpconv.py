# SPDX-License-Identifier: MIT
"""KPConv against a triple loop, its blocks, and max-pooling."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from torch import Tensor

from hybridreg.learned.layers.dense_influence import DenseLinks
from hybridreg.learned.layers.group_norm import all_at_once, group_norm
from hybridreg.learned.layers.influence import find_links
from hybridreg.learned.layers.kernel_points import cylindrical_kernel_points, kernel_points
from hybridreg.learned.layers.kpconv import KPConv, kernel_point_convolution
from hybridreg.learned.layers.kpconv_blocks import PointGroupNorm, linear_on_joined, upsample
from hybridreg.learned.layers.max_pool import max_pool


def by_loops(queries, supports, neighbors, kernel, sigma, features, weights, bias):  # type: ignore[no-untyped-def]
    """The definition, entry by entry."""
    out = torch.zeros(len(queries), weights.shape[2], dtype=torch.float64)
    for i, query in enumerate(queries):
        valid = [j for j in neighbors[i].tolist() if j < len(supports)]
        for k, point in enumerate(kernel):
            summed = torch.zeros(weights.shape[1], dtype=torch.float64)
            for j in valid:
                h = 1.0 - float((supports[j] - query - point).norm()) / sigma
                summed += max(0.0, h) * features[j]
            out[i] += summed @ weights[k]
        out[i] /= max(1, sum(float(features[j].sum()) > 0 for j in valid))
    return out + bias


FORMS = pytest.mark.parametrize("find", [find_links, DenseLinks.find], ids=["sparse", "dense"])


@FORMS
def test_equals_a_triple_loop(find: Any) -> None:
    gen = torch.Generator().manual_seed(0)
    supports = torch.rand(20, 3, dtype=torch.float64, generator=gen)
    queries = torch.rand(11, 3, dtype=torch.float64, generator=gen)
    neighbors = torch.randint(0, 21, (11, 6), generator=gen)  # 20 is the shadow
    neighbors[3] = 20
    features = torch.randn(20, 4, dtype=torch.float64, generator=gen)  # about half have a negative sum
    weights = torch.randn(15, 4, 5, dtype=torch.float64, generator=gen)
    bias = torch.randn(5, dtype=torch.float64, generator=gen)
    kernel = torch.from_numpy(kernel_points(15, 0.8)).double()
    influence = find(queries, supports, neighbors).influence(kernel, 0.4)
    got = kernel_point_convolution(features, neighbors, influence, weights, bias)
    want = by_loops(queries, supports, neighbors, kernel, 0.4, features, weights, bias)
    assert torch.allclose(got, want, atol=1e-10, rtol=0)
    assert torch.equal(got[3], bias)


@FORMS
@pytest.mark.parametrize("sigma", [0.5, 1e-6])  # the second reaches nothing
def test_gradients_reach_features_and_weights(sigma: float, find: Any) -> None:
    gen = torch.Generator().manual_seed(1)
    supports = torch.rand(9, 3, dtype=torch.float64, generator=gen)
    queries = torch.rand(6, 3, dtype=torch.float64, generator=gen)
    neighbors = torch.randint(0, 10, (6, 4), generator=gen)
    neighbors[2] = 9
    features = torch.rand(9, 3, dtype=torch.float64, generator=gen, requires_grad=True)
    weights = torch.randn(15, 3, 2, dtype=torch.float64, generator=gen, requires_grad=True)
    bias = torch.randn(2, dtype=torch.float64, generator=gen, requires_grad=True)
    kernel = torch.from_numpy(kernel_points(15, 0.8)).double()
    influence = find(queries, supports, neighbors).influence(kernel, sigma)

    def convolve(f: torch.Tensor, w: torch.Tensor, b: torch.Tensor) -> torch.Tensor:
        return kernel_point_convolution(f, neighbors, influence, w, b)

    assert torch.autograd.gradcheck(convolve, (features, weights, bias))


@settings(max_examples=25, deadline=None)
@given(st.integers(1, 12), st.integers(1, 5), st.integers(1, 4), st.integers(0, 10**6))
def test_max_pool_equals_gathering(n: int, slots: int, width: int, seed: int) -> None:
    gen = torch.Generator().manual_seed(seed)
    features = torch.randint(-2, 3, (n, width), generator=gen).double()  # many ties
    neighbors = torch.randint(0, n + 1, (n, slots), generator=gen)
    want = torch.cat([features, features.new_zeros(1, width)])[neighbors].amax(1)
    assert torch.equal(max_pool(features, neighbors), want)
    assert torch.equal(max_pool(features.requires_grad_(), neighbors), want)


def test_max_pool_gradient_goes_to_the_maximum() -> None:
    gen = torch.Generator().manual_seed(0)
    features = torch.randn(40, 5, dtype=torch.float64, generator=gen).requires_grad_()
    neighbors = torch.stack([torch.randperm(41, generator=gen)[:6] for _ in range(30)])
    upstream = torch.rand(30, 5, dtype=torch.float64, generator=gen)
    padded = torch.cat([features, features.new_zeros(1, 5)])
    got, want = (
        torch.autograd.grad(out, features, upstream)[0]
        for out in (max_pool(features, neighbors), padded[neighbors].amax(1))
    )
    assert torch.allclose(got, want)


@pytest.mark.parametrize("n", [1, 2, 50])
def test_group_norm_equals_torch(n: int) -> None:
    norm = PointGroupNorm(12, 4, per_cloud=False)
    torch.nn.init.normal_(norm.weight)
    torch.nn.init.normal_(norm.bias)
    features = torch.randn(n, 12) * 3 + 100
    want = torch.nn.functional.group_norm(features.t()[None], 4, norm.weight, norm.bias)[0].t()
    got = norm(features, (n, 0))
    assert got.shape == (n, 12)
    assert torch.allclose(got, want, atol=2e-4)


@pytest.mark.parametrize("slope", [1.0, 0.1])
def test_group_norm_gradients(slope: float) -> None:
    gen = torch.Generator().manual_seed(0)
    values = [torch.randn(shape, dtype=torch.float64, generator=gen) for shape in ((7, 6), (6,), (6,))]
    inputs = [value.requires_grad_() for value in values]
    assert torch.autograd.gradcheck(lambda f, w, b: group_norm(f + 5, (4, 3), w, b, 2, slope), inputs)


@pytest.mark.parametrize("slope", [1.0, 0.1])
def test_norm_of_many_clouds_at_once_equals_that_of_each(slope: float) -> None:
    lengths = (40, 1, 300, 7, 90)
    gen = torch.Generator().manual_seed(1)
    shapes = ((sum(lengths), 12), (12,), (12,))
    values = [torch.randn(shape, dtype=torch.float64, generator=gen) for shape in shapes]
    upstream = torch.randn(shapes[0], dtype=torch.float64, generator=gen)

    def gradients(norm: Callable[..., Tensor]) -> list[Tensor]:
        inputs = [value.clone().requires_grad_() for value in values]
        out = norm(inputs[0] * 3 + 100, lengths, inputs[1], inputs[2], 4, slope)
        return [out, *torch.autograd.grad(out, inputs, upstream)]

    for got, want in zip(gradients(all_at_once), gradients(group_norm), strict=True):
        assert torch.allclose(got, want, rtol=1e-9, atol=1e-9)


def test_per_cloud_norm_ignores_the_other_cloud() -> None:
    mine, other = torch.randn(30, 8), torch.randn(20, 8) * 9
    stacked, apart = PointGroupNorm(8, 2, per_cloud=False), PointGroupNorm(8, 2, per_cloud=True)
    first, second = torch.cat([mine, other]), torch.cat([mine, other + 50])
    assert torch.equal(apart(first, (30, 20))[:30], apart(second, (30, 20))[:30])
    assert not torch.allclose(stacked(first, (30, 20))[:30], stacked(second, (30, 20))[:30])


def test_upsampling_a_shadow_gives_zeros() -> None:
    got = upsample(torch.ones(3, 2), torch.tensor([0, 3, 2]))
    assert got.tolist() == [[1, 1], [0, 0], [1, 1]]


def test_linear_on_joined_equals_linear_after_joining() -> None:
    layer = torch.nn.Linear(7, 4).double()
    coarse, skip = torch.randn(3, 5, dtype=torch.float64), torch.randn(6, 2, dtype=torch.float64)
    nearest = torch.tensor([0, 2, 3, 1, 1, 0])  # 3 is the shadow
    want = layer(torch.cat([upsample(coarse, nearest), skip], dim=1))
    assert torch.allclose(linear_on_joined(layer, coarse, nearest, skip), want)


def test_kernel_points_are_spread() -> None:
    points = kernel_points(15, 2.0).astype(np.float64)
    radius = np.linalg.norm(points, axis=1)
    apart = np.linalg.norm(points[:, None] - points[None], axis=-1) + 9 * np.eye(15)
    assert radius[0] == 0
    assert radius[1:].mean() == pytest.approx(1.32, abs=1e-5)
    assert apart.min() > 0.8
    turned = kernel_points(15, 2.0, np.random.default_rng(3))
    assert not np.allclose(points, turned, atol=0.1)
    assert np.array_equal(turned, kernel_points(15, 2.0, np.random.default_rng(3)))


@FORMS
def test_cylindrical_features_do_not_feel_a_turn_about_the_vertical(find: Any) -> None:
    rng = np.random.default_rng(5)
    points = torch.from_numpy(rng.uniform(-3, 3, (60, 3)).astype(np.float32))
    turned = points @ torch.tensor([[0.6, 0.8, 0.0], [-0.8, 0.6, 0.0], [0.0, 0.0, 1.0]])
    neighbors = torch.cdist(points, points).topk(12, largest=False).indices
    features = torch.from_numpy(rng.normal(size=(60, 4)).astype(np.float32))

    def convolved(cloud: torch.Tensor, cylindrical: bool) -> torch.Tensor:
        torch.manual_seed(0)
        kernel = cylindrical_kernel_points(15, 2.0) if cylindrical else kernel_points(15, 2.0)
        conv = KPConv(4, 8, 1.0, kernel)
        links = find(cloud, cloud, neighbors, cylindrical=cylindrical)
        return conv(features, neighbors, links.influence(conv.kernel, conv.sigma)).detach()

    assert torch.allclose(convolved(points, True), convolved(turned, True), atol=1e-5)
    assert not torch.allclose(convolved(points, False), convolved(turned, False), atol=1e-2)


def test_cylindrical_kernel_points_cover_the_half_disc() -> None:
    for count in (8, 15, 24):
        points = cylindrical_kernel_points(count, 2.0)
        assert points.shape == (count, 3)
        assert (points[:, 0] > -1e-6).all()
        assert (points[:, 1] == 0.0).all()
        assert len(np.unique(points.round(3), axis=0)) == count
        assert np.linalg.norm(points, axis=1).max() == pytest.approx(1.8, abs=1e-5)
