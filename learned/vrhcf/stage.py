# SPDX-License-Identifier: MIT
"""SphereNet's descriptors as a matcher."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from hybridreg.learned.stages.network_grid import on_grid
from hybridreg.learned.stages.network_stage import NetworkStage
from hybridreg.matches import Correspondences, Overlap
from hybridreg.scene import Level, Scene

if TYPE_CHECKING:
    from hybridreg.learned.vrhcf.config import SphereNetConfig
    from hybridreg.learned.vrhcf.network import SphereNet

Array = NDArray[np.float64]
Rows = NDArray[np.int64]

# Multiply-adds for both clouds that a stage may take by default: about a minute of one CPU core, and of a GPU.
_CPU_BUDGET = 1.5e12
_GPU_BUDGET = 4e14
_MOST = 5_000  # keypoints of a cloud; as in the published scripts
_FEWEST = 100  # keypoints that an overlap mask must leave; by hand


@dataclass(frozen=True, kw_only=True)
class Vrhcf(NetworkStage):
    """Spherical descriptors of single keypoints, nearest neighbours in one direction (Zhao et al., ICME 2024).

    With the estimator "hcf" this is VRHCF. The published descriptor takes 2.9 G multiply-adds a keypoint, a thousand
    times what RoITr takes: without `max_keypoints` as many are described as the device can do in about a minute, and a
    warning before the start and a note in the result say how many.

    Parameters
    ----------
    min_overlap : float in [0, 1]
        Keypoints with a lower probability of overlap are left out, unless too few would remain.
    max_keypoints : int or None
        Of a cloud, drawn at random; None as above.
    matching : "channels", "unit" or None
        How descriptors are normalised: None as the network's configuration says, "channels" for official weights, as
        released; "unit" is the correct one (`hybridreg.learned.vrhcf.keypoint_matching`).
    mutual : bool
        Keep only matches that are nearest both ways; published is without, so that each keypoint has a match.
    """

    min_overlap: float = 0.5
    max_keypoints: int | None = None
    matching: Literal["channels", "unit"] | None = None
    mutual: bool = False

    kind: ClassVar[str] = "vrhcf"
    shipped: ClassVar[str] = "vrhcf-small"
    gives: ClassVar[frozenset[str]] = frozenset({"matches"})
    parts: ClassVar[frozenset[str]] = frozenset({"layers"})

    def __post_init__(self) -> None:
        super().__post_init__()
        if not 0.0 <= self.min_overlap <= 1.0:
            raise ValueError(f"min_overlap={self.min_overlap} must lie in [0, 1]")
        if self.max_keypoints is not None and self.max_keypoints < 3:
            raise ValueError(
                f"max_keypoints={self.max_keypoints} must be at least 3: fewer matches fix no pose"
            )

    def __call__(self, scene: Scene, overlap: Overlap) -> Correspondences:
        import torch

        from hybridreg.learned.memory_estimate import require_bytes
        from hybridreg.learned.stages.tensor_values import array
        from hybridreg.learned.vrhcf.batch import make_batch
        from hybridreg.learned.vrhcf.keypoint_matching import match_descriptors
        from hybridreg.learned.vrhcf.upright_frames import place

        network: SphereNet = self.network()
        self.note_random(scene)
        config = network.config
        clouds = on_grid(scene, config.voxel)
        levels = ((overlap.target, scene.target), (overlap.source, scene.source))
        rows = [self._rows(points, *level) for points, level in zip(clouds, levels, strict=True)]
        rows = self._capped(scene, rows, config)
        # Axes face the origin: with the sensor there, they face the sensor.
        seen_from = [place(level, config.facing) for _, level in levels]
        moved = [points - at for points, at in zip(clouds, seen_from, strict=True)]
        described = (len(rows[0]), len(rows[1]))
        matching = self.matching or config.matching
        with self.inference():
            batch = make_batch(moved[0], moved[1], config, keypoints=(rows[0], rows[1]), device=self.device)
            require_bytes(network.memory(batch), described, self.device, "set max_keypoints to less")
            output = network(batch)
            partner = match_descriptors(output.source, output.target, matching)
            use = torch.ones_like(partner, dtype=torch.bool)
            if self.mutual:
                back = match_descriptors(output.target, output.source, matching)
                use = back[partner] == torch.arange(len(partner), device=partner.device)
            first, second = (
                torch.nn.functional.normalize(d, dim=1) for d in (output.source, output.target[partner])
            )
            cosine = array((first * second).sum(1))
        chosen, kept = partner.cpu().numpy(), use.cpu().numpy()
        return Correspondences(
            source=clouds[1][rows[1]][kept],
            target=clouds[0][rows[0]][chosen][kept],
            weight=np.maximum(cosine, 1e-6)[kept],
            spacing=config.voxel,
        )

    def _rows(self, points: Array, probability: Array, level: Level) -> Rows:
        from hybridreg.learned.stages.spreading import gather

        rows = np.flatnonzero(gather(probability, level.points, points) > self.min_overlap)
        return rows if len(rows) >= min(_FEWEST, len(points)) else np.arange(len(points))

    def _capped(self, scene: Scene, rows: list[Rows], config: SphereNetConfig) -> list[Rows]:
        from hybridreg.learned.vrhcf.cost import multiply_adds

        each = multiply_adds(config)
        budget = _GPU_BUDGET if self.device.startswith("cuda") else _CPU_BUDGET
        most = self.max_keypoints or max(3, min(_MOST, int(budget / each / 2)))
        counts = [min(most, len(r)) for r in rows]
        total = sum(counts) * each
        asked = sum(len(r) for r in rows)
        cost = f"{each / 1e9:.2g} G multiply-adds each, {total / 1e12:.2g} T in all"
        if sum(counts) < asked:
            text = (
                f"VRHCF describes {counts[1]} of {len(rows[1])} source and {counts[0]} of {len(rows[0])} target "
                f"keypoints, drawn at random ({cost}); max_keypoints=... takes more or fewer"
            )
            scene.note(text)
            if self.max_keypoints is None:
                warnings.warn(text, UserWarning, stacklevel=3)
        elif total > budget:
            warnings.warn(f"VRHCF is about to describe {asked} keypoints: {cost}", UserWarning, stacklevel=3)
        rng = np.random.default_rng(0)
        return [np.sort(rng.choice(r, n, replace=False)) for r, n in zip(rows, counts, strict=True)]
