# SPDX-License-Identifier: MIT
from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from made_places import Made

from hybridreg.evidence import information, views
from hybridreg.evidence.agreement import compare
from hybridreg.evidence.information import Information
from hybridreg.geometry import se3
from hybridreg.search.settle import settle


def held(made: Made) -> Information:
    both = views.of(made.scene)
    return information.measure(compare(both, made.truth), both.target)


def test_a_corridor_is_open_along_itself(corridor: Made) -> None:
    found = held(corridor)
    assert found.weakest < 0.005
    assert not found.turns
    assert abs(found.direction[0]) > 0.99
    assert found.words.startswith("along x of the target (1.00")
    turning = replace(found, turns=True, direction=np.array([0.0, 0.0, -1.0]))
    assert turning.words == "in a turn about z of the target (0.00 0.00 1.00)"


def test_a_crossing_is_held_in_every_direction(crossing: Made) -> None:
    assert held(crossing).weakest > 0.02


def test_the_matrix_is_the_second_derivative_of_the_squared_plane_distances(crossing: Made) -> None:
    both = views.of(crossing.scene)
    target = both.target
    agreement = compare(both, crossing.truth)
    found = information.measure(agreement, target)
    way = agreement.source
    points = way.moved[way.agrees]
    rows = way.match[way.agrees]

    def squares(twist: np.ndarray) -> float:
        moved = se3.apply(se3.exp(twist), points - found.centre) + found.centre
        return float(np.sum(np.sum((moved - target.points[rows]) * target.normals[rows], axis=1) ** 2))

    # Residuals are not zero, and the rotation's second derivative adds their curvature: translations are exact.
    step = 1e-3
    for k in range(6):
        twist = np.eye(6)[k] * step
        curvature = (squares(twist) - 2.0 * squares(0.0 * twist) + squares(-twist)) / (2.0 * step**2)
        assert curvature == pytest.approx(found.matrix[k, k], rel=1e-3 if k >= 3 else 0.1)


def test_no_agreeing_point_gives_no_information(crossing: Made) -> None:
    both = views.of(crossing.scene)
    far = se3.from_rt(np.eye(3), np.array([0.0, 0.0, 5000.0]))
    found = information.measure(compare(both, far), both.target)
    assert not found.matrix.any()
    assert found.weakest == 0.0


@pytest.mark.parametrize("offset", [(0.6, 0.4, 0.2), (-0.5, 0.5, -0.3)])
def test_settling_finds_the_true_pose_again(crossing: Made, offset: tuple[float, float, float]) -> None:
    start = se3.from_rt(se3.yaw(2.0)[:3, :3], np.array(offset)) @ crossing.truth
    found = settle(views.of(crossing.scene), start)
    assert np.linalg.norm((found - crossing.truth)[:3, 3]) < 0.15
    assert se3.angle_deg(found[:3, :3] @ crossing.truth[:3, :3].T) < 0.5


def test_settling_leaves_a_pose_without_overlap_alone(crossing: Made) -> None:
    far = se3.from_rt(np.eye(3), np.array([0.0, 0.0, 5000.0]))
    assert (settle(views.of(crossing.scene), far) == far).all()
