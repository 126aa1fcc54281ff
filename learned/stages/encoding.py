# SPDX-License-Identifier: MIT
"""Encoding of a pair by a network, computed once a run for all stages that use the same network."""

from __future__ import annotations

from typing import TYPE_CHECKING

from hybridreg.learned.cross3dreg.batch import Batch, make_batch
from hybridreg.learned.cross3dreg.encodings import Encoding
from hybridreg.learned.memory_estimate import require_memory
from hybridreg.learned.stages.levelling import Turns, likeness
from hybridreg.learned.stages.network_grid import note_grid
from hybridreg.learned.stages.network_stage import NetworkStage
from hybridreg.scene import Scene

if TYPE_CHECKING:
    from hybridreg.learned.cross3dreg.network import RegistrationNetwork


def encode(scene: Scene, stage: NetworkStage) -> Encoding:
    """The pair after the encoders of a stage's network."""
    return stage.once(scene, lambda: _encode(scene, stage))


def _encode(scene: Scene, stage: NetworkStage) -> Encoding:
    network: RegistrationNetwork = stage.network()
    if network.image_encoder is not None and not (stage.sees() and scene.pair.has_image):
        why = "no image" if not scene.pair.has_image else "the network was trained without images"
        scene.note(f"{why}: features come from the clouds alone, with a learned token instead of the image")
    # Cylindrical kernel points take z as the vertical, and sensors may be mounted in any orientation. The ground shows
    # it, unless a wall was taken for the ground: both are tried.
    upright = Turns.upright(scene) if network.config.backbone.kernel == "cylindrical" else None
    with stage.inference():
        as_given = _encode_turned(scene, stage, Turns.none())
        if upright is None:
            return as_given
        levelled = _encode_turned(scene, stage, upright)
        return max(as_given, levelled, key=likeness)


def _encode_turned(scene: Scene, stage: NetworkStage, turns: Turns) -> Encoding:
    batch = _batch(scene, stage, turns)
    network: RegistrationNetwork = stage.network()
    require_memory(batch.pyramid, network.config)
    return turns.back(network.encode(batch))


def _batch(scene: Scene, stage: NetworkStage, turns: Turns) -> Batch:
    # A network's filters have the size of the voxel that it was trained with. Levels of that voxel are used directly;
    # others have a density that it never saw, so it makes its own from the clouds.
    config = stage.network().config
    voxel = config.backbone.voxel
    ready = note_grid(scene, voxel)
    source, target = (scene.source, scene.target) if ready else (scene.pair.source, scene.pair.target)
    return make_batch(
        target.points @ turns.target.T,
        source.points @ turns.source.T,
        config,
        image=scene.pair.image if stage.sees() else None,
        subsample=not ready,
        device=stage.device,
    )
