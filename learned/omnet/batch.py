# SPDX-License-Identifier: MIT
"""The input of OMNet: equally many points of every cloud, normalised. No ground truth."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import torch
from torch import Tensor


@dataclass(frozen=True, kw_only=True)
class OmnetBatch:
    """Pairs of point clouds, each pair in its own units."""

    source: Tensor  # (B, N, 3)
    target: Tensor  # (B, M, 3)

    def to(self, device: torch.device | str) -> OmnetBatch:
        """The same batch on another device."""
        return OmnetBatch(source=self.source.to(device), target=self.target.to(device))


@dataclass(frozen=True, kw_only=True)
class Units:
    """How a pair was normalised: p goes to (p - centre) / radius, each cloud with its own centre."""

    source_centre: npt.NDArray[np.float64]  # (3,) metres
    target_centre: npt.NDArray[np.float64]
    radius: float  # metres, of both

    def normalised(self, T: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
        """(4, 4) of metres, from source to target, in the units of the network."""
        out = T.copy()
        out[:3, 3] = (T[:3, :3] @ self.source_centre + T[:3, 3] - self.target_centre) / self.radius
        return out

    def metres(self, T: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
        """The reverse of `normalised`."""
        out = T.copy()
        out[:3, 3] = T[:3, 3] * self.radius + self.target_centre - T[:3, :3] @ self.source_centre
        return out


def make_batch(
    target: npt.NDArray[np.floating],
    source: npt.NDArray[np.floating],
    points: int,
    rng: np.random.Generator,
    *,
    centres: tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]] | None = None,
    device: torch.device | str = "cpu",
) -> tuple[OmnetBatch, Units]:
    """The network's input of a pair: a sample of the points, centred, divided by the larger radius of the two.

    Parameters
    ----------
    target, source
        (M, 3), (N, 3) metres.
    points
        Number of points of each; a cloud with fewer repeats some, as in the published training.
    rng
        Chooses the points. The order of the clouds' points does not matter.
    centres
        Of target and source, such as the sensors' positions; by default the origins.

    Raises
    ------
    ValueError
        A cloud without points, or with all points at its centre.
    """
    at = centres or (np.zeros(3), np.zeros(3))
    clouds = []
    for name, cloud, centre in (("target", target, at[0]), ("source", source, at[1])):
        if len(cloud) == 0:
            raise ValueError(f"{name}: no points to choose {points} from")
        clouds.append(np.asarray(cloud, dtype=np.float64) - centre)
    radius = max(float(np.linalg.norm(cloud, axis=1).max()) for cloud in clouds)
    if not radius > 0.0:
        raise ValueError("target and source have no extent: all points lie at the centre of their cloud")
    chosen = [
        torch.from_numpy((_choice(cloud, points, rng) / radius).astype(np.float32))[None].to(device)
        for cloud in clouds
    ]
    batch = OmnetBatch(source=chosen[1], target=chosen[0])
    return batch, Units(source_centre=at[1], target_centre=at[0], radius=radius)


def _choice(cloud: npt.NDArray[np.float64], points: int, rng: np.random.Generator) -> npt.NDArray[np.float64]:
    cloud = cloud[np.lexsort(cloud.T)]
    whole, rest = divmod(points, len(cloud))
    rows = np.concatenate(
        [np.tile(np.arange(len(cloud)), whole), rng.choice(len(cloud), rest, replace=False)]
    )
    return cloud[rows]


def collate(batches: Sequence[OmnetBatch]) -> OmnetBatch:
    """Several pairs as one batch; a training step needs at least two."""
    return OmnetBatch(
        source=torch.cat([batch.source for batch in batches]),
        target=torch.cat([batch.target for batch in batches]),
    )
