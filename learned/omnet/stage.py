# SPDX-License-Identifier: MIT
"""OMNet as a stage."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from hybridreg.geometry import se3
from hybridreg.learned.stages.network_stage import NetworkStage
from hybridreg.matches import Correspondences, Pose
from hybridreg.scene import Scene

if TYPE_CHECKING:
    from hybridreg.learned.omnet.network import OmnetNetwork

    pass


@dataclass(frozen=True, kw_only=True)
class OmNet(NetworkStage):
    """Regress the pose from the clouds alone, in four iterations on the predicted overlap (Xu et al. 2021).

    Uses a random sample of the levels' points (of the size in its configuration), each cloud centred at its viewpoint,
    both divided by the larger radius. Matches are not used. The published weights are for objects rotated by less than
    45 degrees about each axis.

    Parameters
    ----------
    points : int or None
        Points of each cloud that are used; None takes the configuration's. Cost is proportional to it.
    """

    points: int | None = None

    kind: ClassVar[str] = "omnet"
    shipped: ClassVar[str] = "omnet-small"
    parts: ClassVar[frozenset[str]] = frozenset({"encoder", "fusion", "decoder", "regression"})

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.points is not None and not self.points >= 1:
            raise ValueError(f"points={self.points} must be at least 1")

    def __call__(self, scene: Scene, matches: Correspondences, rng: np.random.Generator) -> Pose:
        from hybridreg.learned.memory_estimate import require_bytes
        from hybridreg.learned.omnet.batch import make_batch
        from hybridreg.learned.stages.tensor_values import array

        network: OmnetNetwork = self.network()
        self.note_random(scene)
        levels = (scene.target, scene.source)
        points = self.points or network.config.points
        if any(len(level) > points for level in levels):
            scene.note(f"OMNet used {points} of {len(levels[1])} source and {len(levels[0])} target points")
        batch, units = make_batch(
            levels[0].points,
            levels[1].points,
            points,
            rng,
            centres=(levels[0].centre, levels[1].centre),
            device=self.device,
        )
        require_bytes(network.memory(batch), (points, points), self.device, "use fewer with points=...")
        with self.inference():
            found = array(network(batch).transform)[0]
        if not np.isfinite(found).all():
            scene.note("OMNet gave no finite pose")
            return Pose.unknown(len(matches))
        return Pose(units.metres(se3.from_rt(se3.project(found[:, :3]), found[:, 3])))
