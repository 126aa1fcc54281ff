# SPDX-License-Identifier: MIT
"""The relief of open ground, seen by two sensors."""

from __future__ import annotations

import numpy as np
import pytest
from made_fields import MOUND, field_pair

import hybridreg as hr
from hybridreg.evidence import views
from hybridreg.geometry import se3
from hybridreg.geometry.ground_relief import TELLS, Alike, Relief, alike


def reliefs(**how: float) -> tuple[Relief, Relief, np.ndarray]:
    pair, truth = field_pair(**how)
    both = views.of(hr.VoxelGrid()(pair))
    source, target = both.source.relief, both.target.relief
    assert source is not None
    assert target is not None
    return source, target, truth


def test_the_same_ground_is_alike_and_other_ground_is_not() -> None:
    source, target, truth = reliefs()
    told = alike(source, target, truth)
    assert told.correlation > 0.6
    assert told.information > 30.0
    for away in ([4.0, 0.0, 0.0], [0.0, -7.0, 0.0]):
        elsewhere = alike(source, target, se3.from_rt(np.eye(3), np.array(away)) @ truth)
        assert elsewhere.information < 0.2 * told.information


def test_noise_on_a_plane_tells_nothing() -> None:
    source, target, truth = reliefs(bumps=0.0)
    told = alike(source, target, truth)
    assert told.cells > 200
    assert abs(told.correlation) < 0.2


def test_one_mound_on_flat_ground_tells_nothing_and_on_a_field_the_field_does() -> None:
    # A turn about the mound lays it on itself, and the flat ground around it too.
    top = np.array([*MOUND, -1.8])
    for bumps in (0.0, 0.02):
        source, target, truth = reliefs(bumps=bumps, mound=0.25)
        turned = se3.about(top, se3.yaw(90.0)[:3, :3], np.zeros(3)) @ truth
        assert alike(source, target, turned).information < TELLS
        assert (alike(source, target, truth).information > TELLS) == (bumps > 0.0)


def test_a_pair_turned_round_says_the_same() -> None:
    source, target, truth = reliefs()
    there, back = alike(source, target, truth), alike(target, source, se3.inverse(truth))
    assert there.cells == back.cells
    assert there.correlation == pytest.approx(back.correlation)


def test_some_of_the_cells_say_about_as_much_as_all() -> None:
    source, target, truth = reliefs()
    every, fifth = alike(source, target, truth), alike(source, target, truth, every=5)
    assert fifth.cells == pytest.approx(every.cells, rel=0.1)
    assert fifth.correlation == pytest.approx(every.correlation, abs=0.15)


def test_ground_on_its_head_or_far_away_is_not_compared() -> None:
    source, target, truth = reliefs()
    over = se3.from_rt(se3.rotation_about(np.array([np.pi, 0.0, 0.0])), np.zeros(3))
    assert alike(source, target, over @ truth) == Alike(0.0, 0.0)
    away = se3.from_rt(np.eye(3), np.array([500.0, 0.0, 0.0]))
    assert alike(source, target, away @ truth) == Alike(0.0, 0.0)
    above = se3.from_rt(np.eye(3), np.array([0.0, 0.0, 30.0]))
    assert alike(source, target, above @ truth) == Alike(0.0, 0.0)


def test_without_ground_nothing_is_known() -> None:
    source, _, truth = reliefs()
    assert alike(source, None, truth) == Alike(0.0, 0.0)
    assert alike(None, None, truth).information == 0.0
