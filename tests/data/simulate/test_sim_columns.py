# SPDX-License-Identifier: MIT
from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from hybridreg.data.simulate.sensing import column_arrays


@given(st.integers(1, 300), st.integers(0, 2**32 - 1))
def test_operations_are_the_plain_ones_and_keep_the_order(n: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    plain, other = rng.normal(size=(2, n, 3)).astype(np.float32)
    rows = column_arrays.stack(*plain.T)
    index, row = rng.integers(-1, n, 2 * n), rng.normal(size=3).astype(np.float32)
    rotation = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    np.testing.assert_array_equal(rows, plain)
    np.testing.assert_array_equal(column_arrays.pick(rows, index), plain[index])
    np.testing.assert_array_equal(column_arrays.outer(plain[:, 0], row), plain[:, :1] * row)
    np.testing.assert_allclose(column_arrays.dot(rows, other), np.sum(plain * other, axis=1), atol=1e-5)
    np.testing.assert_allclose(column_arrays.turned(rows, rotation), plain @ rotation.T, atol=1e-5)
    for made in (
        rows,
        column_arrays.pick(rows, index),
        column_arrays.turned(rows, rotation),
        column_arrays.outer(plain[:, 0], row),
    ):
        assert made.flags.f_contiguous
        assert made.dtype == np.float32


@given(st.integers(1, 100), st.integers(0, 2**32 - 1))
def test_put_writes_the_asked_rows_alone(n: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    rows, plain = np.zeros((n, 3), order="F"), np.zeros((n, 3))
    index = rng.permutation(n)[: rng.integers(n + 1)]
    values = rng.normal(size=(len(index), 3))
    column_arrays.put(rows, index, values)
    plain[index] = values
    np.testing.assert_array_equal(rows, plain)
