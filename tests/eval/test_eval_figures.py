# SPDX-License-Identifier: MIT
"""The paper's figures from a table that was run, by one command each."""

from __future__ import annotations

import csv
import json
import re
from pathlib import Path

import cv2
import numpy as np
import pytest
from eval_stubs import Moody, Scattered, row

import hybridreg as hr
from hybridreg.cli import main
from hybridreg.eval import PROTOCOLS, table_run
from hybridreg.eval.report import curve_panels, figure_choice, registration_grid, rerun_grid, table_report
from hybridreg.eval.run.controls import Control
from hybridreg.eval.scored_table import Entry, Table
from hybridreg.eval.table_file import Line, Recipe

CROSS = PROTOCOLS["cross3dreg"]
GREEN, RED = (27, 158, 119), (215, 48, 31)


@pytest.fixture(scope="module")
def done(tmp_path_factory: pytest.TempPathFactory) -> tuple[Table, Path]:
    plain = hr.Pipeline(voxel=2.0, match="fpfh", estimate="svd", refine="none")
    lines = (
        Line(name="right by hand", method=Moody(moods=("right",))),
        Line(name="FPFH, SVD", method=plain),
        Line(
            name="FPFH, RANSAC-50K, told",
            method=Control(pipeline=plain.swap(estimate="ransac-50k"), oracle=True),
        ),
    )
    out = tmp_path_factory.mktemp("run")
    recipe = Recipe(title="t", protocols=(CROSS,), lines=lines)
    return table_run.run(recipe, Scattered(4), out, data="scattered"), out


def coloured(path: Path, colour: tuple[int, int, int]) -> np.ndarray:
    """Which pixels are of about a colour, (h, w)."""
    image = cv2.imread(str(path))
    assert image is not None
    return np.abs(image[:, :, ::-1].astype(int) - colour).sum(axis=2) < 60


def test_registrations_frame_what_is_right_in_green(done: tuple[Table, Path], tmp_path: Path) -> None:
    table, _ = done
    entries = figure_choice.methods_of(table, ["right", "FPFH, SVD"])
    files = registration_grid.write(tmp_path, entries, Scattered(4), ["pair-0", "pair-2"], CROSS)
    assert [file.name for file in files] == ["registrations.png", "registrations.pdf"]
    width = coloured(files[0], GREEN).shape[1]
    # Input, two methods, truth: the second quarter is right, the third is not.
    assert coloured(files[0], GREEN)[:, width // 4 : width // 2].sum() > 1000
    assert coloured(files[0], RED)[:, width // 2 : 3 * width // 4].sum() > 1000
    for side in (slice(0, width // 4 - 20), slice(3 * width // 4 + 20, width)):
        assert coloured(files[0], GREEN)[:, side].sum() + coloured(files[0], RED)[:, side].sum() == 0
    assert files[1].read_bytes()[:5] == b"%PDF-"
    assert files[1].stat().st_size < 2_000_000


def test_matches_and_masks_run_again_what_made_them(done: tuple[Table, Path], tmp_path: Path) -> None:
    table, _ = done
    drawn = rerun_grid.write_matches(tmp_path, table.methods, Scattered(4), ["pair-1"], CROSS, table.seed)
    assert [file.name for file in drawn] == ["matches.png", "matches.pdf"]
    # Lines so thin are lighter than their colour.
    image = cv2.imread(str(drawn[0]))
    assert image is not None
    assert (np.ptp(image.astype(int), axis=2) > 60).sum() > 100
    masks = rerun_grid.write_masks(tmp_path, table.methods, Scattered(4), ["pair-1"], table.seed)
    # The control's mask is the truth.
    assert coloured(masks[0], GREEN).sum() > 100 * max(coloured(masks[0], RED).sum(), 1) / 10
    by_hand = figure_choice.methods_of(table, ["right"])
    with pytest.raises(ValueError, match="makes matches"):
        rerun_grid.write_matches(tmp_path, by_hand, Scattered(4), ["pair-1"], CROSS, 0)
    with pytest.raises(ValueError, match="leaves anything out"):
        rerun_grid.write_masks(tmp_path, by_hand, Scattered(4), ["pair-1"], 0)


def test_curves_have_a_panel_an_estimator_and_their_numbers_in_a_file(
    done: tuple[Table, Path], tmp_path: Path
) -> None:
    table, _ = done
    files = curve_panels.write(tmp_path, table.methods, CROSS)
    assert [file.name for file in files] == ["curves.png", "curves.pdf", "curves.csv"]
    lines = list(csv.DictReader(files[2].read_text().splitlines()))
    assert {line["estimator"] for line in lines} == {"other", "weighted SVD", "RANSAC-50K"}
    at = [line for line in lines if line["moves"] == "rre deg" and float(line["threshold"]) == 2.0]
    recall = {line["method"]: float(line["recall"]) for line in at}
    assert recall == {
        entry.name: pytest.approx(table.scores(CROSS)[entry.name].recall) for entry in table.methods
    }
    for line in lines:
        assert float(line["threshold"]) >= 0.0
        assert 0.0 <= float(line["recall"]) <= 1.0


def made(name: str, *errors: float) -> Entry:
    return Entry(name=name, rows=[row(i, 0.1, e) for i, e in enumerate(errors)])


def test_worst_pairs_are_those_of_the_largest_errors_over_all_methods() -> None:
    entries = [made("a", 0.1, 5.0, 0.2), made("b", 0.1, 0.1, 9.0)]
    ids = [each.id for each in entries[0].rows]
    assert figure_choice.pairs_of(entries, CROSS, worst=2) == [ids[2], ids[1]]
    assert figure_choice.pairs_of(entries, CROSS, first=2) == ids[:2]
    assert figure_choice.pairs_of(entries, CROSS, [ids[1]]) == [ids[1]]
    with pytest.raises(ValueError, match="no row is of the pair 'elsewhere'"):
        figure_choice.pairs_of(entries, CROSS, ["elsewhere"])
    with pytest.raises(ValueError, match="no pair of known truth"):
        figure_choice.pairs_of([], CROSS)


def test_methods_are_named_by_how_they_begin() -> None:
    entries = [made(f"({letter}) row", 0.1) for letter in "abcdefgh"]
    table = Table(title="t", data="d", seed=0, starts=0, entries=entries)
    assert figure_choice.methods_of(table) == entries[:6]
    assert figure_choice.methods_of(table, ["(h)", "(a) row"]) == [entries[7], entries[0]]
    with pytest.raises(ValueError, match=r"no line is called '\(z\)'; there are \(a\) row"):
        figure_choice.methods_of(table, ["(z)"])


@pytest.mark.parametrize("kind", ["registrations", "matches", "curves", "masks"])
def test_one_command_each(
    kind: str, tmp_path: Path, real_data: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run = tmp_path / "run"
    stages = 'overlap = "visibility"\nmatch = "fpfh"\nestimate = "svd"\nrefine = "none"\n'
    (tmp_path / "t.toml").write_text(f'[[row]]\nname = "seen"\nvoxel = 1.0\n{stages}')
    data = tmp_path / "data"
    data.mkdir()
    for name in ("pandaset-001-gt-to-p64", "rellis-vlp32-to-os64"):
        if (real_data / name).is_dir():
            (data / name).symlink_to(real_data / name)
    for arguments in (
        ("table", str(tmp_path / "t.toml"), "--data", str(data), "--out", str(run)),
        ("figure", kind, str(run), "--worst", "1"),
    ):
        with pytest.raises(SystemExit) as left:
            main(arguments)
        assert not left.value.code
    assert f"{kind}.png" in capsys.readouterr().out
    assert (run / "figures" / f"{kind}.pdf").is_file()


def test_poses_between_map_coordinates_are_drawn_where_the_clouds_are(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    far = Scattered(1, offset=500_000.0)
    truth = far[0].T_target_source
    one = row(0, 0.0, 0.0, id="pair-0", T=truth.tolist(), T_true=truth.tolist())
    lost = row(0, 0.0, 0.0, id="pair-0", T=None, T_true=truth.tolist())
    entries = [Entry(name="right", rows=[one]), Entry(name="lost", rows=[lost])]

    drawn: list[np.ndarray] = []
    monkeypatch.setattr(registration_grid, "draw_clouds", lambda axes, source, *_: drawn.append(source))
    registration_grid.write(tmp_path, entries, far, ["pair-0"], CROSS)
    came, true, right, lost_at = drawn
    assert np.allclose(right, true, atol=1e-6)
    assert np.array_equal(lost_at, came)
    assert np.abs(true).max() < 1e4

    table = Table(title="t", data="d", seed=0, starts=0, entries=entries)
    page = table_report.html(table, (CROSS,), far)
    stored = re.findall(r'<script type="application/json">(.*?)</script>', page)
    views = [{layer["name"]: layer for layer in json.loads(each)["layers"]} for each in stored]
    assert len(views) == 2
    lows = [{name: layer["low"] for name, layer in view.items()} for view in views]
    assert any(np.allclose(each["source, aligned"], each["source, true pose"], atol=1e-3) for each in lows)
    assert any(np.allclose(each["source, aligned"], each["source, before"], atol=1e-3) for each in lows)
    assert all(np.abs(low).max() < 1e4 for each in lows for low in each.values())
