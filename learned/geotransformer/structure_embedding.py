# SPDX-License-Identifier: MIT
"""GeoTransformer's geometric structure embedding: distances and angles between superpoints (docs/methods.md 6.6)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import reduce

import torch
from torch import Tensor, nn

from hybridreg.learned.layers.curve_table import between, interpolate, sample_positions
from hybridreg.learned.layers.distances import squared_distances
from hybridreg.learned.layers.positions import frequencies, sinusoids
from hybridreg.learned.layers.sparse_rows import Bags

# Values of the (rows, n, k, d) angle tensor computed in one go: 16 MB, whatever the number of superpoints.
_CHUNK_VALUES = 2**22


@dataclass(frozen=True)
class StructureTable:
    """The embedding of all pairs of superpoints, for products with it alone.

    Both parts of a pair's vector are read from curves, so that its product with anything is an interpolation of the
    curves' products: a few hundred samples in the place of n * n vectors.
    """

    curves: Tensor  # (T, d): samples of the distance's curve, then of the angle's
    pairs: Bags  # (n * n, n * T): pair (i, j) in the table of superpoint i

    def products(self, vectors: Tensor) -> Tensor:
        """Products (h, n, n) of the vectors (n, h, d) of each superpoint with its n embeddings."""
        n, heads, _ = vectors.shape
        table = (vectors @ self.curves.T).transpose(1, 2)  # (n, T, h)
        return self.pairs.sum(table.reshape(-1, heads)).view(n, n, heads).permute(2, 0, 1)


class StructureEmbedding(nn.Module):
    """One vector for each ordered pair of superpoints, invariant to rigid motion.

    ``sigma_d`` in metres and ``sigma_a`` in degrees scale distance and angle; ``angle_k`` nearest superpoints
    span the angles.
    """

    frequency: Tensor

    def __init__(self, dim: int, sigma_d: float, sigma_a: float, angle_k: int) -> None:
        super().__init__()
        self.sigma_d, self.angle_k = sigma_d, angle_k
        self.angle_scale = 180.0 / (sigma_a * math.pi)
        self.register_buffer("frequency", frequencies(dim))
        self.distance, self.angle = nn.Linear(dim, dim), nn.Linear(dim, dim)

    def forward(self, points: Tensor) -> Tensor:
        """(n, 3) metres to (n, n, d)."""
        distance, nearest = self._neighbors(points)
        curves = self._curves(distance)
        k = nearest.shape[1]
        rows = max(1, _CHUNK_VALUES // (len(points) * max(k, 1) * self.distance.in_features))
        blocks = torch.arange(len(points), device=points.device).split(rows)
        return torch.cat([self._rows(points, distance[b], nearest[b], b, curves) for b in blocks])

    def table(self, points: Tensor) -> StructureTable | Tensor:
        """As `forward`, in a form for products where that is possible: with one angle a pair.

        Of several angles the largest counts channel by channel, which no product can be exchanged with.
        """
        n = len(points)
        if self.angle_k > 1 or n < 2:
            return self(points)
        distance, nearest = self._neighbors(points)
        angle = neighbor_angles(points, points, points[nearest])[:, :, 0] * self.angle_scale
        curves = self._curves(distance)
        by_distance, by_angle = between(distance.flatten()), between(angle.flatten())
        index = torch.cat([by_distance[0], by_angle[0] + len(curves[0])], dim=1)  # (n * n, 8)
        samples = len(curves[0]) + len(curves[1])
        index += samples * torch.arange(n, device=points.device).repeat_interleave(n)[:, None]
        weight = torch.cat([by_distance[1], by_angle[1]], dim=1)
        starts = torch.arange(0, index.numel(), index.shape[1], device=points.device)
        return StructureTable(torch.cat(curves), Bags(index.flatten(), weight.flatten(), starts, n * samples))

    def _neighbors(self, points: Tensor) -> tuple[Tensor, Tensor]:
        """Distances (n, n) in units of sigma_d, and the nearest others (n, k)."""
        distance = squared_distances(points, points).sqrt()
        k = min(self.angle_k, len(points) - 1)
        return distance / self.sigma_d, distance.topk(k + 1, largest=False)[1][:, 1:]

    def _curves(self, distance: Tensor) -> tuple[Tensor, Tensor]:
        return (
            self._curve(self.distance, float(distance.max())),
            self._curve(self.angle, math.pi * self.angle_scale),
        )

    def _rows(
        self, points: Tensor, distance: Tensor, nearest: Tensor, block: Tensor, curves: tuple[Tensor, Tensor]
    ) -> Tensor:
        embedding = interpolate(curves[0], distance)  # (b, n, d)
        if nearest.shape[1] == 0:  # a single superpoint spans no angle
            return embedding
        angles = neighbor_angles(points[block], points, points[nearest]) * self.angle_scale  # (b, n, k)
        # One by one: the gradient of a maximum over a dimension needs four more passes.
        return embedding.add_(reduce(torch.maximum, interpolate(curves[1], angles).unbind(2)))

    def _curve(self, layer: nn.Linear, highest: float) -> Tensor:
        """Samples of the embedding of a number: n^2 (k + 1) sines and products would give no more accuracy."""
        return layer(sinusoids(sample_positions(highest, self.frequency), self.frequency))


def neighbor_angles(anchors: Tensor, points: Tensor, nearest: Tensor) -> Tensor:
    """Angles (b, n, k) in radians at anchors (b, 3), between points (n, 3) and neighbours (b, k, 3)."""
    to_point = (points[None] - anchors[:, None])[:, :, None]  # (b, n, 1, 3)
    to_near = (nearest - anchors[:, None])[:, None]  # (b, 1, k, 3)
    to_point, to_near = torch.broadcast_tensors(to_point, to_near)
    sine = torch.linalg.cross(to_near, to_point, dim=-1).norm(dim=-1)
    return torch.atan2(sine, (to_near * to_point).sum(-1))
