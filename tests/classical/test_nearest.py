# SPDX-License-Identifier: MIT
from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.distance import cdist

from hybridreg.geometry.nearest_descriptors import nearest


@settings(max_examples=40)
@given(st.integers(0, 10**6), st.integers(1, 300), st.integers(2, 300), st.integers(2, 40))
def test_equals_all_pairwise_distances(seed: int, n: int, m: int, d: int) -> None:
    rng = np.random.default_rng(seed)
    a, b = rng.uniform(0, 14, (n, d)), rng.uniform(0, 14, (m, d))
    exact = cdist(a, b)
    found = nearest(a, b)
    # float32 may take another of two neighbours that are equally far to four digits.
    np.testing.assert_allclose(exact[np.arange(n), found.row], exact.min(axis=1), rtol=1e-3, atol=2e-2)
    np.testing.assert_allclose(found.distance, exact.min(axis=1), rtol=1e-3, atol=2e-2)
    np.testing.assert_allclose(found.second, np.sort(exact, axis=1)[:, 1], rtol=1e-3, atol=2e-2)
    mutual = exact.argmin(axis=0)[exact.argmin(axis=1)] == np.arange(n)
    assert (found.mutual != mutual).mean() <= 2 / n


def test_a_target_has_one_mutual_partner_at_most() -> None:
    rng = np.random.default_rng(0)
    found = nearest(rng.normal(size=(700, 33)), rng.normal(size=(500, 33)))
    assert found.mutual.any()
    assert np.bincount(found.row[found.mutual]).max() == 1


def test_equal_descriptors_have_one_partner_at_most() -> None:
    rng = np.random.default_rng(1)
    target = rng.normal(size=(50, 8))
    source = np.concatenate([target[:10], np.repeat(target[:1], 300, axis=0)])
    found = nearest(source, target)
    assert found.mutual[1:10].all()
    assert (found.mutual & (found.row == 0)).sum() <= 1


def test_a_single_target_has_no_second() -> None:
    found = nearest(np.zeros((1, 4)), np.ones((1, 4)))
    assert found.distance[0] == pytest.approx(2.0, rel=1e-6)
    assert found.second[0] == np.inf
    assert found.mutual[0]
