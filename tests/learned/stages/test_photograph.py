# SPDX-License-Identifier: MIT
"""What the first page says of the photograph is what the shipped weights do."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import hybridreg as hr
from hybridreg.data import open_dataset
from hybridreg.pair import Pair

PAGE = Path(__file__).resolve().parents[3] / "README.md"
CLAIM = "The camera image has no effect in these weights yet"


def moves_matches(pair: Pair) -> bool:
    """Do other matches come of it when noise takes the photograph's place?"""
    assert pair.image is not None
    rng = np.random.default_rng(0)
    noise = replace(pair, image=rng.integers(0, 256, pair.image.shape, dtype=np.uint8))
    pipe = hr.Pipeline.preset("cross3dreg")
    first, second = (pipe.trace(each).matches for each in (pair, noise))
    if abs(len(first) - len(second)) > 0.01 * len(first):
        return True
    both = {tuple(row) for row in np.hstack([first.source, first.target]).round(3)}
    other = {tuple(row) for row in np.hstack([second.source, second.target]).round(3)}
    return len(both & other) < 0.98 * len(both)


def test_the_first_page_says_whether_the_photograph_does_anything() -> None:
    pair = open_dataset("sim:test/near#1")[0].pair
    network = hr.Vgam(weights="cross3dreg-small").network()
    gates = [layer.visual_residual.gate.abs().mean().item() for layer in network.vgam.layers]
    if moves_matches(pair):
        assert CLAIM not in PAGE.read_text()
    else:
        assert CLAIM in PAGE.read_text()
        assert gates == [pytest.approx(0.001, abs=0.0005)]
