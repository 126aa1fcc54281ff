# SPDX-License-Identifier: MIT
"""What every loader promises, on a small tree in its layout: truths, laziness, pickling, clear words."""

from __future__ import annotations

import dataclasses
import pickle
import shutil
import time
from pathlib import Path

import loader_trees
import numpy as np
import pytest
from loader_trees import Tree

from hybridreg.data import ListedPairs, PairFiles, open_dataset
from hybridreg.data.lists import pair_files, pth
from hybridreg.data.lists.direction import overlap
from hybridreg.pair import LabelledPair


@pytest.fixture(scope="session", params=sorted(loader_trees.ALL))
def written(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Tree:
    root = tmp_path_factory.mktemp(request.param)
    return loader_trees.ALL[request.param](root)


@pytest.fixture
def copied(written: Tree, tmp_path: Path) -> Tree:
    """The tree once more, to be damaged."""
    root = tmp_path / "copy"
    shutil.copytree(written.root, root)
    return Tree(root, written.spelled.replace(str(written.root), str(root)), written.truth)


def test_pairs_have_their_true_poses(written: Tree) -> None:
    pairs = open_dataset(written.spelled)
    assert sorted(pairs.ids) == sorted(written.truth)
    for labelled in pairs:
        assert isinstance(labelled, LabelledPair)
        assert np.allclose(labelled.T_target_source, written.truth[labelled.pair.id], atol=1e-6)
        # The files and the pose belong together: the clouds meet under it, and hardly under its inverse.
        assert overlap(labelled, 0.3) > 2.0 * overlap(labelled, 0.3, inverted=True)


def test_layout_is_recognised_without_a_name(written: Tree) -> None:
    options = written.spelled.partition("#")[2]
    by_name, by_place = open_dataset(written.spelled), open_dataset(f"{written.root}#{options}")
    assert type(by_place) is type(by_name)
    assert by_place.ids == by_name.ids


def test_no_cloud_is_read_before_it_is_asked_for(written: Tree, monkeypatch: pytest.MonkeyPatch) -> None:
    open_dataset(written.spelled)  # whatever is measured once and kept
    monkeypatch.setattr(pair_files, "read_points", _refuse)
    monkeypatch.setattr(pair_files, "read_pth", _refuse)
    pairs = open_dataset(written.spelled)
    assert len(pairs) == len(pairs.ids) > 0
    assert pairs.fingerprint()
    with pytest.raises(AssertionError, match="read"):
        pairs[0]


def _refuse(*_: object) -> None:
    raise AssertionError("a cloud was read")


def test_pickled_data_set_is_the_same(written: Tree) -> None:
    pairs = open_dataset(written.spelled)
    again = pickle.loads(pickle.dumps(pairs))
    assert again.ids == pairs.ids
    assert again.fingerprint() == pairs.fingerprint()
    one, two = pairs[0], again[0]
    assert np.array_equal(one.pair.source.points, two.pair.source.points)
    assert np.array_equal(one.T_target_source, two.T_target_source)


def test_missing_cloud_is_told_in_one_sentence(copied: Tree) -> None:
    lost = open_dataset(copied.spelled).entries[-1].source
    lost.unlink()
    with pytest.raises((FileNotFoundError, ValueError)) as caught:
        open_dataset(copied.spelled)
    told = str(caught.value)
    assert str(lost) in told or str(lost.parent) in told
    assert "\n" not in told


def test_missing_folder_is_told(copied: Tree) -> None:
    shutil.rmtree(copied.root)
    name = copied.spelled.partition(":")[0]
    with pytest.raises(FileNotFoundError, match=f"must be the folder {copied.root}"):
        open_dataset(f"{name}:{copied.root}")


def test_empty_folder_is_told(copied: Tree) -> None:
    shutil.rmtree(copied.root)
    copied.root.mkdir()
    with pytest.raises(FileNotFoundError, match=r"missing.*must") as caught:
        open_dataset(copied.spelled)
    assert str(copied.root) in str(caught.value)


def test_truncated_cloud_fails_alone(copied: Tree) -> None:
    pairs = open_dataset(copied.spelled)
    pairs[0]
    damaged = pairs.entries[-1].source
    damaged.write_bytes(damaged.read_bytes()[: damaged.stat().st_size // 2 + 5])
    with pytest.raises(ValueError, match=damaged.name):
        pairs[-1]
    assert len(pairs[0].pair.source) > 0


def test_fingerprint_follows_the_poses(written: Tree) -> None:
    pairs = open_dataset(written.spelled)
    moved = pairs.entries[0].T_target_source.copy()
    moved[0, 3] += 0.01
    others = [dataclasses.replace(pairs.entries[0], T_target_source=moved), *pairs.entries[1:]]
    assert ListedPairs(pairs.entries, written.root).fingerprint() == pairs.fingerprint()
    assert ListedPairs(others, written.root).fingerprint() != pairs.fingerprint()


def test_a_large_set_travels_lightly(monkeypatch: pytest.MonkeyPatch) -> None:
    # Parallel runs pickle the set with every task; this is as many pairs as Cross3DReg has.
    monkeypatch.setattr("hybridreg.data.lists.listed.refuse_missing", lambda *_: None)
    there = Path("/data/sequences/08")
    many = [
        PairFiles(
            id=f"08/{n}",
            source=there / f"array/{n:06d}.ply",
            target=there / f"lidar/{n:06d}.ply",
            image=there / f"image/{n:06d}.jpg",
            T_target_source=np.eye(4),
        )
        for n in range(13_231)
    ]
    pairs = ListedPairs(many, there)
    started = time.process_time()
    again = pickle.loads(pickle.dumps(pairs))
    light = time.process_time() - started
    started = time.process_time()
    pickle.loads(pickle.dumps(many))
    assert light < 0.3 * (time.process_time() - started)
    assert again.ids == pairs.ids
    assert again.entries[-1].image == many[-1].image


def test_missing_returns_are_left_out(tmp_path: Path) -> None:
    points = np.vstack([np.random.default_rng(0).normal(size=(60, 3)) * 5, np.zeros((30, 3))])
    points[0, 1] = np.nan
    np.save(tmp_path / "scan.npy", points)
    cloud = pair_files.read_scan(tmp_path / "scan.npy", "scan")
    assert len(cloud) == 59
    assert cloud.dropped == 31


def test_pth_is_read_as_a_scan(tmp_path: Path) -> None:
    import torch

    points = np.random.default_rng(0).normal(size=(60, 3))
    torch.save(points, tmp_path / "a.pth")
    assert np.array_equal(pair_files.read_scan(tmp_path / "a.pth", "a").points, points)
    assert np.array_equal(pth.read_pth(tmp_path / "a.pth"), points)
