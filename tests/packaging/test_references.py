# SPDX-License-Identifier: MIT
"""References to `docs/methods.md` lead to a section, and the files that the page names exist."""

from __future__ import annotations

import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
METHODS = (ROOT / "docs" / "methods.md").read_text()
SECTIONS = set(re.findall(r"^##+ (\d+(?:\.\d+)?)", METHODS, re.MULTILINE))
# "(docs/methods.md 5.2, 7.2)" and "(docs/methods.md 6.1 to 6.5)".
REFERENCE = re.compile(r"methods\.md ((?:\d+(?:\.\d+)?(?:, | to )?)+)")


def _references() -> dict[str, str]:
    files = [
        path for top in ("hybridreg", "classical", "learned", "eval") for path in (ROOT / top).rglob("*.py")
    ]
    return {
        f"{path.relative_to(ROOT)}: {number}": number
        for path in files
        for found in REFERENCE.findall(path.read_text())
        for number in re.findall(r"\d+(?:\.\d+)?", found)
    }


def test_every_reference_to_the_methods_leads_to_a_section() -> None:
    references = _references()
    assert len(references) > 40
    assert not [where for where, number in references.items() if number not in SECTIONS]


def test_no_docstring_points_at_a_page_that_nobody_has() -> None:
    stray = re.compile(r"\((?:methods|specification)[ ,]")
    files = [
        path for top in ("hybridreg", "classical", "learned", "eval") for path in (ROOT / top).rglob("*.py")
    ]
    assert not [path for path in files if stray.search(path.read_text())]


def test_every_path_of_the_methods_exists() -> None:
    paths = re.findall(r"`((?:classical|docs|eval|hybridreg|learned)/[\w/.-]+)`", METHODS)
    assert len(paths) > 40
    assert not [path for path in paths if not (ROOT / path).exists()]
