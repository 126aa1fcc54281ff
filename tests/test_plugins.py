# SPDX-License-Identifier: MIT
"""A plug-in that cannot be imported is told in a sentence, and keeps nobody else from working."""

from __future__ import annotations

from pathlib import Path

import pytest
from typer.testing import CliRunner

from hybridreg import Pipeline, registry
from hybridreg.cli.app import app
from hybridreg.data import catalogue, open_dataset

BROKEN = {
    "raises": "raise RuntimeError('no licence\\nfound')",
    "ends": "import sys; sys.exit(0)",
    "syntax": "def (",
    "lacks": "import a_module_that_nobody_has",
    "empty": "",
    "warned": "raise UserWarning('old')",
}


@pytest.fixture(params=list(BROKEN))
def broken(request: pytest.FixtureRequest, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    """A stage `match.broken` and a loader `broken` of a package that does not load."""
    name = f"plugged_{request.param}"
    (tmp_path / f"{name}.py").write_text(BROKEN[request.param])
    monkeypatch.syspath_prepend(str(tmp_path))
    stages, loaders = dict(registry.known()), dict(catalogue.known())
    monkeypatch.setattr(registry, "known", lambda: {**stages, "match.broken": f"{name}:Stage"})
    monkeypatch.setattr(catalogue, "known", lambda: {**loaders, "broken": f"{name}:load"})
    return name


def test_a_broken_plugin_is_named(broken: str) -> None:
    with pytest.raises(
        ImportError, match=rf"match stage 'broken' \({broken}:Stage\) of a plug-in cannot be loaded"
    ):
        registry.load("match", "broken")
    with pytest.raises(ImportError, match=rf"loader 'broken' \({broken}:load\)"):
        open_dataset("broken:here")


@pytest.mark.usefixtures("broken")
def test_on_the_command_line_it_is_one_sentence() -> None:
    for arguments in (
        ["eval", "--data", "broken:here"],
        ["register", "a.ply", "b.ply", "--set", "match=broken"],
    ):
        result = CliRunner().invoke(app, arguments)
        assert result.exit_code == 2
        assert "of a plug-in cannot be loaded" in result.stderr
        assert result.stderr.count("\n") == 1


@pytest.mark.usefixtures("broken")
def test_others_go_on() -> None:
    with pytest.raises(ValueError, match="fpfh"):  # the cure looks through all stages
        Pipeline(match="none", estimate="ransac")
    assert CliRunner().invoke(app, ["list", "stages"]).exit_code == 0
    told = CliRunner().invoke(app, ["doctor"])
    assert told.exit_code == 0
    assert "stage match.broken does not load" in told.stdout
