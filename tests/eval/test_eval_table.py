# SPDX-License-Identifier: MIT
from __future__ import annotations

import csv
import dataclasses
import io
import itertools
import json
import re
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from eval_stubs import Moody, RowByRow, Scattered, row

from hybridreg.eval import PROTOCOLS, read, stored_table, table_run
from hybridreg.eval.report import formats, plotly_figures, table_report
from hybridreg.eval.report.line_styles import styles
from hybridreg.eval.run.row import Row
from hybridreg.eval.scored_table import Entry, Table
from hybridreg.eval.table_file import Line, Recipe

CROSS, KITTI, PREDATOR = (PROTOCOLS[name] for name in ("cross3dreg", "kitti", "predator"))
RECIPE = Recipe(
    title="Stubs & friends",
    protocols=(CROSS, KITTI),
    seed=2,
    starts=1,
    lines=(
        Line(name="exact", method=RowByRow()),
        Line(name="moody_<b>", method=Moody(moods=("right",))),
        Line(name="odd", method=None, problem="needs 'group'"),
    ),
)


@pytest.fixture(scope="module")
def ran(tmp_path_factory: pytest.TempPathFactory) -> tuple[Table, Path]:
    out = tmp_path_factory.mktemp("table")
    return table_run.run(RECIPE, Scattered(3), out, data="scattered"), out


def test_runs_every_line_on_every_start(ran: tuple[Table, Path]) -> None:
    done, out = ran
    assert [entry.name for entry in done.entries] == ["identity", "exact", "moody_<b>"]
    ids = [f"pair-{i}{at}" for i in range(3) for at in ("", "@yaw1")]
    assert all([r.id for r in entry.rows] == ids for entry in done.entries)
    assert done.problems == {"odd": "needs 'group'"}
    scores = done.scores(KITTI)
    assert (scores["exact"].recall, scores["identity"].recall) == (1.0, 0.0)
    assert sorted(p.name for p in (out / "predictions").iterdir()) == ["exact.jsonl", "moody-b.jsonl"]


def test_the_identity_row_is_the_motion_of_the_pairs(ran: tuple[Table, Path]) -> None:
    done, _ = ran
    truths = [np.array(r.T_true) for r in done.entries[1].rows]
    expected = np.mean([np.linalg.norm(T[:3, 3]) for T in truths])
    assert done.scores(CROSS)["identity"].rte_m_all == pytest.approx(expected)


def test_running_again_runs_nothing(ran: tuple[Table, Path]) -> None:
    done, out = ran
    before = (out / "predictions" / "exact.jsonl").read_bytes()
    heard: list[tuple[str, Row]] = []
    table_run.run(RECIPE, Scattered(3), out, data="scattered", on_row=lambda name, r: heard.append((name, r)))
    assert (out / "predictions" / "exact.jsonl").read_bytes() == before
    assert [name for name, _ in heard] == ["exact"] * 6 + ["moody_<b>"] * 6
    again = stored_table.load(out)
    assert [entry.rows for entry in again.entries] == [entry.rows for entry in done.entries]


def test_a_changed_line_is_refused(ran: tuple[Table, Path]) -> None:
    _, out = ran
    changed = dataclasses.replace(RECIPE, lines=(Line(name="exact", method=RowByRow(slip=1.0)),))
    with pytest.raises(ValueError, match=r"exact\.jsonl was made by another configuration .*slip"):
        table_run.run(changed, Scattered(3), out, data="scattered")


def test_files_of_the_same_data_make_a_table(ran: tuple[Table, Path], tmp_path: Path) -> None:
    _, out = ran
    files = [out / "predictions" / name for name in ("moody-b.jsonl", "exact.jsonl")]
    assert [entry.name for entry in stored_table.of_files(files).entries] == ["identity", "moody-b", "exact"]
    again = tmp_path / "again" / "predictions" / "exact.jsonl"
    again.parent.mkdir(parents=True)
    again.write_bytes(files[1].read_bytes())
    both = stored_table.of_files([files[1], again])
    assert [entry.name for entry in both.methods] == [f"{out.name}/exact", "again/exact"]
    own = tmp_path / "identity.jsonl"
    own.write_bytes(files[0].read_bytes())
    assert [entry.name for entry in stored_table.of_files([own]).entries] == ["identity", "identity.jsonl"]
    table_run.run(dataclasses.replace(RECIPE, starts=0), Scattered(2), tmp_path, data="scattered")
    with pytest.raises(ValueError, match="of other data"):
        stored_table.of_files([files[0], tmp_path / "predictions" / "exact.jsonl"])


def test_compared_files_tell_of_their_starts(ran: tuple[Table, Path]) -> None:
    done, out = ran
    compared = stored_table.of_files(stored_table.files_in(out))
    assert compared.starts == done.starts == 1
    assert "3 pairs, each as it is and under 1 random yaw rotation, 6 runs" in compared.caption(CROSS)


def test_another_run_in_one_folder_tells_of_the_lines_it_no_longer_shows(tmp_path: Path) -> None:
    one, two = (dataclasses.replace(RECIPE, lines=(line,)) for line in RECIPE.lines[:2])
    table_run.run(one, Scattered(2), tmp_path, data="scattered")
    with pytest.warns(
        UserWarning, match=r"held a table with exact, .*report .*exact\.jsonl .*moody-b\.jsonl"
    ):
        table_run.run(two, Scattered(2), tmp_path, data="scattered")
    # What an earlier table left beside it is no part of this one.
    assert [path.name for path in stored_table.files_in(tmp_path)] == ["moody-b.jsonl"]
    assert (tmp_path / "predictions" / "exact.jsonl").is_file()


def test_a_folder_without_a_table_says_so(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError, match="no table was run there"):
        stored_table.load(tmp_path)


def test_caption_names_data_starts_and_protocol(ran: tuple[Table, Path]) -> None:
    caption = ran[0].caption(CROSS)
    for part in ("Stubs & friends", "scattered", "3 pairs", "1 random yaw rotation, 6 runs", "protocol cross3dreg",
                 "RRE < 2° and RTE < 0.5 m", "within 1 m", "over all pairs"):  # fmt: skip
        assert part in caption


def test_markdown_tells_all_that_was_promised(ran: tuple[Table, Path]) -> None:
    text = formats.markdown(ran[0], RECIPE.protocols)
    head = next(line for line in text.splitlines() if line.startswith("| method | recall %"))
    for column in ("95 % interval", "RRE° all", "RTE m all", "RRE° successes", "RTE m successes", "RRE° median",
                   "RTE m median", "inliers %", "no pose", "s a pair", "peak MB",
                   "recall % unrefined"):  # fmt: skip
        assert f"| {column} " in head
    widths = {line.count("|") for line in text.splitlines() if line.startswith("| ") and "moody" not in line}
    assert all(line.endswith(" |") for line in text.splitlines() if line.startswith("|")), widths
    assert text.count("| identity | 0.0 |") >= 2
    assert "| exact | 100.0 | 100.0 to 100.0 | 0.00 | 0.00 |" in text
    assert "2°, 0.5 m" in text
    assert "Not run: odd. needs 'group'" in text
    assert "seed 2" in text


def test_the_criterion_average_has_its_own_columns() -> None:
    rows = [row(0, 1.0, 0.4), row(1, 3.0, 8.0)]
    odd = Table(title="t", data="d", seed=0, starts=0, entries=[Entry(name="m", rows=rows)])
    lines = formats.tables(odd, PREDATOR)["Results"]
    assert (lines[0]["RRE° criterion"], lines[0]["RTE m criterion"]) == ("2.00", "0.40")
    assert "RRE° criterion" not in formats.tables(odd, KITTI)["Results"][0]


def test_verdicts_are_counted_against_success() -> None:
    words = ["ok", "ok", "doubtful", "failed"]
    rows = [
        row(i, rre, 0.1, verdict=word)
        for i, (rre, word) in enumerate(zip((1, 50, 1, 50), words, strict=True))
    ]
    judged = Table(title="t", data="d", seed=0, starts=0, entries=[Entry(name="m", rows=rows)])
    assert formats.tables(judged, KITTI)["Verdict against success"] == [
        {"method": "m", '"ok"': "1 right of 2", '"doubtful"': "1 right of 1", '"failed"': "0 right of 1"}
    ]


def test_recall_by_overlap() -> None:
    rows = [row(0, 1, 0.1, overlap=0.1), row(1, 50, 0.1, overlap=0.2), row(2, 1, 0.1, overlap=1.0)]
    sparse = Table(title="t", data="d", seed=0, starts=0, entries=[Entry(name="m", rows=rows)])
    assert formats.tables(sparse, KITTI)["Recall by overlap"] == [
        {"method": "m", "overlap 0 to 0.3": "50.0 (2 pairs)", "overlap 0.3 to 0.6": "– (0 pairs)",
         "overlap 0.6 to 1": "100.0 (1 pair)"}
    ]  # fmt: skip


def test_latex_is_escaped_and_balanced(ran: tuple[Table, Path]) -> None:
    text = formats.latex(ran[0], RECIPE.protocols)
    assert text.count(r"\begin{table}") == text.count(r"\end{table}") == 2
    assert r"Stubs \& friends" in text
    # As papers print it: the method and four columns.
    assert text.count(r"Method & RRE ($^\circ$) & RTE (m) & RR (\%) & IR (\%) \\") == 2
    assert text.count(r"\begin{tabular}{lrrrr}") == 2
    assert r"moody\_$<$b$>$" in text
    assert not re.search(r"(?<!\\)[%#]", text)
    body = [line for line in text.splitlines() if line.endswith(r"\\")]
    assert len({line.count(" & ") for line in body}) == 1
    assert "°" not in text


def test_csv_holds_full_numbers(ran: tuple[Table, Path]) -> None:
    lines = list(csv.DictReader(io.StringIO(formats.table_csv(ran[0], RECIPE.protocols))))
    assert [line["method"] for line in lines if line["not run"]] == ["odd"]
    assert [(line["method"], line["protocol"]) for line in lines if not line["not run"]] == [
        (m, p) for p in ("cross3dreg", "kitti") for m in ("identity", "exact", "moody_<b>")
    ]
    assert float(lines[0]["rte_m_all"]) == ran[0].scores(CROSS)["identity"].rte_m_all
    assert float(lines[1]["seconds match"]) == pytest.approx(0.1)


def test_fine_print_counts_scenes_not_copies(ran: tuple[Table, Path]) -> None:
    text = formats.fine_print(ran[0])
    assert "all 3 scenes agree" in text
    assert "100 percentage points" in text


def test_reliability_bins_against_counting() -> None:
    confidence = np.array([0.05, 0.1, 0.5, 0.95, 1.0, 0.9])
    success = np.array([False, True, True, True, True, False])
    bins = plotly_figures.reliability_bins(confidence, success)
    assert bins == pytest.approx(np.array([[0.075, 0.5, 2], [0.5, 1.0, 1], [0.95, 2 / 3, 3]]))
    assert plotly_figures.reliability_bins(np.zeros(0), np.zeros(0, bool)).shape == (0, 3)


class Outline(HTMLParser):
    """What a browser would fetch, and whether tags close."""

    def __init__(self) -> None:
        super().__init__()
        self.fetched: list[str] = []
        self.open: list[str] = []
        self.bold = 0

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.fetched += [f"{tag} {value}" for key, value in attrs if key in ("src", "href", "data")]
        self.bold += tag == "b"
        if tag not in ("meta", "input", "br"):
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag


@pytest.fixture(scope="module")
def written(ran: tuple[Table, Path], tmp_path_factory: pytest.TempPathFactory) -> Path:
    from hybridreg.data import yaw_starts

    out = tmp_path_factory.mktemp("report")
    table_report.write(ran[0], RECIPE.protocols, out, yaw_starts(Scattered(3), 1, 2))
    return out


def test_the_page_is_whole_and_fetches_nothing(written: Path) -> None:
    assert sorted(p.name for p in written.iterdir()) == ["report.html", "table.csv", "table.md", "table.tex"]
    outline = Outline()
    outline.feed((written / "report.html").read_text())
    assert outline.fetched == []
    assert outline.open == []
    assert outline.bold == 0, "a method's name was not escaped"


def test_the_page_holds_plotly_once_curves_and_views(written: Path) -> None:
    text = (written / "report.html").read_text()
    assert text.count("plotly.js v") == 1
    # Of each protocol: two curves for each of two estimators, and two pictures of the confidence.
    assert text.count("Plotly.newPlot(") == 2 * (2 * 2 + 2)
    views = [json.loads(each) for each in re.findall(r'<script type="application/json">(.*?)</script>', text)]
    assert len(views) == 8
    names = ["target", "source, aligned", "source, true pose", "source, before"]
    assert all([layer["name"] for layer in view["layers"]] == names for view in views)
    assert all(layer["shown"] for view in views for layer in view["layers"][:3]), "the truth is seen at once"
    outside = text.replace(plotly_figures.script(), "")
    assert set(re.findall(r"https?://[^\"' ]*", outside)) <= {"https://plot.ly"}, (
        "only plotly's own setting, unused"
    )


def test_the_list_of_pairs_is_data_for_the_filter(written: Path) -> None:
    text = (written / "report.html").read_text()
    stored = re.search(r'id="pairs-data">(.*?)</script>', text, re.DOTALL)
    assert stored is not None
    data = json.loads(stored.group(1))
    assert len(data["rows"]) == 12
    assert {line[data["success"]] for line in data["rows"]} == {"yes"}
    assert data["rows"][0][:2] == ["exact", "pair-0"]


def test_worst_pairs_take_turns_and_start_with_the_largest_error() -> None:
    entries = [
        Entry(name="a", rows=[row(0, 1, 0.1), row(1, 90, 0.1), dataclasses.replace(row(2, 0, 0), T=None)]),
        Entry(
            name="b", rows=[row(0, 1, 9.0), row(1, 2, 0.1), Row(index=2, id="pair-2", error="OSError: gone")]
        ),
    ]
    both = Table(title="t", data="d", seed=0, starts=0, entries=entries)
    found = [(name, r.id) for name, r in table_report.worst(both, CROSS)]
    assert len(found) == 5, "a pair that could not be read cannot be shown"
    assert [name for name, _ in found] == ["a", "b", "a", "b", "a"]
    assert found[1] == ("b", "pair-0")
    assert found[-1] == ("a", "pair-0")


def test_without_data_the_page_says_so(ran: tuple[Table, Path]) -> None:
    text = table_report.html(ran[0], (CROSS,))
    assert "no views" in text
    assert 'class="orbit"' not in text


@pytest.mark.parametrize("text", ["</script><b>x</b>", "${title} $body", "`${1}`"])
def test_hostile_text_cannot_leave_its_place(text: str) -> None:
    bad = [dataclasses.replace(row(0, 1, 0.1), error=text, T=None)]
    hostile = Table(title=text, data=text, seed=0, starts=0, entries=[Entry(name=text, rows=bad)])
    outline = Outline()
    outline.feed(table_report.html(hostile, (CROSS,)))
    assert outline.open == []
    assert outline.bold == 0


def test_scoring_again_needs_only_the_file(ran: tuple[Table, Path]) -> None:
    _, out = ran
    stored = read(out / "predictions" / "exact.jsonl")
    assert stored.config["method"]["estimate"]["stage"] == "row-by-row"
    again: dict[str, Any] = {
        name: stored_table.load(out).scores(p)["exact"].recall for name, p in PROTOCOLS.items()
    }
    assert again == dict.fromkeys(PROTOCOLS, 1.0)


def test_the_page_has_one_legend_beside_its_curves_and_tables_to_sort(written: Path) -> None:
    text = (written / "report.html").read_text()
    assert text.count('class="legend"') == len(RECIPE.protocols)
    for legend in re.findall(r'<div class="legend">.*?</div>', text):
        assert re.findall(r'data-trace="([^"]*)"', legend) == ["identity", "exact", "moody_&lt;b&gt;"]
    outside = text.replace(plotly_figures.script(), "")
    assert '"showlegend":true' not in outside
    assert outside.count('"showlegend":false') == outside.count("Plotly.newPlot(")
    assert text.count('<table class="sortable">') >= 3 * len(RECIPE.protocols)


def test_the_page_prints_tables_as_papers_do_and_hands_out_the_latex(written: Path) -> None:
    text = (written / "report.html").read_text()
    assert text.count("As papers print it") == len(RECIPE.protocols)
    for head in ("RRE (°)", "RTE (m)", "RR (%)", "IR (%)"):
        assert f'<th class="sorts">{head}</th>' in text
    assert text.count("\\begin{tabular}{lrrrr}") == len(RECIPE.protocols)
    assert "@media print" in text


def test_neighbouring_methods_look_different_and_keep_their_look() -> None:
    names = [f"m{k}" for k in range(20)]
    looks = styles(names)
    assert len({(look.colour, look.svg) for look in looks.values()}) == 20
    assert all(a.colour != b.colour and a.svg != b.svg for a, b in itertools.pairwise(looks.values()))
