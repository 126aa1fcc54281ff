# SPDX-License-Identifier: MIT
"""The networks that make their own examples train through the same loop; stopped, they go on."""

from __future__ import annotations

import json
import math
import signal
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from training_runs import log, options, same, state

from hybridreg import testing
from hybridreg.geometry import se3
from hybridreg.learned.network_table import DEFAULT, NETWORKS, network_class
from hybridreg.learned.training import checkpoint, recipe_file
from hybridreg.learned.training.data.training_examples import learn
from hybridreg.learned.training.steps import forward_pass
from hybridreg.learned.training.steps.objective import Outcome
from hybridreg.learned.training.training_run import train
from hybridreg.learned.true_pair import TruePair
from hybridreg.learned.weights import from_pretrained

OTHERS = [name for name in NETWORKS if name != DEFAULT]


@pytest.fixture
def content(pairs: Path) -> dict[str, Any]:
    """A recipe of four steps of two pairs."""
    return {
        "size": "nano",
        "seed": 3,
        "log_every": 2,
        "every": 4,
        "checkpoint_minutes": 0.0,
        "augmentation": {"tilt": 0.0, "shift": 0.5},
        "data": {
            "train": [{"data": str(pairs), "name": "yards"}],
            "val": [{"data": str(pairs), "name": "one", "pairs": 1}],
        },
        "phase": [{"name": "all", "steps": 4, "rate": 1e-3, "accumulate": 2}],
    }


def on_call(number: int) -> Callable[..., Outcome]:
    """A step's losses, and SIGTERM when they are asked for the so manieth time."""
    calls = 0

    def called(*arguments: Any) -> Outcome:
        nonlocal calls
        calls += 1
        if calls == number:
            signal.raise_signal(signal.SIGTERM)
        return learn(*arguments)

    return called


@pytest.mark.parametrize("name", OTHERS)
def test_each_trains_validates_and_resumes(
    name: str, content: dict[str, Any], cache: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    recipe = recipe_file.parse({**content, "network": name}, name=f"{name}-tiny")
    whole, broken = tmp_path / "whole", tmp_path / "broken"
    assert train(recipe, options(whole, cache)) == whole / "best"
    cls = network_class(name)
    trained = from_pretrained(whole / "best")
    assert type(trained) is cls
    assert not trained.untrained()
    assert all(bool(torch.isfinite(tensor).all()) for tensor in trained.state_dict().values())
    lines = log(whole)
    assert [line["step"] for line in lines] == ["2", "4"]
    for column in ("loss", *cls.loss_names):
        assert all(math.isfinite(float(line[column])) for line in lines), column
    (validated,) = log(whole, "validation.csv")
    assert 0.0 <= float(validated["recall"]) <= 1.0
    assert (validated["inlier_ratio"] == "nan") == (name == "omnet")
    card = json.loads((whole / "best" / "card.json").read_text())
    assert (card["recipe"]["kind"], card["skipped"], card["visits"]) == (name, {}, 8)
    assert recipe_file.build(type(recipe), card["recipe"], "card") == recipe
    # Once more, stopped in its second step.
    with monkeypatch.context() as patched:
        calls = 2 if cls.together else 3
        patched.setattr(forward_pass, "learn", on_call(calls))
        assert train(recipe, options(broken, cache)) is None
    assert checkpoint.load(broken / "checkpoint.pt")["progress"].total == 2
    assert train(recipe, options(broken, cache, resume=True)) == broken / "best"
    assert same(state(broken), state(whole))
    assert log(broken) == lines


@pytest.mark.parametrize("name", OTHERS)
def test_an_example_is_the_same_for_the_same_draws(name: str) -> None:
    pair, truth = testing.sample_pair(1, 600)
    cls = network_class(name)
    made = TruePair.of(pair.target.points, pair.source.points, truth)
    config = cls.named_config("nano")
    one, two, other = (cls.example(made, config, np.random.default_rng(seed)) for seed in (0, 0, 1))
    torch.manual_seed(0)
    network = cls.named("nano").train()
    totals = []
    for batch, targets in (one, two, other):
        pairs = [(batch, targets), cls.example(made, config, np.random.default_rng(5))]
        given = cls.collate(pairs) if cls.together else (batch, targets)
        with torch.no_grad():
            totals.append(float(network.losses(network.training_output(given[0]), given[1]).total))
    if not any("running" in key for key in network.state_dict()):
        assert totals[0] == totals[1]
    assert totals[0] != totals[2]


def test_moving_a_pair_moves_its_truth() -> None:
    rng = np.random.default_rng(0)
    source, truth = (
        rng.normal(size=(50, 3)),
        se3.from_rt(se3.random_rotation(rng), np.array([1.0, -2.0, 3.0])),
    )
    places = (np.array([0.0, 0.0, 2.0]), rng.normal(size=(4, 3)))
    pair = TruePair.of(se3.apply(truth, source), source, truth, places)
    motions = tuple(se3.from_rt(se3.random_rotation(rng), rng.normal(size=3)) for _ in range(2))
    moved = pair.scaled(1.5).moved((motions[0], motions[1]), 0.0, rng)
    assert np.allclose(se3.apply(moved.T_target_source, moved.source.points), moved.target.points)
    # Where a sensor stood keeps its distances to the points.
    for old, new in ((pair.target, moved.target), (pair.source, moved.source)):
        assert old.viewpoint is not None
        assert new.viewpoint is not None
        before, after = (np.linalg.norm(level.points[0] - level.viewpoint, axis=-1) for level in (old, new))
        assert np.allclose(1.5 * before, after)
    shaken = pair.moved((np.eye(4), np.eye(4)), 0.01, rng)
    assert 0.0 < np.abs(shaken.source.points - source).max() <= 0.01


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"network": "dgr"}, "unknown network 'dgr'; known are cross3dreg, fcgf"),
        ({"network": 3}, "network: expected a table"),
        ({"network": {"name": 3}}, "network.name: expected a text"),
        ({"network": {"name": "fcgf", "voxels": 0.3}}, r"unknown keys \['voxels'\]"),
        ({"network": "fcgf", "omp": False}, "omp: a part of cross3dreg, which fcgf does not have"),
        ({"network": "fcgf", "size": "tiny"}, "unknown size 'tiny' of FCGF"),
        (
            {"network": "fcgf", "phase": [{"name": "p", "steps": 1, "losses": {"fine": 0.0}}]},
            "weighs its own",
        ),
        ({"network": "fcgf", "phase": [{"name": "p", "steps": 1, "use_predicted": 0.5}]}, "fcgf has none"),
    ],
)
def test_recipes_that_cannot_be_are_refused(
    content: dict[str, Any], changes: dict[str, Any], message: str
) -> None:
    with pytest.raises((ValueError, KeyError), match=message):
        recipe_file.parse({**content, **changes}, name="tiny")


def test_a_recipe_alters_its_network(content: dict[str, Any]) -> None:
    altered = {"name": "fcgf", "voxel": 0.4, "loss": {"form": "paper"}}
    recipe = recipe_file.parse({**content, "network": altered}, name="tiny")
    nano = network_class("fcgf").named_config("nano")
    assert recipe.kind == "fcgf"
    assert (recipe.network.voxel, recipe.network.loss.form) == (0.4, "paper")
    assert recipe.network.channels == nano.channels


def test_a_step_of_one_pair_is_told_where_the_network_needs_two(
    content: dict[str, Any], cache: Path, tmp_path: Path
) -> None:
    recipe = recipe_file.parse(
        {**content, "network": "omnet", "phase": [{"name": "all", "steps": 1}]}, name="tiny"
    )
    with pytest.raises(ValueError, match="2 pairs or more a step"):
        train(recipe, options(tmp_path / "run", cache))


@pytest.mark.parametrize("name", OTHERS)
def test_examples_read_ahead_are_the_same(
    name: str, content: dict[str, Any], cache: Path, tmp_path: Path
) -> None:
    runs = []
    for loaders in (0, 1):
        data = {**content["data"], "val": [], "loaders": loaders}
        phase = [{"name": "all", "steps": 1, "accumulate": 2}]
        recipe = recipe_file.parse({**content, "network": name, "data": data, "phase": phase}, name="tiny")
        train(recipe, options(tmp_path / str(loaders), cache))
        runs.append(state(tmp_path / str(loaders)))
    assert same(runs[0], runs[1])


def test_a_factor_for_a_backbone_that_is_not_there_is_refused(
    content: dict[str, Any], cache: Path, tmp_path: Path
) -> None:
    phase = {"name": "all", "steps": 1, "backbone_rate": 0.0}
    recipe = recipe_file.parse({**content, "network": "fcgf", "phase": [phase]}, name="tiny")
    with pytest.raises(ValueError, match="backbone_rate=0.0, but fcgf has no backbone"):
        train(recipe, options(tmp_path / "run", cache))
