# SPDX-License-Identifier: MIT
from __future__ import annotations

import importlib.util
import json
from pathlib import Path

import numpy as np
import pytest

from hybridreg.data.simulate import TIERS

_spec = importlib.util.spec_from_file_location("freeze", Path(__file__).with_name("freeze.py"))
assert _spec is not None
assert _spec.loader is not None
freeze = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(freeze)
STORED = json.loads(freeze.FROZEN.read_text())


def test_versions_are_the_frozen_ones() -> None:
    assert STORED["versions"] == {name: tier.version for name, tier in TIERS.items()}
    assert {tier: tuple(map(int, pairs)) for tier, pairs in STORED["pairs"].items()} == dict.fromkeys(
        TIERS, freeze.NUMBERS
    )


@pytest.mark.parametrize("index", freeze.NUMBERS)
@pytest.mark.parametrize("tier", TIERS)
def test_the_test_split_has_not_changed(tier: str, index: int) -> None:
    stored, now = STORED["pairs"][tier][str(index)], freeze.fingerprint(tier, index)
    advice = (
        "the simulator's output changed: raise the version in tiers.py and run tests/data/simulate/freeze.py"
    )
    if freeze.machine() == STORED["machine"]:
        assert now["checksums"] == stored["checksums"], advice
    assert (now["scene"], now["sensors"]) == (stored["scene"], stored["sensors"]), advice
    np.testing.assert_allclose(now["T_target_source"], stored["T_target_source"], atol=1e-6, err_msg=advice)
    assert now["overlap"] == pytest.approx(stored["overlap"], abs=0.003), advice
    np.testing.assert_allclose(now["points"], stored["points"], rtol=0.002, err_msg=advice)
    for mine, theirs in zip(now["samples"], stored["samples"], strict=True):
        assert len(theirs) > 5
        assert len(set(mine) & set(theirs)) >= 0.95 * len(set(mine) | set(theirs)), advice
    np.testing.assert_allclose(now["colour"], stored["colour"], atol=1.5, err_msg=advice)


def test_one_moved_point_changes_the_checksum_and_hardly_the_sample() -> None:
    cloud = np.random.default_rng(0).uniform(-50, 50, (60_000, 3)).astype(np.float32)
    moved = cloud.copy()
    moved[7, 2] += 0.01
    assert freeze.checksum(moved) != freeze.checksum(cloud)
    assert len(freeze.sample(cloud)) > 30
    assert len(set(freeze.sample(cloud)) ^ set(freeze.sample(moved))) <= 2
    assert not set(freeze.sample(cloud)) & set(freeze.sample(cloud + 0.01))
