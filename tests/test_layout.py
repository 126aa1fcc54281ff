# SPDX-License-Identifier: MIT
"""The layout holds: who may import whom, no circle, names that lead to one file, folders that can be taken in."""

from __future__ import annotations

import ast
import subprocess
from collections import Counter, defaultdict
from graphlib import TopologicalSorter
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
# Each may import from its own line and from those above.
ORDER = (
    ("config", "io", "runtime"),
    ("geometry",),
    (
        "cloud",
        "flat_scans",
        "frames",
        "gate",
        "matches",
        "pair",
        "resolution",
        "scene",
        "slots",
        "stage",
        "thinning",
    ),
    ("evidence",),
    ("search",),
    ("verdict",),
    (
        "__init__",
        "api",
        "candidates",
        "changes",
        "fitting",
        "many",
        "output",
        "pipeline",
        "presets",
        "prior",
        "registry",
        "result",
        "spec",
    ),
    ("classical",),
    ("data", "eval", "learned"),
    ("verdict.training", "cli", "testing", "__main__"),
)
LEVEL = {name: level for level, names in enumerate(ORDER) for name in names}
# What every network's folder calls its parts.
ROLES = {"batch", "config", "examples", "losses", "memory", "network", "official_names", "stage", "targets"}


def _sources() -> dict[str, Path]:
    """Module names without `hybridreg.`, and their files."""
    tops = ("hybridreg", "classical", "learned", "eval")
    paths = [path for top in tops for path in sorted((ROOT / top).rglob("*.py"))]
    parts = [
        path.relative_to(ROOT / "hybridreg" if path.is_relative_to(ROOT / "hybridreg") else ROOT)
        for path in paths
    ]
    return {
        ".".join(part.with_suffix("").parts).removesuffix(".__init__"): path
        for part, path in zip(parts, paths, strict=True)
    }


SOURCES = _sources()


def _imports(name: str) -> set[str]:
    """Modules of ours that are imported when this one is, or later; not those for type checkers alone."""
    tree = ast.parse(SOURCES[name].read_text())
    for node in ast.walk(tree):
        if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test):
            node.body = []
    found = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] == "hybridreg":
            module = (node.module or "").removeprefix("hybridreg").lstrip(".")
            for alias in node.names:
                whole = f"{module}.{alias.name}".lstrip(".")
                found.add(whole if whole in SOURCES else module or "__init__")
    return found & set(SOURCES)


IMPORTS = {name: _imports(name) for name in SOURCES}


def _level(name: str) -> int:
    return LEVEL["verdict.training"] if name.startswith("verdict.training") else LEVEL[name.split(".")[0]]


def test_no_module_imports_from_a_layer_above() -> None:
    up = [
        f"{name} imports {other}"
        for name, all_ in IMPORTS.items()
        for other in all_
        if _level(other) > _level(name)
    ]
    assert not up


def test_there_is_no_circle() -> None:
    TopologicalSorter({name: others - {name} for name, others in IMPORTS.items()}).prepare()


def test_a_name_leads_to_one_file_and_folders_and_files_stay_small() -> None:
    listed = subprocess.run(
        ["git", "ls-files", "*.py"], cwd=ROOT, capture_output=True, text=True, check=False
    ).stdout
    files = [ROOT / line for line in listed.split()] or list(SOURCES.values())
    product = [path for path in files if path.relative_to(ROOT).parts[0] != "tests" and path.exists()]
    named = defaultdict(list)
    for path in product:
        network = path.parent.parent == ROOT / "learned" and path.stem in ROLES
        if not network and path.stem not in ("__init__", "__main__"):
            named[path.stem].append(path)
    assert not [paths for paths in named.values() if len(paths) > 1]
    assert not [folder for folder, n in Counter(path.parent for path in files).items() if n > 20]
    lines = sorted(len(path.read_text().splitlines()) for path in product if path.stem != "__init__")
    assert lines[-1] <= 300
    assert lines[len(lines) // 2] <= 115


def test_no_two_test_modules_have_one_name() -> None:
    # pytest imports them by their base names.
    names = Counter(
        path.name
        for path in (ROOT / "tests").rglob("*.py")
        if path.name not in ("conftest.py", "__init__.py")
    )
    assert not [name for name, n in names.items() if n > 1]
