# SPDX-License-Identifier: MIT
"""Recipes: what they mean, and what they say when they mean nothing."""

from __future__ import annotations

import dataclasses
import re
from pathlib import Path
from typing import Any

import pytest
import torch
from training_runs import MakeRecipe, write_recipe
from typer.testing import CliRunner

from hybridreg.cli.app import app
from hybridreg.learned import recipes
from hybridreg.learned.network_table import network_class
from hybridreg.learned.training import recipe_file
from hybridreg.learned.training.data import data_choice
from hybridreg.learned.training.initial_weights import first_network
from hybridreg.learned.training.recipe import Phase
from hybridreg.learned.training.steps.schedule import make_optimizer, rate_at, steps_of
from hybridreg.learned.weights import read_config

PHASE = {"name": "p", "steps": 2}


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"sed": 1}, r"recipe: unknown keys \['sed'\]; known are .*'seed'"),
        (
            {"foo": 1},
            r"unknown keys \['foo'\]; known are \['augmentation', 'base', .*'omp', .*'size', 'start', 'vgam'\]",
        ),
        ({"kind": "fcgf"}, r"unknown keys \['kind'\]"),
        ({"seed": -1}, r"mine\.toml: seed=-1 must be at least 0"),
        ({"log_every": 0}, "log_every=0 must be at least 1"),
        ({"data": {"train": [{"data": "a", "pairs": -1}]}}, "pairs=-1 must be at least 0"),
        ({"seed": "one"}, r"recipe\.seed: expected a number, got 'one'"),
        ({"size": "huge"}, "unknown size 'huge'; known are full, small"),
        ({"network": {"backbone": {"voxle": 1.0}}}, r"backbone: unknown keys \['voxle'\]"),
        (
            {"network": {"backbone": {"kernel": "round"}}},
            r"backbone\.kernel: expected one of 'spatial', 'cyl",
        ),
        ({"precision": "16"}, r"recipe\.precision: expected one of '32-true', 'bf16-mixed'"),
        ({"precision": "bf16-mixed"}, "cross3dreg computes distances of points, which need float32"),
        ({"phase": []}, r"a recipe needs at least one \[\[phase\]\]"),
        ({"phase": [{"steps": 2}]}, r"recipe\.phase\[0\]: name missing"),
        (
            {"phase": [{**PHASE, "losses": {"fine": "much"}}]},
            r"recipe\.phase\[0\]\.losses\.fine: expected a num",
        ),
        ({"phase": [{**PHASE, "epochs": 1.0}]}, "phase 'p': give steps or epochs"),
        ({"phase": [{**PHASE, "decay": "step"}]}, "phase 'p': decay='step' needs decay_every above 0"),
        ({"phase": [{**PHASE, "accumulate": 0}]}, "accumulate=0 must be at least 1"),
        ({"phase": [{**PHASE, "data": {"moon": 1.0}}]}, r"data names \['moon'\]; the training sources are"),
        ({"data": {"train": []}}, r"data\.train is empty: give at least one source"),
        ({"data": {"train": [{"data": "a"}, {"data": "a"}]}}, "two sources of one name.*give each its own"),
        ({"omp": False, "phase": [{**PHASE, "losses": {"mask": 2.0}}]}, "but the network has no OMP"),
    ],
)
def test_a_mistake_names_its_key_and_what_would_do(
    content: dict[str, Any], tmp_path: Path, changes: dict[str, Any], told: str
) -> None:
    file = write_recipe(tmp_path / "mine.toml", {**content, **changes})
    with pytest.raises(ValueError, match=told) as raised:
        recipe_file.read(file)
    assert str(raised.value).startswith(str(file))


@pytest.mark.skipif(torch.cuda.is_available(), reason="a GPU is here")
def test_an_accelerator_that_is_not_here_is_told_in_one_line(tmp_path: Path) -> None:
    arguments = ["train", "smoke", "--out", str(tmp_path / "run"), "--cache", str(tmp_path / "cache")]
    done = CliRunner().invoke(app, [*arguments, "--accelerator", "cuda"])
    assert done.exit_code == 2
    assert done.output == "hybridreg: --accelerator cuda: torch finds none here; use --accelerator cpu\n"


def test_a_file_that_is_none(tmp_path: Path) -> None:
    with pytest.raises(
        FileNotFoundError, match=r"no recipe of that name; known are .*paper, paper-a, .*smoke"
    ):
        recipe_file.read("nothing")
    (tmp_path / "x.toml").write_text("size =")
    with pytest.raises(ValueError, match=r"x\.toml: not a TOML file"):
        recipe_file.read(tmp_path / "x.toml")


def test_a_recipe_may_build_on_another(content: dict[str, Any], tmp_path: Path) -> None:
    first = write_recipe(tmp_path / "first.toml", {**content, "network": {"backbone": {"voxel": 0.7}}})
    changes = {"base": str(first), "omp": False, "network": {"backbone": {"kernel": "cylindrical"}}}
    second = write_recipe(tmp_path / "second.toml", {**changes, "phase": [PHASE]})
    recipe = recipe_file.read(second)
    assert recipe.name == "second"
    assert (recipe.network.backbone.voxel, recipe.network.backbone.kernel) == (0.7, "cylindrical")
    assert recipe.network.omp is None
    assert [phase.name for phase in recipe.phase] == ["p"]
    assert recipe.data == recipe_file.read(first).data


def test_a_base_that_is_none(content: dict[str, Any], tmp_path: Path) -> None:
    one, two = tmp_path / "one.toml", tmp_path / "two.toml"
    write_recipe(one, {**content, "base": str(two)})
    write_recipe(two, {**content, "base": str(one)})
    with pytest.raises(ValueError, match=r"one\.toml: base refers to itself: .*two\.toml -> .*one\.toml"):
        recipe_file.read(one)
    write_recipe(two, {**content, "base": 3})
    with pytest.raises(ValueError, match=r"two\.toml: base=3 must be the name or the path"):
        recipe_file.read(two)


@pytest.mark.parametrize("name", recipes.names())
def test_shipped_recipes_are_sound_and_name_no_folder(name: str) -> None:
    recipe = recipe_file.read(name)
    for source in (*recipe.data.train, *recipe.data.val):
        assert re.fullmatch(r"sim:(train|val)/\w+(/\d+)?(#\d+)?|\w+:\{\w+\}#\w+", source.data)


def test_the_paper_recipe_is_the_published_schedule() -> None:
    (phase,) = recipe_file.read("paper").phase
    assert (phase.optimizer, phase.rate, phase.epochs, phase.weight_decay) == ("adam", 1e-4, 20, 1e-6)
    steps = steps_of(phase, 1000, 1)
    assert steps == 20_000
    # GeoTransformer's factor 0.95 every fourth epoch.
    assert rate_at(phase, 3999, steps) == pytest.approx(1e-4)
    assert rate_at(phase, 4000, steps) == pytest.approx(0.95e-4)
    assert rate_at(phase, steps - 1, steps) == pytest.approx(1e-4 * 0.95**4)


# Optimiser, momentum, and the rate's factor after the first epoch, as released.
PUBLISHED = {
    "fcgf-small": ("sgd", 0.8, 0.99),
    "omnet-small": ("adam", None, 1.0),
    "predator-small": ("sgd", 0.98, 0.99),
    "cofinet-small": ("adam", None, 0.95),
    "roitr-small": ("adam", None, 0.95),
    "vrhcf-small": ("adam", None, 0.5),
}


@pytest.mark.parametrize("name", PUBLISHED)
def test_the_networks_of_table_2_see_the_same_pairs_and_fall_as_published(name: str) -> None:
    recipe, first = recipe_file.read(name), recipe_file.read("omnet-small")
    assert (recipe.data, recipe.augmentation, recipe.seed) == (first.data, first.augmentation, first.seed)
    assert recipe.augmentation.rotation == "yaw"
    (phase,) = recipe.phase
    assert (
        phase.steps * phase.accumulate == 480 == 2 * sum(int(s.data.split("#")[1]) for s in recipe.data.train)
    )
    optimizer, momentum, factor = PUBLISHED[name]
    assert phase.optimizer == optimizer
    assert momentum is None or phase.momentum == momentum
    epoch = phase.steps // 2
    rates = [rate_at(phase, step, phase.steps) / phase.rate for step in (epoch - 1, epoch, 2 * epoch - 1)]
    assert rates == pytest.approx([1.0, factor, factor])


def test_sgd_has_its_momentum_and_a_wrong_one_is_refused() -> None:
    network = network_class("fcgf").named("nano")
    phase = Phase(name="p", steps=1, rate=0.1, optimizer="sgd", momentum=0.8, weight_decay=1e-4)
    made = make_optimizer(phase, network)
    assert isinstance(made, torch.optim.SGD)
    (group,) = made.param_groups
    assert (group["lr"], group["momentum"], group["weight_decay"]) == (0.1, 0.8, 1e-4)
    for momentum in (-0.1, 1.0):
        with pytest.raises(ValueError, match=f"momentum={momentum} must be"):
            Phase(name="p", steps=1, momentum=momentum)


def test_rates_rise_then_fall() -> None:
    phase = Phase(name="p", steps=10, rate=1.0, warmup=2, decay="linear")
    rates = [rate_at(phase, step, 10) for step in range(10)]
    assert rates[:3] == [0.5, 1.0, 1.0]
    assert rates[3:] == sorted(rates[3:], reverse=True)
    assert 0.0 < rates[-1] < 0.2


def test_data_replaces_a_source_by_name_or_all_of_them(make_recipe: MakeRecipe) -> None:
    recipe = make_recipe(
        data={"train": [{"data": "a", "name": "near", "weight": 2.0}, {"data": "b", "name": "far"}]},
        phase=[{**PHASE, "data": {"near": 1.0}}],
    )
    one = data_choice.with_data(recipe, ["near=elsewhere"])
    assert [(s.data, s.title, s.weight) for s in one.data.train] == [
        ("elsewhere", "near", 2.0),
        ("b", "far", 1.0),
    ]
    assert one.phase == recipe.phase
    every = data_choice.with_data(recipe, ["x", "y#val"])
    assert [s.data for s in every.data.train] == ["x", "y#val"]
    assert every.phase[0].data == {}


def test_scaling_changes_the_length_alone(make_recipe: MakeRecipe) -> None:
    recipe = make_recipe()
    longer = recipe_file.scaled(recipe, 2.0)
    assert [phase.steps for phase in longer.phase] == [2 * phase.steps for phase in recipe.phase]
    assert dataclasses.replace(longer, phase=recipe.phase) == recipe
    with pytest.raises(ValueError, match="steps-scale 0: must be above 0"):
        recipe_file.scaled(recipe, 0)


def test_data_that_must_be_given_is_asked_for_in_one_sentence(tmp_path: Path) -> None:
    done = CliRunner().invoke(app, ["train", "paper", "--out", str(tmp_path / "run")])
    assert done.exit_code == 2
    assert done.stderr.count("\n") == 1
    assert "--data cross3dreg=" in done.stderr
    assert not (tmp_path / "run").exists()


def test_a_folder_left_open_is_filled_everywhere(make_recipe: MakeRecipe) -> None:
    filled = data_choice.with_data(recipe_file.read("paper"), ["cross3dreg=/data/c3d"])
    assert [s.data for s in filled.data.train] == ["cross3dreg:/data/c3d#train"]
    assert [(s.data, s.pairs) for s in filled.data.val] == [("cross3dreg:/data/c3d#val", 200)]
    data_choice.require_data(filled)
    both = make_recipe(data={"train": [{"data": "{a}", "name": "x"}, {"data": "b", "name": "y"}]})
    other = data_choice.with_data(both, ["a=one", "y=two"])
    assert [s.data for s in other.data.train] == ["one", "two"]


def test_the_papers_rows_are_recipes_of_their_own() -> None:
    rows = {letter: recipe_file.read(f"paper-{letter}").network for letter in "abc"}
    rows["d"] = recipe_file.read("paper").network
    parts = {
        k: (n.omp is not None, n.vgam is not None, n.transformer.self_attention) for k, n in rows.items()
    }
    assert parts == {
        "a": (False, False, "geometric"),
        "b": (True, False, "vanilla"),
        "c": (True, False, "geometric"),
        "d": (True, True, "geometric"),
    }
    for network in rows.values():
        assert network.matching.vote_temperature is None
        assert network.omp is None or not (network.omp.cross_cloud or network.omp.evidence)


def test_range_and_height_do_not_go_with_full_rotations() -> None:
    table = {
        "size": "nano",
        "augmentation": {"rotation": "full"},
        "data": {"train": [{"data": "sim:train/near#1"}]},
        "phase": [{"name": "p", "steps": 1}],
    }
    with pytest.raises(ValueError, match="point_position='radial' means range and height"):
        recipe_file.parse(table, name="r")
    recipe_file.parse({**table, "network": {"vgam": {"point_position": "mlp"}}}, name="r")
    recipe_file.parse({**table, "augmentation": {"rotation": "yaw"}}, name="r")
    recipe_file.parse({**table, "vgam": False}, name="r")


PLAIN = {"data": {"train": [{"data": "a"}], "val": [{"data": "b"}]}, "phase": [PHASE]}


@pytest.mark.parametrize("start", ["cross3dreg-small", "fcgf-small"])
def test_a_start_alone_brings_its_network(start: str) -> None:
    recipe = recipe_file.parse({**PLAIN, "start": start}, name="tuned")
    assert recipe.kind == start.removesuffix("-small")
    assert recipe.network == read_config(start)
    assert "backbone" not in first_network(recipe).untrained()


def test_a_start_of_another_network_is_told() -> None:
    with pytest.raises(
        ValueError, match="'predator-small' holds weights of the network 'predator', not of 'fcgf'"
    ):
        recipe_file.parse({**PLAIN, "network": "fcgf", "start": "predator-small"}, name="tuned")


def test_what_the_recipe_says_of_the_network_counts_before_its_start() -> None:
    recipe = recipe_file.parse({**PLAIN, "size": "nano", "start": "cross3dreg-small"}, name="tuned")
    assert recipe.network == recipe_file.parse({**PLAIN, "size": "nano"}, name="tuned").network
    with pytest.raises(ValueError, match="leave network and size out of the recipe"):
        first_network(recipe)


def test_descriptors_of_patches_train_in_bfloat16() -> None:
    assert recipe_file.parse({**PLAIN, "network": "vrhcf", "precision": "bf16-mixed"}, name="p").precision
