# SPDX-License-Identifier: MIT
"""Pictures of both clouds before and after; of matches and masks, right in green and wrong in red."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
from eval_stubs import Moody, Scattered

import hybridreg as hr
from hybridreg import testing
from hybridreg.eval import PROTOCOLS, table_run
from hybridreg.eval.report import cloud_pictures, rerun_for_pictures, stage_pictures
from hybridreg.eval.run.controls import Control
from hybridreg.eval.scored_table import Entry
from hybridreg.eval.table_file import Line, Recipe
from hybridreg.geometry import se3
from hybridreg.matches import Correspondences, Overlap
from hybridreg.pair import LabelledPair
from hybridreg.pipeline import Trace

ORANGE, BLUE = np.array([217, 95, 2]), np.array([59, 111, 182])
GREEN, RED, YELLOW = (27, 158, 119), (215, 48, 31), (230, 171, 2)


@pytest.fixture(scope="module")
def traced() -> tuple[Trace, np.ndarray]:
    """A run with right matches only, and the true mask."""
    pair, T = testing.sample_pair(n_points=900)
    labelled = LabelledPair(pair=pair, T_target_source=T)
    pipeline = hr.Pipeline(voxel=0.5, match="none", estimate="identity", refine="none")
    told, _ = Control(pipeline=pipeline, oracle=True).told(labelled)
    trace = told.trace(pair)
    source = trace.scene.source.points[::10]
    return replace(trace, matches=Correspondences.of(source, se3.apply(T, source))), T


def count(path: Path, colour: tuple[int, int, int]) -> int:
    """Pixels of about a colour."""
    image = cv2.imread(str(path))
    assert image is not None
    return int((np.abs(image[:, :, ::-1].astype(int) - colour).sum(axis=2) < 60).sum())


def test_right_matches_are_green_lines_and_wrong_ones_red(
    traced: tuple[Trace, np.ndarray], tmp_path: Path
) -> None:
    trace, T = traced
    stage_pictures.matches(tmp_path / "right.png", trace, T)
    swapped = Correspondences.of(trace.matches.source, trace.matches.target[::-1])
    stage_pictures.matches(tmp_path / "wrong.png", replace(trace, matches=swapped), T)
    # The legend has both colours.
    assert count(tmp_path / "right.png", GREEN) > 20 * max(count(tmp_path / "right.png", RED), 1)
    assert count(tmp_path / "wrong.png", RED) > 20 * max(count(tmp_path / "wrong.png", GREEN), 1)
    # Off by 0.4 m they are right at 1 m, and wrong at 0.3 m.
    off = Correspondences.of(trace.matches.source, trace.matches.target + [0.4, 0.0, 0.0])
    for radius, wanted, other in ((1.0, GREEN, RED), (0.3, RED, GREEN)):
        stage_pictures.matches(tmp_path / "off.png", replace(trace, matches=off), T, radius)
        assert count(tmp_path / "off.png", wanted) > 20 * max(count(tmp_path / "off.png", other), 1)


def test_a_true_mask_has_no_wrong_colour_and_a_turned_one_little_else(
    traced: tuple[Trace, np.ndarray], tmp_path: Path
) -> None:
    trace, T = traced
    trace = replace(trace, scene=replace(trace.scene, pair=replace(trace.scene.pair, image=None)))
    file = tmp_path / "mask.png"
    stage_pictures.mask(file, trace, T)
    right = count(file, GREEN), count(file, RED), count(file, YELLOW)
    turned = Overlap(1.0 - trace.overlap.source, 1.0 - trace.overlap.target)
    stage_pictures.mask(file, replace(trace, overlap=turned), T)
    wrong = count(file, GREEN), count(file, RED), count(file, YELLOW)
    assert right[0] > 3 * wrong[0]
    assert wrong[1] > 3 * right[1]
    assert wrong[2] > 3 * right[2]


def test_the_image_stands_beside_the_mask(traced: tuple[Trace, np.ndarray], tmp_path: Path) -> None:
    trace, T = traced
    blue = np.full((72, 128, 3), (10, 20, 250), np.uint8)
    for name, image in (("with", blue), ("without", None)):
        pair = replace(trace.scene.pair, image=image)
        stage_pictures.mask(
            tmp_path / f"{name}.png", replace(trace, scene=replace(trace.scene, pair=pair)), T
        )
    assert count(tmp_path / "with.png", (10, 20, 250)) > 20_000
    assert count(tmp_path / "without.png", (10, 20, 250)) == 0


def test_a_table_is_drawn_again(tmp_path: Path) -> None:
    pipeline = hr.Pipeline(voxel=2.0, match="fpfh", estimate="svd", refine="none")
    lines = (
        Line(name="Plain", method=pipeline),
        Line(name="told", method=Control(pipeline=pipeline, oracle=True)),
        Line(name="function", method=Moody(moods=("right",))),
    )
    recipe = Recipe(title="t", protocols=(PROTOCOLS["cross3dreg"],), lines=lines)
    done = table_run.run(recipe, Scattered(3), tmp_path / "run", data="scattered")
    files = rerun_for_pictures.redraw(done, recipe.protocols[0], Scattered(3), tmp_path / "pictures", 2)
    assert [file.relative_to(tmp_path / "pictures").as_posix() for file in files] == [
        "plain/pair-0-matches.png",
        "plain/pair-1-matches.png",
        "told/pair-0-matches.png",
        "told/pair-0-mask.png",
        "told/pair-1-matches.png",
        "told/pair-1-mask.png",
    ]
    assert all(file.stat().st_size > 10_000 for file in files)


def columns(half: np.ndarray, colour: np.ndarray) -> np.ndarray:
    """Columns of a panel, below its legend, where many pixels have a colour."""
    near = np.abs(half[120:-60] - colour).sum(axis=2) < 90
    return np.flatnonzero(near.sum(axis=0) > 8)


def test_the_picture_shows_both_clouds_before_and_after(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    target = np.column_stack([rng.uniform(-20, 20, (40_000, 2)), np.zeros(40_000)])
    source = target[target[:, 0] > 0] - [60.0, 0.0, 0.0]
    cloud_pictures.before_after(
        tmp_path / "p.png", source, target, se3.from_rt(np.eye(3), np.array([60.0, 0.0, 0.0]))
    )
    image = cv2.imread(str(tmp_path / "p.png"))[:, :, ::-1].astype(int)
    before, after = image[:, : image.shape[1] // 2], image[:, image.shape[1] // 2 :]
    assert columns(before, ORANGE).max() < columns(before, BLUE).min()
    # Aligned, the source covers the right half of the target, so blue is left where orange begins.
    orange, blue = columns(after, ORANGE), columns(after, BLUE)
    assert abs(orange.min() - blue.max()) < 10
    assert abs(np.ptp(orange) - np.ptp(blue)) < 10
    assert list(tmp_path.iterdir()) == [tmp_path / "p.png"]


def test_map_returns_far_away_do_not_shrink_the_scene() -> None:
    near = np.random.default_rng(0).uniform(-10, 10, (1000, 3))
    stray = np.vstack([near, [[900.0, 900.0, 0.0]]])
    low, high = cloud_pictures.window(stray)
    assert np.all(high - low < 30.0)


def test_what_was_known_beforehand_is_known_again_when_pictures_are_drawn() -> None:
    pipeline = hr.Pipeline(voxel=0.5, match="none", estimate="identity", prior={"max_rotation": 5.0})
    again = rerun_for_pictures.control_of(Entry(name="m", rows=[], config={"method": pipeline.to_spec()}))
    assert again is not None
    assert again.pipeline == pipeline
