# SPDX-License-Identifier: MIT
from __future__ import annotations

import csv
from pathlib import Path

import pytest

from hybridreg.io.csv_cells import cell

FORMULAS = [
    "=1+1",
    "+cmd",
    "-2+3",
    "@SUM(A1)",
    "\t=1",
    "\r=1",
    "\n=1",
    "  =1",
    "＝1",
    "=HYPERLINK('x')",
    "-",
    "--",
]
PLAIN = ["", "icp", "a=b", "1-2", "-0.5", "+3", "-1e-9", "-inf", "nan", " -4 ", "–"]


@pytest.mark.parametrize("text", FORMULAS)
def test_what_a_spreadsheet_would_run_is_text(text: str) -> None:
    assert cell(text) == f"'{text}"


@pytest.mark.parametrize("text", PLAIN)
def test_numbers_and_plain_texts_stay(text: str) -> None:
    assert cell(text) == text


@pytest.mark.parametrize("value", [-1, -0.5, float("nan"), True, None])
def test_what_is_no_text_stays(value: object) -> None:
    assert cell(value) is value


def test_training_curves_hold_no_formula(tmp_path: Path) -> None:
    pytest.importorskip("torch")
    from hybridreg.learned.training.curve_files import CurveFile

    curve = CurveFile(tmp_path / "log.csv", ("phase", "loss"))
    curve.begin(0)
    curve.append({"total": 1, "phase": "=cmd|' /C calc'!A0", "loss": -0.25})
    text = (tmp_path / "log.csv").read_text()
    (row,) = csv.DictReader(text.splitlines())
    assert row["phase"].startswith("'=")
    assert float(row["loss"]) == -0.25
