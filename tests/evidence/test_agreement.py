# SPDX-License-Identifier: MIT
from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from made_places import Made

from hybridreg.evidence import views
from hybridreg.evidence.agreement import Agreement, compare
from hybridreg.geometry import se3
from hybridreg.geometry.ground_relief import Alike

SHIFT = se3.from_rt(np.eye(3), np.array([3.0, 0.0, 0.0]))


def agreement(made: Made, T: np.ndarray) -> Agreement:
    return compare(views.of(made.scene), T)


def test_at_the_true_pose_the_clouds_agree_along_every_axis(crossing: Made) -> None:
    found = agreement(crossing, crossing.truth)
    assert found.shares.min() > 0.5
    assert found.looked_through < 0.08


def test_three_metres_along_the_street_only_the_surfaces_across_it_disagree(crossing: Made) -> None:
    right, wrong = agreement(crossing, crossing.truth), agreement(crossing, SHIFT @ crossing.truth)
    assert wrong.looked_through > 2.0 * right.looked_through
    along = np.argmax(np.abs(wrong.axes @ [1.0, 0.0, 0.0]))
    up = np.argmax(np.abs(wrong.axes @ [0.0, 0.0, 1.0]))
    assert wrong.shares[along] < 0.3 < 0.5 < wrong.shares[up]


def test_points_that_the_other_sensor_could_not_see_do_not_count(fan: Made) -> None:
    found = agreement(fan, fan.truth)
    # A 120 degree raster can look at no more than a third of what the full circle saw.
    assert found.target.looked.mean() < 0.34 < 0.5 < found.source.looked.mean()
    assert found.shares.min() > 0.4


def test_evidence_is_the_same_seen_from_either_cloud(crossing: Made) -> None:
    both = views.of(crossing.scene)
    there = compare(both, crossing.truth)
    back = compare(replace(both, source=both.target, target=both.source), se3.inverse(crossing.truth))
    assert np.array_equal(there.looked, back.looked)
    assert np.array_equal(there.agreed, back.agreed)
    assert there.looked_through == back.looked_through


def test_few_points_count_for_little() -> None:
    made = Agreement(
        source=None,  # type: ignore[arg-type]
        target=None,  # type: ignore[arg-type]
        axes=np.eye(3),
        looked=np.array([1000.0, 100.0, 5.0]),
        agreed=np.array([900.0, 90.0, 5.0]),
        through=np.zeros(3),
        relief=Alike(0.0, 0.0),
        overturned=False,
    )
    assert made.shares == pytest.approx([900 / 1020, 90 / 120, 5 / 25])


def test_without_a_viewpoint_nothing_is_looked_through(crossing: Made) -> None:
    both = views.of(crossing.scene)
    blind = replace(both, source=replace(both.source, image=None), target=replace(both.target, image=None))
    found = compare(blind, SHIFT @ crossing.truth)
    assert found.looked_through == 0.0
    assert not found.source.hidden.any()
    assert found.shares.min() < 0.35


def test_a_share_of_the_asked_points_gives_nearly_the_same_shares(crossing: Made) -> None:
    whole, part = (compare(views.of(crossing.scene), crossing.truth, stride=n) for n in (1, 5))
    assert part.shares == pytest.approx(whole.shares, abs=0.12)
