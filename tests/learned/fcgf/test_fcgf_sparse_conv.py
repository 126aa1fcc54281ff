# SPDX-License-Identifier: MIT
"""Sparse convolution against torch's dense one, its gradients, and the grids that it works on."""

from __future__ import annotations

import numpy as np
import pytest
import torch
from torch.nn import functional as F

from hybridreg.learned.layers import sparse_conv, voxel_keys
from hybridreg.learned.layers.kernel_maps import kernel_map, kernel_offsets
from hybridreg.learned.layers.sparse_conv import SparseConv, convolve
from hybridreg.learned.layers.voxels import VoxelPyramid, quantise

LOW, SIDE = -7, 16


def pyramid(strides: tuple[int, ...] = (1, 2, 4), n: int = 260, clouds: int = 2) -> VoxelPyramid:
    """Random voxels, negative coordinates among them."""
    generator = torch.Generator().manual_seed(n)
    coords = torch.randint(LOW, LOW + SIDE, (n, 3), generator=generator)
    cloud = torch.randint(0, clouds, (n, 1), generator=generator)
    return VoxelPyramid(torch.unique(torch.cat([cloud, coords], 1), dim=0), strides)


def dense(features: torch.Tensor, coords: torch.Tensor, kernel: torch.Tensor, size: int) -> torch.Tensor:
    """torch's cross-correlation of the whole grid, (clouds, D, z, y, x), from the coordinate LOW on."""
    clouds = int(coords[:, 0].max()) + 1
    grid = torch.zeros(clouds, features.shape[1], SIDE, SIDE, SIDE)
    cloud, x, y, z = (coords - torch.tensor([0, LOW, LOW, LOW])).unbind(1)
    grid[cloud, :, z, y, x] = features
    weight = kernel.view(size, size, size, *kernel.shape[1:]).permute(4, 3, 0, 1, 2)
    before = size // 2 if size % 2 else 0
    return F.conv3d(F.pad(grid, (before, size - 1 - before) * 3), weight)


@pytest.mark.parametrize("few", [0, 4])
@pytest.mark.parametrize("size", [2, 3, 4, 5, 7])
@pytest.mark.parametrize("strided", [False, True])
def test_equals_the_dense_convolution(
    size: int, strided: bool, few: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sparse_conv, "FEW_CHANNELS", few)
    voxels = pyramid()
    features, kernel = torch.randn(len(voxels.levels[0]), 3), torch.randn(size**3, 3, 5)
    level = 1 if strided else 0
    found = convolve(features, kernel, voxels.map(size, 0, level))
    cloud, x, y, z = voxels.levels[level].unbind(1)
    inside = (torch.stack([x, y, z]) >= LOW).all(
        0
    )  # the low corner of a cell may lie outside of the dense grid
    whole = dense(features, voxels.levels[0], kernel, size)
    want = whole[cloud[inside], :, z[inside] - LOW, y[inside] - LOW, x[inside] - LOW]
    assert inside.float().mean() > 0.6
    assert torch.allclose(found[inside], want, atol=1e-4)


@pytest.mark.parametrize("size", [2, 3, 5])
def test_transposed_is_the_adjoint(size: int) -> None:
    voxels = pyramid()
    pairs = voxels.map(size, 0, 1)
    x, y = torch.randn(len(voxels.levels[0]), 6).double(), torch.randn(len(voxels.levels[1]), 5).double()
    kernel = torch.randn(size**3, 6, 5).double()
    back = convolve(y, kernel.transpose(1, 2), pairs, transposed=True)
    assert float((convolve(x, kernel, pairs) * y).sum()) == pytest.approx(float((x * back).sum()), rel=1e-9)


@pytest.mark.parametrize("channels", [2, 6])
@pytest.mark.parametrize("transposed", [False, True])
def test_gradients(channels: int, transposed: bool) -> None:
    voxels = pyramid(n=14, clouds=1)
    rows = voxels.levels[1 if transposed else 0]
    features = torch.randn(len(rows), channels, dtype=torch.float64, requires_grad=True)
    kernel = torch.randn(27, channels, 2, dtype=torch.float64, requires_grad=True)
    pairs = voxels.map(3, 0, 1)
    assert torch.autograd.gradcheck(
        lambda f, k: convolve(f, k, pairs, transposed=transposed), (features, kernel)
    )


def test_voxels_without_neighbours_give_zeros() -> None:
    voxels = VoxelPyramid(torch.tensor([[0, 0, 0, 0], [0, 50, 0, 0], [1, 0, 1, 0]]), (1, 2))
    kernel = torch.ones(27, 5, 2)
    kernel[13] = 0.0
    assert torch.equal(convolve(torch.ones(3, 5), kernel, voxels.map(3, 0, 0)), torch.zeros(3, 2))


def test_a_kernel_of_one_is_a_matrix() -> None:
    layer = SparseConv(4, 3, 1, bias=True)
    assert layer.kernel.shape == (4, 3)
    assert layer.bias is not None
    assert layer.bias.shape == (1, 3)
    features = torch.randn(7, 4)
    assert torch.allclose(layer(features, None), features @ layer.kernel + layer.bias)


def test_offsets_turn_x_fastest() -> None:
    assert kernel_offsets(3)[:4].tolist() == [[-1, -1, -1], [0, -1, -1], [1, -1, -1], [-1, 0, -1]]
    assert kernel_offsets(2).tolist() == [[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1)]
    assert kernel_offsets(5)[62].tolist() == [0, 0, 0]


def test_strides_floor_towards_minus_infinity() -> None:
    coords = torch.tensor([[0, -1, 0, 3], [0, -2, 1, 2], [0, -3, 1, 2], [1, -1, 0, 3]])
    levels = VoxelPyramid(coords, (1, 2, 6)).levels
    assert sorted(levels[1].tolist()) == [[0, -4, 0, 2], [0, -2, 0, 2], [1, -2, 0, 2]]
    assert sorted(levels[2].tolist()) == [[0, -6, 0, 0], [1, -6, 0, 0]]


def test_the_first_point_of_a_voxel_stands_for_it() -> None:
    points = torch.tensor(
        [[0.9, 0.1, 0.1], [-0.1, 0.0, 0.0], [0.2, 0.2, 0.2], [-0.4, 0.1, 0.3], [0.9, 0.6, 0.1]]
    )
    rows, coords = quantise(points, 0.5)
    assert rows.tolist() == [0, 1, 2, 4]
    rows, coords = quantise(points, 1.0)
    assert rows.tolist() == [0, 1]
    assert coords.tolist() == [[0, 0, 0], [-1, 0, 0]]


def test_many_points_as_numpy_sees_them() -> None:
    points = np.random.default_rng(0).normal(0, 5, (4000, 3)).astype(np.float32)
    rows, coords = quantise(torch.from_numpy(points), 0.7)
    want = np.floor(points / np.float32(0.7)).astype(int)
    _, first = np.unique(want, axis=0, return_index=True)
    assert rows.tolist() == sorted(first)
    assert np.array_equal(coords.numpy(), want[np.sort(first)])


@pytest.mark.parametrize("far", [1e8, float("inf"), float("nan")])
def test_points_that_float32_cannot_place_are_refused(far: float) -> None:
    with pytest.raises(
        ValueError, match=r"voxels of 0\.3 m from the origin.*larger voxel, or shift the cloud"
    ):
        quantise(torch.tensor([[0.0, 0.0, 0.0], [far, 0.0, 0.0]]), 0.3)


def test_no_points_are_refused() -> None:
    with pytest.raises(ValueError, match="without points"):
        quantise(torch.zeros(0, 3), 0.3)


def test_voxels_that_cannot_be_numbered_are_refused() -> None:
    far = torch.tensor([[0, 0, 0, 0], [0, 2**23, 2**23, 2**23]])
    with pytest.raises(ValueError, match="cannot be numbered: a stray point"):
        VoxelPyramid(far, (1, 2))


@pytest.mark.parametrize("size", [2, 3, 5])
@pytest.mark.parametrize("stride", [1, 2])
def test_neighbours_are_the_same_from_a_table_and_from_a_search(
    size: int, stride: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    levels = pyramid(strides=(1, stride)).levels[-1]
    looked_up = kernel_map(levels, levels, size, stride).table
    if size > 2:
        assert torch.equal(kernel_map(levels, levels, size + 2, stride).narrower(size).table, looked_up)
    monkeypatch.setattr(voxel_keys, "_CELLS_PER_VOXEL", 0)
    searched = kernel_map(levels, levels, size, stride).table
    assert torch.equal(searched, looked_up)
    assert 0 < int((searched == len(levels)).sum()) < searched.numel()


def test_pairs_by_output_are_those_of_each_output_in_the_order_of_the_kernel() -> None:
    pairs = pyramid().map(3, 0, 1).pairs
    order, first = pairs.by_output
    assert pairs.output[order].diff().min() == 0
    assert torch.equal(order, pairs.output.argsort(stable=True))
    assert torch.equal(pairs.output[order][first], torch.arange(pairs.n_output))
