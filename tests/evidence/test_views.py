# SPDX-License-Identifier: MIT
"""A cloud as the evidence sees it."""

from __future__ import annotations

import numpy as np
import pytest

import hybridreg as hr
from hybridreg.data.hard import sample
from hybridreg.evidence import views
from hybridreg.pair import Pair


@pytest.mark.parametrize(("kind", "seed"), [("tilt", 3), ("depth-room", 1), ("object", 5), ("building", 7)])
def test_a_prepared_target_has_the_ground_of_a_plain_one(kind: str, seed: int) -> None:
    one = sample(kind, seed)
    # A wall or a table top may look like the ground: of a frame that nobody described, that is tested.
    plain, prepared = (
        views.of(hr.VoxelGrid(voxel=0.5)(Pair.of(one.target, cloud))).target
        for cloud in (one.source, hr.Target(one.source))
    )

    assert (plain.ground is None) == (prepared.ground is None)
    if plain.ground is not None and prepared.ground is not None:
        assert np.array_equal(plain.ground.up, prepared.ground.up)
    assert np.array_equal(plain.centre, prepared.centre)
