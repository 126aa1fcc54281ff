# SPDX-License-Identifier: MIT
"""Convolutions over the graph of a cloud's own superpoints (DGCNN, Wang et al. 2019), found by coordinates."""

from __future__ import annotations

from collections.abc import Iterator

import torch
from torch import Tensor, nn
from torch.nn import functional as F

from hybridreg.learned.layers.distances import squared_distances
from hybridreg.learned.layers.instance_norm import instance_norm
from hybridreg.learned.layers.message_attention import Clouds, MessageBlock

_SLOPE = 0.2


def nearest_others(points: Tensor, count: int) -> Tensor:
    """(n, k) int64: the ``count`` points nearest to each of (n, 3), without itself.

    A cloud of fewer than ``count + 1`` points, with which the published code fails, gives as many as there are; a
    single point is its own neighbour.
    """
    if len(points) == 1:
        return torch.zeros(1, 1, dtype=torch.int64, device=points.device)
    distance = squared_distances(points, points)
    return distance.topk(min(count + 1, len(points)), dim=1, largest=False).indices[:, 1:]


class EdgeConvolution(nn.Module):
    """Maximum over the neighbours of a linear layer on [centre, neighbour - centre], normalised, with a LeakyReLU.

    The layer is applied to the points before their features are gathered: k times fewer products. Normalisation and
    LeakyReLU are monotonic, so they follow the maximum; the statistics are still those of all edges.
    """

    def __init__(self, dim_in: int, dim_out: int) -> None:
        super().__init__()
        self.linear = nn.Linear(2 * dim_in, dim_out, bias=False)

    def forward(self, features: Tensor, neighbors: Tensor) -> Tensor:
        """(n, C_in) and (n, k) to (n, C_out)."""
        of_centre, of_neighbor = self.linear.weight.chunk(2, dim=1)
        centre = F.linear(features, of_centre - of_neighbor)
        edges = F.embedding(neighbors, F.linear(features, of_neighbor)) + centre[:, None]  # (n, k, C_out)
        variance, mean = torch.var_mean(edges, dim=(0, 1), correction=0)
        largest = edges.max(1).values
        return F.leaky_relu((largest - mean) * (variance + 1e-5).rsqrt(), _SLOPE)


class GraphLayer(nn.Module):
    """Two edge convolutions over the same neighbours, and a layer on input, first and second. No residual."""

    def __init__(self, dim: int) -> None:
        super().__init__()
        self.first = EdgeConvolution(dim, dim)
        self.second = EdgeConvolution(dim, 2 * dim)
        self.join = nn.Linear(4 * dim, dim, bias=False)

    def forward(self, features: Tensor, neighbors: Tensor) -> Tensor:
        """(n, C) and (n, k) to (n, C)."""
        first = self.first(features, neighbors)
        second = self.second(first, neighbors)
        joined = self.join(torch.cat([features, first, second], 1))
        return F.leaky_relu(instance_norm(joined), _SLOPE)


class GraphNetwork(nn.Module):
    """Blocks over each cloud's own graph ("self") and of attention to the other cloud ("cross")."""

    def __init__(self, dim: int, neighbors: int, heads: int, blocks: tuple[str, ...]) -> None:
        super().__init__()
        self.neighbors = neighbors
        self.layers = nn.ModuleList(
            MessageBlock("cross", dim, heads) if kind == "cross" else GraphLayer(dim) for kind in blocks
        )

    def forward(self, clouds: Clouds, points: Clouds) -> Clouds:
        """Features (n, C), (m, C) and points (n, 3), (m, 3) of source and target."""
        return [clouds, *self.steps(clouds, points)][-1]

    def steps(self, clouds: Clouds, points: Clouds) -> Iterator[Clouds]:
        """Features of both clouds after each block."""
        neighbors = [nearest_others(cloud, self.neighbors) for cloud in points]
        for layer in self.layers:
            if isinstance(layer, MessageBlock):
                clouds = layer(clouds)
            else:
                clouds = (layer(clouds[0], neighbors[0]), layer(clouds[1], neighbors[1]))
            yield clouds
