# SPDX-License-Identifier: MIT
"""Networks that take z for the vertical, and sensors that do not stand upright."""

from __future__ import annotations

import numpy as np
import pytest

import hybridreg as hr
from hybridreg.eval.score import metrics
from hybridreg.geometry import ground, se3
from hybridreg.learned.stages import encoding
from hybridreg.learned.stages.levelling import Turns, likeness
from hybridreg.pair import LabelledPair, Pair
from hybridreg.scene import Scene

CROSS3DREG = hr.Pipeline.preset("cross3dreg")


@pytest.fixture(scope="module")
def pair() -> LabelledPair:
    """Two different sensors of the simulator, both upright."""
    from hybridreg.data.catalogue import open_dataset

    return open_dataset("sim:val/near#6")[5]


def hung(pair: LabelledPair, tilt_deg: float) -> LabelledPair:
    """The same pair with the source's sensor hung another way."""
    R = se3.rotation_about(np.radians([tilt_deg, 0.0, 0.0]))
    moved = Pair.of(pair.pair.source.points @ R.T, pair.pair.target.points, pair.pair.image, id=pair.pair.id)
    return LabelledPair(
        pair=moved, T_target_source=pair.T_target_source @ se3.inverse(se3.from_rt(R, np.zeros(3)))
    )


@pytest.mark.parametrize("tilt_deg", [0.0, 40.0, 90.0, 178.0])
def test_a_sensor_may_hang_in_any_way(pair: LabelledPair, tilt_deg: float) -> None:
    tilted = hung(pair, tilt_deg)
    result = CROSS3DREG.run(tilted.pair)
    assert is_right(result.transformation, tilted.T_target_source)


def test_a_wall_taken_for_the_ground_does_no_harm(
    pair: LabelledPair, monkeypatch: pytest.MonkeyPatch
) -> None:
    wall = ground.Ground(np.array([1.0, 0.0, 0.0]), -2.0)
    found = iter([None, wall])  # the target's is asked for first
    monkeypatch.setattr(ground, "under", lambda points, viewpoint, spacing: next(found, None))
    result = CROSS3DREG.run(pair.pair)
    assert is_right(result.transformation, pair.T_target_source)


def test_clouds_that_stand_upright_are_encoded_once(
    pair: LabelledPair, monkeypatch: pytest.MonkeyPatch
) -> None:
    runs: list[Turns] = []
    whole = encoding._encode_turned
    monkeypatch.setattr(
        encoding,
        "_encode_turned",
        lambda scene, stage, turns: runs.append(turns) or whole(scene, stage, turns),
    )
    encoding.encode(scene_of(pair.pair), CROSS3DREG.match)
    assert len(runs) == 1
    encoding.encode(scene_of(hung(pair, 60.0).pair), CROSS3DREG.match)
    assert len(runs) == 3


def test_points_come_back_to_where_the_cloud_has_them(pair: LabelledPair) -> None:
    scene = scene_of(hung(pair, 70.0).pair)
    turns = Turns.upright(scene)
    assert turns is not None
    given = encoding._encode_turned(scene, CROSS3DREG.match, Turns.none())
    levelled = encoding._encode_turned(scene, CROSS3DREG.match, turns)
    assert likeness(levelled) > likeness(given)
    # Centroids of a few points each, on grids that lie askew: no farther from the level than a cell reaches.
    gaps = np.linalg.norm(levelled.source.points.numpy()[:, None] - scene.source.points[None], axis=2).min(1)
    assert gaps.max() < CROSS3DREG.match.network().config.backbone.fine_voxel


def is_right(found: np.ndarray, truth: np.ndarray) -> bool:
    return bool(metrics.rre_deg(found, truth) < 2.0 and metrics.rte_m(found, truth) < 0.5)


def scene_of(pair: Pair) -> Scene:
    return CROSS3DREG.downsample(pair)
