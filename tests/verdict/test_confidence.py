# SPDX-License-Identifier: MIT
from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import hybridreg as hr
from hybridreg.data.hard import sample
from hybridreg.data.hard.true_poses import is_right
from hybridreg.evidence.evidence import NO_RIVAL, Evidence
from hybridreg.evidence.log_odds import FAILED, OK, OK_LOG_ODDS, beside, log_odds, model, terms
from hybridreg.verdict.boosted import Boosted
from hybridreg.verdict.confidence import SPEAKS, believed, confidence, features, trees, word
from hybridreg.verdict.training.boosting import boost, plain

share = st.floats(0.0, 1.0)
EVIDENCE = {
    "agreement_least": share,
    "agreement_middle": share,
    "agreement_most": share,
    "looked_through": share,
    "looked_through_source": share,
    "looked_through_target": share,
    "agreement_rare": share,
    "looked_through_rare": share,
    "agreed_rare": st.floats(1.0, 3000.0),
    "through_rare": st.floats(1.0, 3000.0),
    "relief_cells": st.floats(0.0, 3000.0),
    "relief_correlation": st.floats(-1.0, 1.0),
    "weakest": st.floats(0.0, 1.0 / 3.0),
    "looked_least": st.floats(0.0, 3000.0),
    "found_by": st.integers(1, 5),
    "matched": share,
    "closeness": st.floats(-3.0, 0.0),
    "overturned": st.sampled_from([0.0, 1.0]),
}
own = st.builds(Evidence, **EVIDENCE)
odds = st.floats(-15.0, 15.0)
WHOLE = EVIDENCE | {
    "compared": st.floats(100.0, 3000.0),
    "visible_source": share,
    "visible_target": share,
    "fitness_visible_source": share,
    "fitness_visible_target": share,
    "closely": st.floats(-1.7, 2.5),
    "size_gain": st.floats(0.0, 2.0),
    "support": odds,
    "rival_margin": st.floats(NO_RIVAL, 10.0),
}
whole = st.builds(Evidence, **WHOLE)


@given(
    own,
    # Common ground alone is neither: it is how alike it is.
    st.sampled_from([name for name in EVIDENCE if name not in ("relief_cells", "overturned")]),
    share,
)
def test_more_agreement_and_fewer_objections_never_lower_the_support(
    numbers: Evidence, name: str, step: float
) -> None:
    against = "through" in name
    more = -step if against else 1 if name == "found_by" else step
    assert log_odds(replace(numbers, **{name: getattr(numbers, name) + more})) >= log_odds(numbers)


def test_the_rule_weighs_the_terms_and_nothing_else() -> None:
    numbers = Evidence(
        agreement_least=0.5,
        agreement_middle=0.6,
        agreement_most=0.9,
        looked_through=0.1,
        looked_through_source=0.2,
        looked_through_target=0.05,
        agreement_rare=0.5,
        looked_through_rare=0.1,
        agreed_rare=40.0,
        through_rare=8.0,
        relief_cells=200.0,
        relief_correlation=0.3,
        weakest=0.02,
        found_by=1,
        matched=0.4,
        closeness=-0.2,
        overturned=0.0,
        looked_least=40.0,
    )
    assert set(model().weights) == set(terms(numbers))
    assert log_odds(replace(numbers, normals=0.9)) == log_odds(numbers)


@given(own)
def test_matches_that_agree_and_closeness_add_to_its_support(
    numbers: Evidence,
) -> None:
    alone, joined = (
        replace(numbers, matched=share, closeness=nats) for share, nats in ((0.0, 0.0), (0.5, -0.4))
    )
    assert log_odds(joined) - log_odds(alone) == pytest.approx(beside(0.5, -0.4))
    assert beside(0.0, -0.5) < beside(0.0, -0.1) < 0.0 == beside(0.0) < beside(0.1) < beside(0.2)


@given(whole, st.sampled_from([name for name in SPEAKS if name in WHOLE and SPEAKS[name]]), share)
def test_what_speaks_for_a_pose_never_lowers_its_confidence_nor_does_the_contrary_raise_it(
    evidence: Evidence, name: str, step: float
) -> None:
    better = replace(evidence, **{name: getattr(evidence, name) + SPEAKS[name] * step})
    assert 0.0 < confidence(evidence) <= confidence(better) < 1.0


@given(whole)
def test_two_poses_that_explain_the_data_alike_are_never_ok(evidence: Evidence) -> None:
    assert confidence(replace(evidence, rival_margin=0.0)) <= 0.5
    assert word(confidence(replace(evidence, rival_margin=-0.8 * OK_LOG_ODDS))) != "ok"


@given(whole)
def test_no_pose_that_turns_the_world_over_or_fits_at_another_size_is_ok(evidence: Evidence) -> None:
    assert word(confidence(replace(evidence, overturned=1.0))) == "failed"
    assert word(confidence(replace(evidence, size_gain=0.3))) != "ok"


@given(whole, st.floats(20.0, 3000.0), st.floats(0.1, 1000.0))
def test_no_pose_is_ok_at_which_more_is_seen_through_than_agrees(
    evidence: Evidence, agreed: float, more: float
) -> None:
    assert word(confidence(replace(evidence, agreed_rare=agreed, through_rare=agreed + more))) != "ok"


@given(whole, st.floats(0.21, 1.0), st.sampled_from(["source", "target"]))
def test_nor_one_at_which_either_cloud_is_seen_through_by_much(
    evidence: Evidence, through: float, side: str
) -> None:
    assert word(confidence(replace(evidence, **{f"looked_through_{side}": through}))) != "ok"


@given(odds, st.floats(NO_RIVAL, 10.0))
def test_a_pose_is_no_likelier_than_against_its_rival_alone(odds: float, margin: float) -> None:
    assert believed(odds, margin) <= 1.0 / (1.0 + np.exp(margin))
    assert believed(odds, NO_RIVAL) == pytest.approx(1.0 / (1.0 + np.exp(-odds)), abs=1e-6)


def test_the_trees_are_those_of_scikit_learn() -> None:
    rng = np.random.default_rng(0)
    X = rng.uniform(size=(300, len(SPEAKS)))
    y = X[:, 0] - X[:, 4] + 0.3 * rng.normal(size=300) > 0
    rows = [dict(zip(SPEAKS, x, strict=True)) for x in X.tolist()]
    fitted = boost(rows, y, np.ones(300))
    ours = Boosted.read(plain(fitted))
    assert [ours(row) for row in rows[:50]] == pytest.approx(fitted.decision_function(X[:50]), abs=1e-3)
    assert ours.depth > 1


def test_the_stored_trees_ask_about_what_the_evidence_has() -> None:
    assert trees().names == tuple(SPEAKS)


@pytest.mark.parametrize(
    ("probability", "expected"),
    [(1.0, "ok"), (OK, "ok"), (0.949, "doubtful"), (FAILED, "doubtful"), (0.499, "failed"), (0.0, "failed")],
)
def test_words(probability: float, expected: str) -> None:
    assert word(probability) == expected


@given(whole)
def test_a_pair_turned_round_has_the_same_support_and_confidence(evidence: Evidence) -> None:
    there = {"source": "target", "target": "source"}
    facts = evidence.as_dict()
    ends = {name: name.rpartition("_") for name in facts}
    round_about = Evidence(
        **{
            f"{stem}_{there[end]}" if end in there else name: facts[name]
            for name, (stem, _, end) in ends.items()
        }
    )
    assert log_odds(round_about) == log_odds(evidence)
    assert features(round_about) == features(evidence)


@given(whole, st.floats(31.0, 3000.0), st.floats(0.0, 0.249))
def test_relief_alone_makes_no_pose_ok_that_walls_contradict(
    evidence: Evidence, looked: float, agreed: float
) -> None:
    on_waves = replace(evidence, relief_cells=955.0, relief_correlation=0.7, looked_least=looked)
    assert word(confidence(replace(on_waves, agreement_rare=agreed))) != "ok"


@pytest.mark.parametrize(("kind", "seed"), [("tiles", 468)])
def test_nor_where_it_is_the_likeliest(kind: str, seed: int) -> None:
    made = sample(kind, seed)  # half a turn off the ground's waves fit
    result = hr.register(made.source, made.target)
    assert is_right(made, result.transformation) or result.verdict != "ok"
