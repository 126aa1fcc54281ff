# SPDX-License-Identifier: MIT
"""The README holds what was measured, and only names that exist."""

from __future__ import annotations

import re
from importlib import import_module
from pathlib import Path

import pytest

from tools.readme import insert

ROOT = Path(__file__).resolve().parents[2]


def test_inserts_between_markers_and_again() -> None:
    page = "a\n<!-- x -->\nold\n<!-- /x -->\nb\n"
    once = insert(page, "x", "| new |\n")
    assert once == "a\n<!-- x -->\n\n| new |\n\n<!-- /x -->\nb\n"
    assert insert(once, "x", "| new |") == once


@pytest.mark.parametrize("page", ["", "<!-- x -->\n", "<!-- x -->\n<!-- /x -->\n<!-- x -->\n<!-- /x -->\n"])
def test_refuses_a_page_without_its_markers(page: str) -> None:
    with pytest.raises(ValueError, match="exactly once"):
        insert(page, "x", "new")


def test_python_in_the_readme_compiles_and_names_what_exists() -> None:
    import hybridreg

    blocks = re.findall(
        r"```python\n(.*?)```", (ROOT / "README.md").read_text(encoding="utf-8"), flags=re.DOTALL
    )
    assert blocks
    for block in blocks:
        compile(block, "README.md", "exec")
        for name in re.findall(r"\bhr\.([A-Za-z_]+)", block):
            assert name in hybridreg.__all__, name


def test_the_readmes_own_stage_conforms(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    block = next(b for b in re.findall(r"```python\n(.*?)```", text, flags=re.DOTALL) if "check_stage" in b)
    # As a module of its own: a class from an `exec` could not be pickled.
    (tmp_path / "readme_stage.py").write_text(block, encoding="utf-8")
    monkeypatch.syspath_prepend(str(tmp_path))
    assert import_module("readme_stage").pipe.match.reach == 1.0


def test_pictures_and_files_the_readme_names_are_there() -> None:
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    for target in re.findall(r"\]\(([^)#]+)\)", text):
        assert (ROOT / target).exists(), target
