# SPDX-License-Identifier: MIT
"""Prepared pairs: made once, made anew when damaged, never mixed up."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path

import pytest
import torch
from training_runs import MakeRecipe, write_pair

from hybridreg.learned.training.data import pair_source, preparing
from hybridreg.learned.training.data.pair_source import PairSource, open_source
from hybridreg.learned.training.data.preparing import prepare_all
from hybridreg.learned.training.data.tensor_cache import TensorCache
from hybridreg.learned.training.recipe import Source


@pytest.fixture
def source(make_recipe: MakeRecipe, tmp_path: Path) -> PairSource:
    """Two pairs that are not prepared yet."""
    recipe = make_recipe()
    return open_source(recipe.data.train[0], recipe, tmp_path / "cache")


def test_a_pair_is_prepared_once(source: PairSource, monkeypatch: pytest.MonkeyPatch) -> None:
    assert not source.is_prepared(0)
    fresh = source.load(0)
    assert source.is_prepared(0)
    monkeypatch.setattr(pair_source, "prepare_clouds", lambda *_: pytest.fail("prepared again"))
    monkeypatch.setattr(pair_source, "shrink_image", lambda *_: pytest.fail("shrunk again"))
    again = source.load(0)
    assert all(torch.equal(a, b) for a, b in zip(fresh.pyramid.points, again.pyramid.points, strict=True))
    assert torch.equal(fresh.targets.overlap, again.targets.overlap)
    assert fresh.image is not None
    assert (fresh.image == again.image).all()


def test_a_damaged_file_is_made_anew(source: PairSource) -> None:
    whole = source.load(0)
    file = source.cache.path(source._cloud_key(0))
    content = file.read_bytes()
    for damaged in (content[: len(content) // 2], b"", b"\xff" * 64):
        file.write_bytes(damaged)
        again = source.load(0)
        assert torch.equal(again.features, whole.features)
        assert file.read_bytes() == content


def test_what_changes_the_tensors_changes_the_key(source: PairSource) -> None:
    config = source.config
    backbone, matching = config.backbone, config.matching
    others = [
        replace(source, config=replace(config, backbone=replace(backbone, **change)))
        for change in (
            {"voxel": 0.6}, {"base_radius": 3.0}, {"neighbor_limits": (20,) * 4}, {"fine_stage": 1},
            {"input_features": "geometric"},
        )
    ]  # fmt: skip
    others += [
        replace(source, config=replace(config, matching=replace(matching, **change)))
        for change in ({"matching_radius": 0.5}, {"patch_points": 16})
    ]
    others += [replace(source, partner=1.0), replace(source, fingerprints=("a", "b"))]
    keys = [repr(each._cloud_key(0)) for each in (source, *others)] + [repr(source._cloud_key(1))]
    assert len(set(keys)) == len(keys)
    # What only the network's weights depend on may change without preparing again.
    wider = replace(source, config=replace(config, backbone=replace(backbone, fine_dim=32)))
    assert wider._cloud_key(0) == source._cloud_key(0)


def test_a_pair_that_changed_on_disk_is_prepared_again(make_recipe: MakeRecipe, tmp_path: Path) -> None:
    recipe, root = make_recipe(), tmp_path / "pairs"
    wanted = Source(data=str(root))
    write_pair(root / "one", 0)
    before = open_source(wanted, recipe, tmp_path / "cache").load(0)
    shutil.rmtree(root / "one")
    write_pair(root / "one", 9, n_points=620)
    after = open_source(wanted, recipe, tmp_path / "cache").load(0)
    assert before.pyramid.lengths != after.pyramid.lengths


def test_an_interrupted_preparation_goes_on(source: PairSource, monkeypatch: pytest.MonkeyPatch) -> None:
    true_prepare, prepared = preparing._prepare, []

    def interrupted(given: PairSource, index: int) -> tuple[int, str | None]:
        if prepared:
            raise KeyboardInterrupt
        prepared.append(index)
        return true_prepare(given, index)

    monkeypatch.setattr(preparing, "_prepare", interrupted)
    with pytest.raises(KeyboardInterrupt):
        prepare_all(source, 1)
    first = prepared[0]
    assert [source.is_prepared(i) for i in (first, 1 - first)] == [True, False]
    monkeypatch.setattr(preparing, "_prepare", lambda g, i: (prepared.append(i), true_prepare(g, i))[1])
    heard: list[None] = []
    assert prepare_all(source, 1, lambda: heard.append(None)).usable == (0, 1)
    assert prepared == [first, 1 - first], "only the missing pair was prepared"
    assert len(heard) == 2


def test_a_pair_that_cannot_be_prepared_is_left_out_by_name(
    make_recipe: MakeRecipe, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    root = tmp_path / "pairs"
    for seed, name in enumerate(("fine", "gone")):
        write_pair(root / name, seed)
    (root / "gone" / "source.npy").write_bytes(b"no array")
    source = open_source(Source(data=str(root)), make_recipe(), tmp_path / "cache")
    with caplog.at_level("WARNING"):
        assert prepare_all(source, 1).usable == (0,)
    assert "pair gone is left out" in caplog.text
    with pytest.raises(ValueError, match=r"none of 1 pairs can be prepared; the first: .*source\.npy"):
        prepare_all(source.only((1,)), 1)


def test_without_a_folder_nothing_is_kept(make_recipe: MakeRecipe, tmp_path: Path) -> None:
    recipe = make_recipe(augmentation={"scale": [0.8, 1.2]})
    source = open_source(recipe.data.train[0], recipe, tmp_path / "cache")
    assert source.cache == TensorCache(None)
    large, plain = source.load(0, 1.2), source.load(0)
    ratio = large.targets.transform[:3, 3] / plain.targets.transform[:3, 3]
    assert torch.allclose(ratio, torch.full((3,), 1.2), atol=1e-4)
    assert not (tmp_path / "cache").exists()
