# SPDX-License-Identifier: MIT
"""How much a method has learned from stands beside its figures."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import pytest
from eval_stubs import Scattered

import hybridreg as hr
from hybridreg.eval import stored_table, table_file, table_run
from hybridreg.eval.report import formats
from hybridreg.eval.run.controls import Control
from hybridreg.eval.scored_table import Table
from hybridreg.io import shipped_weights

STILL = {"voxel": 0.5, "match": "none", "estimate": "identity", "refine": "none"}


def trained(folder: Path, visits: object) -> str:
    """A folder that counts as one of weights, with a card."""
    folder.mkdir()
    for name in (shipped_weights.CONFIG_FILE, shipped_weights.WEIGHTS_FILE):
        (folder / name).touch()
    if visits is not None:
        (folder / shipped_weights.CARD_FILE).write_text(json.dumps({"visits": visits}))
    return str(folder)


def test_visits_are_those_of_the_cards_of_all_stages(tmp_path: Path) -> None:
    few, many, none = (trained(tmp_path / str(count), count) for count in (720, 39_800, None))
    pipeline = hr.Pipeline(overlap=hr.PredatorOverlap(weights=many), match=hr.Fcgf(weights=few))
    assert shipped_weights.visits_of(pipeline) == 39_800
    assert shipped_weights.visits_of(Control(pipeline=pipeline.swap(overlap="none"))) == 720
    regressed = hr.Pipeline(match="none", estimate=hr.OmNet(weights=few))
    assert shipped_weights.visits_of(regressed) == 720
    assert shipped_weights.visits_of(hr.Pipeline(match=hr.Fcgf(weights=none))) is None
    assert shipped_weights.visits_of(hr.Pipeline(match="fpfh")) is None
    assert shipped_weights.visits(tmp_path / "nowhere") is None
    for card, told in (({"visits": "many"}, None), ([], None)):
        (Path(few) / shipped_weights.CARD_FILE).write_text(json.dumps(card))
        assert shipped_weights.visits(few) is told


def test_every_format_has_the_column_where_a_method_learned(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    read = table_file.parse({"base": STILL, "row": [{"name": "learned"}, {"name": "by hand"}]})
    told = iter((39_800, None))
    monkeypatch.setattr(shipped_weights, "visits_of", lambda _: next(told))
    table_run.run(read, Scattered(1), tmp_path, data="scattered")
    done = stored_table.load(tmp_path)
    assert done.visits == {"learned": 39_800}
    results = formats.tables(done, read.protocols[0])["Results"]
    assert [line["visits"] for line in results] == ["–", "39,800", "–"]
    assert "39,800" in formats.latex(done, read.protocols)
    assert "Visits are" in formats.markdown(done, read.protocols)
    rows = csv.DictReader(formats.table_csv(done, read.protocols).splitlines())
    assert {(row["method"], row["visits"]) for row in rows} == {
        ("identity", ""), ("learned", "39800"), ("by hand", ""),
    }  # fmt: skip


def test_a_table_of_methods_that_learn_nothing_has_no_such_column(tmp_path: Path) -> None:
    read = table_file.parse({"base": STILL, "row": [{"name": "by hand"}]})
    table_run.run(read, Scattered(1), tmp_path, data="scattered")
    done: Table = stored_table.load(tmp_path)
    assert all("visits" not in line for line in formats.tables(done, read.protocols[0])["Results"])
    assert "isits" not in formats.markdown(done, read.protocols)
    assert "visits" not in formats.table_csv(done, read.protocols)
