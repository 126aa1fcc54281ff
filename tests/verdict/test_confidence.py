# SPDX-License-Identifier: MIT
from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hybridreg.verdict.confidence import FAILED, NEARLY, OK, WEIGHTS, confidence, word

share = st.floats(0.0, 1.0)
evidence = st.fixed_dictionaries({**dict.fromkeys(WEIGHTS, share), "rival_margin": st.floats(-1.5, 1.5)})


@given(evidence, st.sampled_from(sorted(WEIGHTS)), st.floats(0.0, 0.5))
def test_more_agreement_and_fewer_objections_never_lower_it(
    numbers: dict[str, float], name: str, step: float
) -> None:
    better = {**numbers, name: numbers[name] + (step if WEIGHTS[name] > 0 else -step)}
    assert 0.0 <= confidence(numbers) <= confidence(better) <= 1.0


def test_other_evidence_is_left_aside() -> None:
    numbers = dict.fromkeys(WEIGHTS, 0.2)
    assert confidence({**numbers, "normals": 0.9}) == confidence(numbers)


@given(evidence)
def test_two_poses_that_explain_the_data_alike_are_never_ok(numbers: dict[str, float]) -> None:
    assert confidence({**numbers, "rival_margin": 0.0}) <= 0.5
    assert word(confidence({**numbers, "rival_margin": -0.8 * NEARLY})) != "ok"


@pytest.mark.parametrize(
    ("probability", "expected"),
    [(1.0, "ok"), (OK, "ok"), (0.949, "doubtful"), (FAILED, "doubtful"), (0.499, "failed"), (0.0, "failed")],
)
def test_words(probability: float, expected: str) -> None:
    assert word(probability) == expected
