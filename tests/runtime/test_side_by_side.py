# SPDX-License-Identifier: MIT
"""The same work on both clouds, in a thread each."""

from __future__ import annotations

import pytest

from hybridreg.runtime.side_by_side import side_by_side


def _root(x: float) -> float:
    if x < 0.0:
        raise ValueError(f"{x} is negative")
    return x**0.5


@pytest.mark.parametrize("threads", ["1", "2"])
def test_answers_in_order_and_raises_what_the_work_raises(
    monkeypatch: pytest.MonkeyPatch, threads: str
) -> None:
    monkeypatch.setenv("OMP_NUM_THREADS", threads)

    assert side_by_side(_root, 4.0, 9.0) == [2.0, 3.0]
    with pytest.raises(ValueError, match="-1.0 is negative"):
        side_by_side(_root, 4.0, -1.0)
