# SPDX-License-Identifier: MIT
"""The site's pages and notebooks: their code runs, their links lead somewhere, and no public name is left out."""

from __future__ import annotations

import json
import re
import sys
from dataclasses import fields
from importlib import import_module
from pathlib import Path
from types import ModuleType

import pytest

import hybridreg as hr
from hybridreg.cli.app import app
from tools import findings_page

ROOT = Path(__file__).resolve().parent.parent
DOCS = ROOT / "docs"
# Reports of measurements, whose snippets are fragments; everything else on the site runs.
REPORTS = (
    "methods.md",
    "networks.md",
    "published.md",
    "systems.md",
    "simulator.md",
    "training.md",
    "benchmarks.md",
    "changelog.md",
)
EVERY = sorted(DOCS.rglob("*.md"))
PAGES = [page for page in EVERY if page.name not in REPORTS]
NOTEBOOKS = sorted((DOCS / "notebooks").glob("*.ipynb"))
FENCE = re.compile(r"^```(\w*)[^\n]*\n(.*?)^```$", re.MULTILINE | re.DOTALL)
# Whether each `result` of a page is "ok", one after the other: what the text around it says.
OK = {
    "concepts/slots.md": [True],
    "concepts/verdict.md": [True],
    "concepts/viewpoints.md": [True, True],
    "how-to/doubtful.md": [False, True, False],
    "how-to/own-stage.md": [False, True],
    "how-to/scan-to-map.md": [True, True, True],
    "how-to/solid-state.md": [True, True],
    "how-to/two-lidars.md": [True],
    "index.md": [True],
    "quickstart.md": [True, True],
}
# Pages that tools/site_hooks.py makes when the site is built.
MADE = {DOCS / "findings.md", *(path.with_suffix(".md") for path in NOTEBOOKS)}


def _named(path: Path) -> str:
    return path.relative_to(DOCS).as_posix()


def _blocks(text: str, language: str) -> list[tuple[int, str]]:
    """Fenced blocks of a language, each with the number of lines before it."""
    return [(text[: f.start(2)].count("\n"), f[2]) for f in FENCE.finditer(text) if f[1] == language]


def _cells(path: Path) -> list[dict[str, str]]:
    cells = json.loads(path.read_text(encoding="utf-8"))["cells"]
    return [{"kind": cell["cell_type"], "text": "".join(cell["source"])} for cell in cells]


@pytest.fixture
def module(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    """A module for a page's code, in an empty folder: classes that it defines can be pickled."""
    made = ModuleType("page_under_test")
    monkeypatch.setitem(sys.modules, made.__name__, made)
    monkeypatch.chdir(tmp_path)
    return made


@pytest.mark.parametrize(
    "page", [p for p in PAGES if _blocks(p.read_text(encoding="utf-8"), "python")], ids=_named
)
def test_the_code_of_a_page_runs(page: Path, module: ModuleType) -> None:
    results: list[hr.RegistrationResult] = []
    for line, block in _blocks(page.read_text(encoding="utf-8"), "python"):
        # Lines are counted as in the page, so that a traceback points into it.
        exec(compile("\n" * line + block, str(page), "exec"), module.__dict__)
        result = getattr(module, "result", None)
        if result is not None and not (results and results[-1] is result):
            results.append(result)
    if _named(page) in OK:
        assert [result.verdict == "ok" for result in results] == OK[_named(page)]


@pytest.mark.parametrize("path", NOTEBOOKS, ids=_named)
def test_the_cells_of_a_notebook_run(path: Path, module: ModuleType) -> None:
    code = [cell["text"] for cell in _cells(path) if cell["kind"] == "code"]
    assert len(code) >= 4
    for number, cell in enumerate(code):
        exec(compile(cell, f"{path}, code cell {number}", "exec"), module.__dict__)


@pytest.mark.parametrize("path", NOTEBOOKS, ids=_named)
def test_a_notebook_holds_no_outputs(path: Path) -> None:
    notebook = json.loads(path.read_text(encoding="utf-8"))
    assert notebook["nbformat"] == 4
    assert not [cell for cell in notebook["cells"] if cell.get("outputs") or cell.get("execution_count")]


@pytest.mark.parametrize("page", PAGES, ids=_named)
def test_the_commands_of_a_page_exist(page: Path) -> None:
    import typer

    root = typer.main.get_command(app)
    shell = "\n".join(block for _, block in _blocks(page.read_text(encoding="utf-8"), "sh")).replace(
        "\\\n", " "
    )
    for line in re.findall(r"(?:^|\s)hybridreg ([^#\n]*)", shell):
        command, words = root, line.split()
        while words and hasattr(command, "commands"):
            assert words[0] in command.commands, line
            command = command.commands[words.pop(0)]
        known = {option for each in command.params for option in each.opts} | {"--help"}
        assert {word for word in words if word.startswith("--")} <= known, line


@pytest.mark.parametrize("page", EVERY, ids=_named)
def test_the_links_of_a_page_lead_somewhere(page: Path) -> None:
    text = FENCE.sub("", page.read_text(encoding="utf-8"))
    for target in re.findall(r"\]\(([^)\s]+)\)", text):
        path, _, anchor = target.partition("#")
        if "://" in path:
            continue
        there = (page.parent / path).resolve() if path else page
        assert there.exists(), f"{target}: in a checkout it leads nowhere"
        if anchor:
            assert anchor in _anchors(there.read_text(encoding="utf-8")), target


def _anchors(text: str) -> set[str]:
    """Of the headings of a page, as mkdocs makes them."""
    titles = re.findall(r"^#+ (.+)$", FENCE.sub("", text), re.MULTILINE)
    return {re.sub(r"[-\s]+", "-", re.sub(r"[^\w\s-]", "", title).strip().lower()) for title in titles}


def test_no_line_of_code_is_wider_than_its_frame() -> None:
    cells = [cell["text"] for path in NOTEBOOKS for cell in _cells(path) if cell["kind"] == "code"]
    fenced = [f[2] for page in PAGES for f in FENCE.finditer(page.read_text(encoding="utf-8"))]
    assert not [line for block in cells + fenced for line in block.splitlines() if len(line) > 78]


def _referred() -> list[str]:
    return [
        name
        for page in (DOCS / "api").glob("*.md")
        for name in re.findall(r"^::: (\S+)", page.read_text(), re.M)
    ]


@pytest.mark.parametrize(
    "module_name", ["hybridreg", "hybridreg.data", "hybridreg.eval", "hybridreg.testing"]
)
def test_every_public_name_is_in_the_reference_once(module_name: str) -> None:
    names = [
        name.removeprefix(f"{module_name}.") for name in _referred() if name.rpartition(".")[0] == module_name
    ]
    assert sorted(names) == sorted(n for n in import_module(module_name).__all__ if n != "__version__")


def test_every_page_is_in_the_navigation() -> None:
    # Read as text: the environment of the tests holds no YAML reader.
    listed = re.findall(
        r"[\w/.-]+\.md", (ROOT / "mkdocs.yml").read_text(encoding="utf-8").partition("\nnav:")[2]
    )
    assert sorted(listed) == sorted([*map(_named, EVERY), *map(_named, MADE)])


def test_names_after_hr_exist() -> None:
    for page in PAGES:
        for name in re.findall(r"\bhr\.([A-Za-z_]+)", page.read_text(encoding="utf-8")):
            assert name in hr.__all__, f"{page}: {name}"


def test_every_key_of_a_recipe_is_explained() -> None:
    from hybridreg.learned.losses.infonce_loss import InfoNceConfig
    from hybridreg.learned.training.data.augmentation import Augmentation
    from hybridreg.learned.training.recipe import LossWeights, Phase, Recipe, Source

    page = (DOCS / "how-to" / "own-network.md").read_text(encoding="utf-8")
    tables = "\n".join(line for line in page.splitlines() if line.startswith("|"))
    told = set(re.findall(r"`(?:data\.)?(\w+)`", tables))
    kinds = (Recipe, Source, Phase, LossWeights, Augmentation, InfoNceConfig)
    # `kind` is what `network` becomes when a file is read; the file's own name is the recipe's.
    assert {f.name for kind in kinds for f in fields(kind)} - {"kind"} <= told


def test_every_key_of_a_row_is_explained() -> None:
    from hybridreg.changes import KEYS
    from hybridreg.eval import table_file

    page = (DOCS / "how-to" / "own-data.md").read_text(encoding="utf-8")
    rows = page.partition("### Rows of a table")[2].partition("### From Python")[0]
    told = set(re.findall(r"`(\w+)`", rows))
    assert {"name", *KEYS, *table_file._CONTROLS} <= told
    assert {f.name for f in fields(table_file._Content)} - {"row", "paper"} <= told


def test_the_columns_of_a_batch_are_explained() -> None:
    from hybridreg.many import batch_run

    page = (DOCS / "how-to" / "scan-to-map.md").read_text(encoding="utf-8")
    line = next(line for line in page.splitlines() if line.startswith("| `poses.csv`"))
    assert re.findall(r"`(\w+)`", line) == list(batch_run._COLUMNS)


def test_the_page_of_findings_holds_every_script() -> None:
    text = findings_page.page()
    scripts = sorted(path.name for path in (ROOT / "findings").iterdir())
    assert scripts
    assert re.findall(r"^Script: `findings/(.+)`$", text, re.MULTILINE) == scripts
    assert "## kiss-icp 1.3.0: partners one voxel away" in text


@pytest.mark.parametrize(
    "head",
    [
        "",
        "# Found.\n",
        "# Found.\n# Guess before it was run: none.\n",
        "# Guess before it was run: a\n# For whom it matters: b\n",
    ],
)
def test_a_finding_without_its_parts_is_refused_by_name(tmp_path: Path, head: str) -> None:
    (tmp_path / "odd.sh").write_text(f"#!/usr/bin/env bash\n{head}true\n")
    with pytest.raises(ValueError, match=r"odd\.sh.*Guess before"):
        findings_page.page(tmp_path)
