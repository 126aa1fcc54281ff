# SPDX-License-Identifier: MIT
"""TOML files of pipelines, tables and training recipes: valid ones with changes, and text that is not TOML."""

from __future__ import annotations

import sys
import tempfile
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any, ClassVar

from hypothesis import strategies as st

from hybridreg import Pipeline
from hybridreg.testing import sample_pair
from tools.hostile.damage import Damage, damaged, damages
from tools.hostile.hostile_clouds import PIPELINES, check
from tools.hostile.mutate import Change, changed, changes

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

# Pipelines beyond this are not run: a million iterations take long because they were requested.
_MOST_ASKED = 10_000
_NOISE = (
    "x = " + "[" * 3000, "a." * 3000 + "b = 1", "x = " + "9" * 5000, "[[row]]\n" * 3000, "\ufeffvoxel = 1",
    "voxel = 0.3\nvoxel = 0.4", "voxel = 1979-05-27", "= 1", "voxel = 0x" + "f" * 400, "",
)  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class TomlCase:
    """A TOML file; a pipeline that can be built from it is run on a small pair."""

    kind: ClassVar[str] = "toml"
    allowed: ClassVar[tuple[type[BaseException], ...]] = (ValueError, KeyError, FileNotFoundError)

    reader: str  # pipeline, table, recipe
    sample: str
    change: tuple[Change, ...] = ()
    damage: tuple[Damage, ...] = ()
    noise: str | None = None

    def run(self) -> str:
        """Read the file, and run its pipeline."""
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "file.toml"
            path.write_bytes(self.content())
            return _READERS[self.reader](path)

    def content(self) -> bytes:
        """The file's bytes."""
        if self.noise is not None:
            return self.noise.encode()
        return damaged(_dump(changed(_samples(self.reader)[self.sample], self.change)), self.damage)


def cases() -> st.SearchStrategy[TomlCase]:
    """Files for the three readers."""
    return st.one_of(*(_cases(reader) for reader in ("pipeline", "pipeline", "table", "recipe")))


def _cases(reader: str) -> st.SearchStrategy[TomlCase]:
    sample = st.sampled_from(sorted(_samples(reader)))
    return st.one_of(
        st.builds(TomlCase, reader=st.just(reader), sample=sample, change=changes()),
        st.builds(TomlCase, reader=st.just(reader), sample=sample, change=changes()),
        st.builds(TomlCase, reader=st.just(reader), sample=sample, damage=damages()),
        st.builds(TomlCase, reader=st.just(reader), sample=sample, noise=st.sampled_from(_NOISE)),
    )


@cache
def _samples(reader: str) -> dict[str, dict[str, Any]]:
    package = {
        "pipeline": "hybridreg.presets",
        "table": "hybridreg.eval.tables",
        "recipe": "hybridreg.learned.recipes",
    }
    found = {
        file.name: tomllib.loads(file.read_text(encoding="utf-8"))
        for file in files(package[reader]).iterdir()
        if file.name.endswith(".toml")
    }
    if reader != "pipeline":
        return found
    # Every field of every stage, written out, so that each can be changed.
    whole = {f"pipeline {i}": Pipeline(**slots).to_spec() for i, slots in enumerate(PIPELINES)}
    return {**found, **whole}


def _dump(content: Any) -> bytes:
    import tomli_w

    try:
        return tomli_w.dumps(content).encode()
    except (TypeError, ValueError, AttributeError):  # the change gave something that TOML cannot represent
        return repr(content).encode("utf-8", "replace")


def _pipeline(path: Path) -> str:
    pipeline = Pipeline.load(path)
    if _asks_too_much(pipeline.to_spec()):
        return "built"
    pair, _ = sample_pair(2, 300)
    check(pipeline.run(pair))
    return "run"


def _table(path: Path) -> str:
    from hybridreg.eval import table_file

    table_file.read(path)
    return "read"


def _recipe(path: Path) -> str:
    from hybridreg.learned.training import recipe_file

    recipe_file.read(path)
    return "read"


def _asks_too_much(value: Any) -> bool:
    if isinstance(value, dict):
        return any(_asks_too_much(item) for item in value.values())
    if isinstance(value, list):
        return any(_asks_too_much(item) for item in value)
    return isinstance(value, int) and value > _MOST_ASKED


_READERS = {"pipeline": _pipeline, "table": _table, "recipe": _recipe}
