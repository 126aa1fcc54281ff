# SPDX-License-Identifier: MIT
"""Sensors by the directions they looked in, poses by the overlap, overlaps kept on disk."""

from __future__ import annotations

import dataclasses
import json
import os
import pickle
from pathlib import Path

import loader_trees
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hybridreg.data.lists import azimuth, direction, overlapping
from hybridreg.data.lists.listed import ListedPairs
from hybridreg.data.lists.pair_files import PairFiles
from hybridreg.data.loaders.folder import PairFolder
from hybridreg.geometry import se3


def ring(start: float, width: float, n: int = 4000, seed: int = 0) -> np.ndarray:
    rng = np.random.default_rng(seed)
    angle = np.radians(start + rng.uniform(0, width, n))
    reach = rng.uniform(2, 40, n)
    return np.column_stack([reach * np.cos(angle), reach * np.sin(angle), rng.uniform(-2, 2, n)])


@given(start=st.floats(-360, 360), width=st.sampled_from([40.0, 70.0, 120.0, 170.0]))
def test_a_fan_is_limited_wherever_it_looks(start: float, width: float) -> None:
    found = azimuth.coverage(ring(start, width))
    assert found.role == "limited"
    assert width - 20 <= found.span_deg <= width + 20


def test_kinds_of_sensors() -> None:
    assert azimuth.coverage(ring(0, 360)).role == "spinning"
    assert azimuth.coverage(ring(10, 345)).role == "spinning"  # behind the mast nothing is seen
    assert azimuth.coverage(ring(0, 250)).role == "unclear"
    stray = np.vstack([ring(0, 120), ring(0, 360, n=100, seed=1)])
    assert azimuth.coverage(stray).role == "limited"


def test_simulated_sensors_are_told_apart() -> None:
    for labelled in loader_trees.simulated():
        assert azimuth.coverage(labelled.pair.source.points).role == "limited"
        assert azimuth.coverage(labelled.pair.target.points).role == "spinning"


def test_real_targets_spin(real_data: Path) -> None:
    for labelled in PairFolder(real_data):
        assert azimuth.coverage(labelled.pair.target.points).role == "spinning", labelled.pair.id


def listed(root: Path, inverted: bool = False, if_inverted: str = "turn them") -> ListedPairs:
    tree = loader_trees.helipr(root)
    from hybridreg.data import HeLiPr

    entries = [
        dataclasses.replace(
            e, T_target_source=se3.inverse(e.T_target_source) if inverted else e.T_target_source
        )
        for e in HeLiPr(tree.root).entries
    ]
    return ListedPairs(entries, tree.root, if_inverted=if_inverted)


def test_right_poses_pass(tmp_path: Path) -> None:
    pairs = listed(tmp_path)
    found = direction.measured(pairs)
    assert found.as_given > 0.5 > found.inverted
    assert found.n == len(pairs)
    assert len(pairs[0].pair.source) > 0


def test_inverted_poses_are_refused_with_both_figures(tmp_path: Path) -> None:
    pairs = listed(tmp_path, inverted=True)
    for _ in range(2):  # and not just the first time
        with pytest.raises(
            ValueError, match="under their inverses; the poses seem to map target to source, turn"
        ):
            pairs[0]
    assert len(pairs.read(0).pair.source) > 0


def test_data_sets_of_known_direction_are_not_checked(tmp_path: Path) -> None:
    assert len(listed(tmp_path, inverted=True, if_inverted="")[0].pair.source) > 0


def test_the_check_is_made_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pairs, calls = listed(tmp_path), []
    whole = direction.check
    monkeypatch.setattr(direction, "check", lambda *a, **k: (calls.append(1), whole(*a, **k)))
    pairs[0], pairs[1]
    # A task of a parallel run unpickles the set anew.
    pickle.loads(pickle.dumps(pairs))[0]
    assert len(calls) == 1


def test_poses_of_another_place_raise_a_warning(tmp_path: Path) -> None:
    away = se3.from_rt(np.eye(3), np.array([500.0, 0.0, 0.0]))
    entries = [dataclasses.replace(e, T_target_source=away) for e in listed(tmp_path).entries]
    with pytest.warns(UserWarning, match="hardly overlap"):
        ListedPairs(entries, tmp_path, if_inverted="turn them")[0]


@given(length=st.integers(1, 400), n=st.integers(1, 30))
def test_rows_are_spread_over_the_set(length: int, n: int) -> None:
    rows = direction.spread(length, n)
    assert len(rows) == len(set(rows)) == min(length, n)
    assert rows[0] == 0
    assert n == 1 or rows[-1] == length - 1


def few(root: Path) -> list[PairFiles]:
    return list(listed(root).entries)


def test_overlaps_are_measured_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    entries = few(tmp_path)
    first = overlapping.overlapping(entries, tmp_path, 0.1, 0.5)
    assert [share for _, share in first] == [direction.overlap(e.read(), 0.5) for e in entries]
    monkeypatch.setattr(PairFiles, "read", lambda self: pytest.fail("measured again"))
    assert overlapping.overlapping(entries, tmp_path, 0.1, 0.5) == first
    above_all = max(share for _, share in first) + 0.01
    assert overlapping.overlapping(entries, tmp_path, above_all, 0.5) == []


def test_kept_overlaps_follow_poses_radius_and_clouds(tmp_path: Path) -> None:
    entries = few(tmp_path)
    overlapping.overlapping(entries, tmp_path, 0.0, 0.5)
    overlapping.overlapping(entries, tmp_path, 0.0, 0.2)
    moved = [dataclasses.replace(e, T_target_source=np.eye(4)) for e in entries]
    overlapping.overlapping(moved, tmp_path, 0.0, 0.5)
    assert len(list(tmp_path.glob("hybridreg-overlaps-*.json"))) == 3


@pytest.mark.parametrize("content", ["", "{", "[]", '{"overlap": {}}', '{"overlap": {"x": null}}', "\x00"])
def test_damaged_overlaps_are_replaced(content: str, tmp_path: Path) -> None:
    entries = few(tmp_path)
    right = overlapping.overlapping(entries, tmp_path, 0.0, 0.5)
    (file,) = tmp_path.glob("hybridreg-overlaps-*.json")
    file.write_text(content)
    assert overlapping.overlapping(entries, tmp_path, 0.0, 0.5) == right
    assert set(json.loads(file.read_text())["overlap"]) == {e.id for e in entries}


def test_overlaps_that_cannot_be_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object) -> None:
        raise PermissionError(13, os.strerror(13))

    monkeypatch.setattr(overlapping, "write_json", refuse)
    with pytest.warns(UserWarning, match="measured again next time"):
        assert len(overlapping.overlapping(few(tmp_path), tmp_path, 0.0, 0.5)) == 2
