# SPDX-License-Identifier: MIT
"""What of the clouds goes into a batch."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from hybridreg.learned.cross3dreg.batch import make_batch
from hybridreg.learned.cross3dreg.config import BackboneConfig
from hybridreg.learned.cross3dreg.sizes import named_config


def clouds(shift: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(0)
    made = [np.column_stack([rng.uniform(-100, 100, (4000, 2)), rng.uniform(0, 3, 4000)]) for _ in range(2)]
    return made[0] + [shift, 0.0, 0.0], made[1] + [shift, 0.0, 0.0]


@pytest.mark.parametrize("shift", [0.0, 5000.0])
def test_far_points_are_left_out_wherever_the_origin_is(shift: float) -> None:
    nano = named_config("nano")
    config = dataclasses.replace(nano, backbone=dataclasses.replace(nano.backbone, max_range=40.0))
    target, source = make_batch(*clouds(shift), config).pyramid.clouds(0)
    for cloud in (target, source):
        away = cloud[:, :2] - cloud[:, :2].median(dim=0).values
        assert 36.0 < float(away.norm(dim=1).max()) < 44.0


def test_without_a_range_all_points_stay() -> None:
    config = named_config("nano")
    target, _ = make_batch(*clouds(), config).pyramid.clouds(0)
    assert float(target[:, :2].norm(dim=1).max()) > 130.0


def test_a_range_must_be_positive() -> None:
    with pytest.raises(ValueError, match="max_range=0.0 must be positive"):
        BackboneConfig(max_range=0.0)
