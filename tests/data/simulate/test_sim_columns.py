# SPDX-License-Identifier: MIT
from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from hybridreg.data.simulate import columns


@given(st.integers(1, 300), st.integers(0, 2**32 - 1))
def test_operations_are_the_plain_ones_and_keep_the_order(n: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    plain, other = rng.normal(size=(2, n, 3)).astype(np.float32)
    rows = columns.stack(*plain.T)
    index, row = rng.integers(-1, n, 2 * n), rng.normal(size=3).astype(np.float32)
    rotation = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    np.testing.assert_array_equal(rows, plain)
    np.testing.assert_array_equal(columns.pick(rows, index), plain[index])
    np.testing.assert_array_equal(columns.outer(plain[:, 0], row), plain[:, :1] * row)
    np.testing.assert_allclose(columns.dot(rows, other), np.sum(plain * other, axis=1), atol=1e-5)
    np.testing.assert_allclose(columns.turned(rows, rotation), plain @ rotation.T, atol=1e-5)
    for made in (
        rows,
        columns.pick(rows, index),
        columns.turned(rows, rotation),
        columns.outer(plain[:, 0], row),
    ):
        assert made.flags.f_contiguous
        assert made.dtype == np.float32


@given(st.integers(1, 100), st.integers(0, 2**32 - 1))
def test_put_writes_the_asked_rows_alone(n: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    rows, plain = np.zeros((n, 3), order="F"), np.zeros((n, 3))
    index = rng.permutation(n)[: rng.integers(n + 1)]
    values = rng.normal(size=(len(index), 3))
    columns.put(rows, index, values)
    plain[index] = values
    np.testing.assert_array_equal(rows, plain)
