# SPDX-License-Identifier: MIT
from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hybridreg.verdict.confidence import FAILED, NEARLY, NO_RIVAL, OK, confidence, word
from hybridreg.verdict.support import beside, model, support, terms

share = st.floats(0.0, 1.0)
EVIDENCE = {
    "agreement_least": share,
    "agreement_middle": share,
    "agreement_most": share,
    "looked_through": share,
    "looked_through_source": share,
    "looked_through_target": share,
    "weakest": st.floats(0.0, 1.0 / 3.0),
    "recipes": st.integers(1, 5),
    "matched": share,
}
own = st.fixed_dictionaries(EVIDENCE)
log_odds = st.floats(-15.0, 15.0)


def believed(pose: float, rival: float) -> float:
    return confidence({"support": pose, "rival_margin": rival - pose})


@given(
    own,
    st.sampled_from(list(EVIDENCE)),
    share,
)
def test_more_agreement_and_fewer_objections_never_lower_the_support(
    numbers: dict[str, float], name: str, step: float
) -> None:
    against = name.startswith("looked_through")
    better = {**numbers, name: numbers[name] + (-step if against else 1 if name == "recipes" else step)}
    assert support(better) >= support(numbers)


def test_the_rule_weighs_the_terms_and_nothing_else() -> None:
    numbers = {
        "agreement_least": 0.5,
        "agreement_middle": 0.6,
        "agreement_most": 0.9,
        "looked_through": 0.1,
        "looked_through_source": 0.2,
        "looked_through_target": 0.05,
        "weakest": 0.02,
        "recipes": 1,
        "matched": 0.4,
    }
    assert set(model().weights) == set(terms(numbers))
    assert support({**numbers, "normals": 0.9}) == support(numbers)


@given(own)
def test_recipes_that_came_to_a_pose_and_matches_that_agree_add_to_its_support(
    numbers: dict[str, float],
) -> None:
    alone, joined = ({**numbers, "recipes": n, "matched": share} for n, share in ((1, 0.0), (3, 0.5)))
    assert support(joined) - support(alone) == pytest.approx(beside(3, 0.5))
    assert beside(1, 0.0) == 0.0 < beside(2, 0.0) < beside(3, 0.0) < beside(3, 0.1) < beside(3, 0.2)


@given(log_odds, log_odds, st.floats(0.0, 5.0))
def test_a_better_pose_or_a_worse_rival_never_lowers_the_confidence(
    pose: float, rival: float, step: float
) -> None:
    assert 0.0 < believed(pose, rival) <= believed(pose + step, rival) < 1.0
    assert believed(pose, rival) <= believed(pose, rival - step)


@given(log_odds)
def test_two_poses_that_explain_the_data_alike_are_never_ok(pose: float) -> None:
    assert believed(pose, pose) <= 0.5
    assert word(believed(pose, pose - 0.8 * NEARLY)) != "ok"


@given(log_odds)
def test_without_a_rival_the_confidence_is_that_of_the_support(pose: float) -> None:
    alone = confidence({"support": pose, "rival_margin": NO_RIVAL})
    assert alone == pytest.approx(1.0 / (1.0 + np.exp(-pose)), abs=1e-6)


@pytest.mark.parametrize(
    ("probability", "expected"),
    [(1.0, "ok"), (OK, "ok"), (0.949, "doubtful"), (FAILED, "doubtful"), (0.499, "failed"), (0.0, "failed")],
)
def test_words(probability: float, expected: str) -> None:
    assert word(probability) == expected


@given(own)
def test_a_pair_turned_round_has_the_same_support(numbers: dict[str, float]) -> None:
    round_about = {
        **numbers,
        "looked_through_source": numbers["looked_through_target"],
        "looked_through_target": numbers["looked_through_source"],
    }
    assert support(round_about) == support(numbers)
