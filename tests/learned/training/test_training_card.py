# SPDX-License-Identifier: MIT
"""A card says what the run did, and nothing else."""

from __future__ import annotations

import dataclasses
import json
import math
import stat
from pathlib import Path

import pytest
from training_runs import Run, log

from hybridreg.data import open_dataset
from hybridreg.data.dataset import fingerprint_of
from hybridreg.io import shipped_weights
from hybridreg.learned.training import recipe_file, ship
from hybridreg.learned.training.card import make_card, write_card
from hybridreg.learned.training.checkpoint import Progress
from hybridreg.learned.training.curve_files import CurveFile
from hybridreg.learned.training.data.pair_source import open_source
from hybridreg.learned.training.validation import Validation, rank, validate
from hybridreg.learned.weights import from_pretrained


def test_the_figures_are_those_of_the_run(whole: Run) -> None:
    card = json.loads((whole.out / "best" / "card.json").read_text())
    assert (card["name"], card["seed"], card["steps"], card["skipped"]) == ("tiny", 3, 8, {})
    network = from_pretrained(whole.out / "best")
    assert card["parameters"] == sum(p.numel() for p in network.parameters())
    pairs = open_dataset(whole.recipe.data.train[0].data)
    assert card["train"] == [{"name": "yards", "pairs": 2, "fingerprint": fingerprint_of(pairs)}]
    assert card["val"][0]["pairs"] == 1
    lines = log(whole.out, "validation.csv")
    assert card["validation"] == [line for line in lines if line == card["validation"][0]]
    assert (card["hours"] == 0.0) or 0.0 < card["hours"] < 0.2
    assert recipe_file.build(type(whole.recipe), card["recipe"], "card") == whole.recipe
    text = (whole.out / "best" / "card.md").read_text()
    for value in ("8 steps", "seed 3", card["validation"][0]["inlier_ratio"]):
        assert value in text


def test_a_figure_that_there_is_none_of_is_a_dash(whole: Run, tmp_path: Path) -> None:
    card = json.loads((whole.out / "best" / "card.json").read_text())
    card["validation"][0]["pir"] = "nan"
    write_card(tmp_path, card)
    assert card["validation"][0]["inlier_ratio"] + " | – | " in (tmp_path / "card.md").read_text()


@pytest.mark.parametrize("name", shipped_weights.names())
def test_a_shipped_card_counts_the_visits_of_all_runs_before_it(name: str) -> None:
    """A start is the folder of a run, named after its recipe."""

    def chain(recipe: str) -> int:
        read = recipe_file.read(recipe)
        before = chain(Path(read.start).parent.name) if read.start else 0
        return before + sum(phase.steps * phase.accumulate for phase in read.phase)

    assert shipped_weights.visits(name) == chain(name)


def test_a_run_counts_what_its_start_has_seen(whole: Run, tmp_path: Path) -> None:
    start = ship.ship(whole.out / "best", tmp_path)
    seen = shipped_weights.visits(start)
    assert seen == 8
    recipe = dataclasses.replace(whole.recipe, start=str(start))
    card = make_card(recipe, Progress(visits=5), [], [], CurveFile(tmp_path / "none.csv", ()), 1, "CPU")
    assert card["visits"] == 13


def test_the_weights_on_disk_reach_the_figures_of_the_card(whole: Run) -> None:
    card = json.loads((whole.out / "best" / "card.json").read_text())["validation"][0]
    network = from_pretrained(whole.out / "best")
    source = open_source(whole.recipe.data.val[0], whole.recipe, whole.out / "cache")
    again = validate(
        network, source, matcher=card["phase"] == "matching", device=network.in_proj.weight.device
    )
    for name in ("recall", "rre_deg", "inlier_ratio", "pir", "mask_f1"):
        assert getattr(again, name) == pytest.approx(float(card[name]), rel=1e-4), name
    assert network.training, "a validation leaves the network ready to go on"


def test_weights_can_be_read_by_others(whole: Run) -> None:
    modes = {file.name: stat.S_IMODE(file.stat().st_mode) for file in (whole.out / "best").iterdir()}
    assert set(modes) == {"model.safetensors", "config.json", "card.json", "card.md"}
    assert len(set(modes.values())) == 1, modes


def test_every_phase_is_validated_at_its_end(whole: Run) -> None:
    lines = log(whole.out, "validation.csv")
    assert [(line["total"], line["phase"]) for line in lines] == [
        ("3", "warm-up"), ("4", "warm-up"), ("7", "matching"), ("8", "matching"),
    ]  # fmt: skip
    assert lines[0]["recall"] == "nan", "a warm-up has no matcher to measure"
    assert math.isfinite(float(lines[3]["recall"]))


def test_the_log_tells_each_loss_where_it_was_computed(whole: Run) -> None:
    lines = log(whole.out)
    assert [line["total"] for line in lines] == ["2", "4", "6", "8"]
    for line in lines:
        filled = {name for name in ("infonce", "coarse", "fine", "mask", "pir", "ir") if line[name]}
        warm = {"infonce"}
        assert filled == (warm if line["phase"] == "warm-up" else {"coarse", "fine", "mask", "pir", "ir"})
    assert float(lines[1]["rate"]) == pytest.approx(2e-3 * 1 / 2)
    assert float(lines[3]["loss"]) == pytest.approx(
        sum(float(lines[3][name]) for name in ("coarse", "fine", "mask")), rel=1e-4
    )


def test_any_matcher_ranks_above_a_warm_up_and_recall_above_inliers() -> None:
    def made(recall: float, inliers: float) -> list[Validation]:
        return [Validation(title="v", pairs=1, recall=recall, rre_deg=1.0, rte_m=1.0, inlier_ratio=inliers,
                           pir=0.0, mask_f1=0.0)]  # fmt: skip

    warm = rank(made(float("nan"), 0.9), False)
    ordered = [warm, rank(made(0.0, 0.1), True), rank(made(0.0, 0.2), True), rank(made(0.5, 0.0), True)]
    assert ordered == sorted(ordered)
    assert len(set(ordered)) == 4
