# SPDX-License-Identifier: MIT
"""Stored predictions, a table's index and a pair's `meta.json`, truncated or changed."""

from __future__ import annotations

import json
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, ClassVar

from hypothesis import strategies as st

from hybridreg import Pipeline
from hybridreg.data import open_dataset
from hybridreg.eval import PROTOCOLS, predict, stored_table, table_run
from hybridreg.eval.report import table_report
from hybridreg.eval.run import store
from hybridreg.eval.table_file import parse
from hybridreg.io import write_json, write_points
from hybridreg.testing import sample_pair
from tools.hostile.damage import Damage, damaged, damages
from tools.hostile.mutate import Change, changed, changes

# Contents of a file in a table's folder, and of one in its data.
FILES = ("predictions/still.jsonl", "table.json", "data/pair-1/meta.json")


@dataclass(frozen=True, kw_only=True)
class StoredCase:
    """One of a table's files, changed; then the table is read, scored, reported and resumed."""

    kind: ClassVar[str] = "json"
    allowed: ClassVar[tuple[type[BaseException], ...]] = (ValueError, KeyError, FileNotFoundError)

    file: str
    line: int
    change: tuple[Change, ...] = ()
    damage: tuple[Damage, ...] = ()
    noise: str | None = None

    def run(self) -> str:
        """Everything that reads the file."""
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            for place, content in _run_before().items():
                (folder / place).parent.mkdir(parents=True, exist_ok=True)
                (folder / place).write_bytes(content)
            (folder / self.file).write_bytes(self.content())
            return _USES[self.file](folder)

    def content(self) -> bytes:
        """The file's bytes."""
        whole = _run_before()[self.file]
        if self.noise is not None:
            return self.noise.encode() + (b"\n" + whole if self.line % 2 else b"")
        if not self.change:
            return damaged(whole, self.damage)
        if not self.file.endswith(".jsonl"):
            return _dump(changed(json.loads(whole), self.change)).encode()
        lines = whole.decode().splitlines()
        at = self.line % len(lines)
        lines[at] = _dump(changed(json.loads(lines[at]), self.change))
        return ("\n".join(lines) + "\n").encode()


def cases() -> st.SearchStrategy[StoredCase]:
    """Changed and damaged files."""
    file = st.sampled_from((FILES[0], FILES[0], FILES[0], *FILES[1:]))
    line = st.integers(0, 7)
    return st.one_of(
        st.builds(StoredCase, file=file, line=line, change=changes()),
        st.builds(StoredCase, file=file, line=line, change=changes()),
        st.builds(StoredCase, file=file, line=line, damage=damages()),
        st.builds(StoredCase, file=file, line=line, noise=st.sampled_from(_NOISE)),
    )


@cache
def _run_before() -> dict[str, bytes]:
    """Every file of a small finished run, by its path."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for i in range(3):
            pair, T = sample_pair(i, 200)
            place = folder / "data" / f"pair-{i}"
            place.mkdir(parents=True)
            write_points(place / "source.ply", pair.source.points)
            write_points(place / "target.ply", pair.target.points)
            write_json(place / "meta.json", {"T_target_source": T, "kind": "made", "overlap": 0.5})
        table_run.run(_recipe(), open_dataset(folder / "data"), folder, data="data")
        return {str(f.relative_to(folder)): f.read_bytes() for f in folder.rglob("*") if f.is_file()}


def _recipe() -> Any:
    still = {"match": "none", "estimate": "identity", "refine": "none", "name": "still"}
    return parse({"row": [still], "protocols": ["cross3dreg"]})


def _predictions(folder: Path) -> str:
    done = stored_table.of_files([folder / FILES[0]])
    table_report.write(done, list(PROTOCOLS.values())[:2], folder / "report")
    pairs = open_dataset(folder / "data")
    read = store.read(folder / FILES[0]).rows
    after = predict(_still(), pairs, folder / FILES[0], data="data")
    assert len({row.id for row in after}) == len(after)
    assert {row.id for row in read} <= {row.id for row in after}
    return "scored"


def _index(folder: Path) -> str:
    table_report.write(stored_table.load(folder), [PROTOCOLS["cross3dreg"]], folder / "report")
    return "scored"


def _meta(folder: Path) -> str:
    pairs = open_dataset(folder / "data")
    rows = predict(_still(), pairs, folder / "new.jsonl")
    assert len(rows) == len(pairs)
    pairs[1]
    return "read"


@cache
def _still() -> Pipeline:
    return Pipeline(match="none", estimate="identity", refine="none")


def _dump(content: Any) -> str:
    # NaN and Infinity are not JSON, but Python writes and reads them.
    return json.dumps(content, default=str)


_USES: dict[str, Callable[[Path], str]] = {FILES[0]: _predictions, FILES[1]: _index, FILES[2]: _meta}
_NOISE = (
    "[" * 100_000, '{"a":' * 100_000, "9" * 5000, "null", "[]", "3", '"text"', "{}", "", "\x00" * 64, "\u2028",
    "{" * 10,    '{"format": "hybridreg predictions 1"}', '{"format": "hybridreg predictions 1", "config": 3}',
)  # fmt: skip
