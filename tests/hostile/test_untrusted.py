# SPDX-License-Identifier: MIT
"""Files from strangers: an attack on every reader, and what would run leaves a mark."""

from __future__ import annotations

import contextlib
import io
import json
import os
import pickle
import sys
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hybridreg import Pipeline, changes
from hybridreg.data import open_dataset
from hybridreg.data.lists.pickles import read_pickle
from hybridreg.data.lists.pth import read_pth
from hybridreg.data.simulate.simulated_folder import read_pair
from hybridreg.eval import PROTOCOLS, stored_table, table_file, table_run
from hybridreg.eval.report import table_report
from hybridreg.eval.report.rerun_for_pictures import redraw
from hybridreg.eval.scored_table import Entry, Table
from hybridreg.io import read_image, read_points, write_points
from hybridreg.learned.cross3dreg.sizes import named_config
from hybridreg.learned.training import checkpoint, recipe_file
from hybridreg.learned.weights import from_pretrained, load_official
from hybridreg.testing import sample_pair
from tools.hostile.stored import FILES, StoredCase

POINTS = np.random.default_rng(0).uniform(-10.0, 10.0, (60, 3))


class Touch:
    """Makes a file when it is unpickled by a reader that trusts it."""

    def __init__(self, mark: Path) -> None:
        self.mark = mark

    def __reduce__(self) -> Any:
        return os.system, (f"touch {self.mark}",)


@pytest.fixture
def mark(tmp_path: Path) -> Path:
    return tmp_path / "was-run"


def test_the_attack_itself_works(mark: Path) -> None:
    pickle.loads(pickle.dumps(Touch(mark)))
    assert mark.exists()


def _npy(mark: Path) -> bytes:
    stream = io.BytesIO()
    np.save(stream, np.array([Touch(mark)] * 40, dtype=object), allow_pickle=True)
    return stream.getvalue()


def _npz(mark: Path) -> bytes:
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as archive:
        archive.writestr("xyz.npy", _npy(mark))
    return stream.getvalue()


def _torch(mark: Path, zipped: bool) -> bytes:
    import torch

    stream = io.BytesIO()
    content = {"model": {"a": torch.zeros(2)}, "more": Touch(mark)}
    torch.save(content, stream, _use_new_zipfile_serialization=zipped)
    return stream.getvalue()


ATTACKS: dict[str, Callable[[Path], bytes]] = {
    "pickle": lambda mark: pickle.dumps(Touch(mark)),
    "old pickle": lambda mark: pickle.dumps([Touch(mark)], protocol=0),
    "npy": _npy,
    "npz": _npz,
    "torch": lambda mark: _torch(mark, True),
    "old torch": lambda mark: _torch(mark, False),
}
READERS: dict[str, Callable[[Path], Any]] = {
    **{f"cloud{suffix}": read_points for suffix in (".npy", ".npz", ".ply", ".pcd", ".bin", ".txt", ".las")},
    "image.png": read_image,
    "list.pkl": read_pickle,
    "fragment.pth": read_pth,
    "network.pth.tar": load_official,
    "state.ckpt": checkpoint.load,
    "pipeline.toml": Pipeline.load,
    "table.toml": table_file.read,
    "recipe.toml": recipe_file.read,
}


@pytest.mark.parametrize("attack", ATTACKS)
@pytest.mark.parametrize("name", READERS)
def test_no_reader_runs_a_pickle(tmp_path: Path, mark: Path, name: str, attack: str) -> None:
    (tmp_path / name).write_bytes(ATTACKS[attack](mark))
    # The old format of torch begins with a pickle of its own that holds a number, which is harmless.
    harmless = (name, attack) == ("list.pkl", "old torch")
    with contextlib.nullcontext() if harmless else pytest.raises(ValueError):
        READERS[name](tmp_path / name)
    assert not mark.exists()


@pytest.mark.parametrize("attack", ATTACKS)
@pytest.mark.parametrize("damaged", ["config.json", "model.safetensors"])
def test_no_folder_of_weights_runs_a_pickle(tmp_path: Path, mark: Path, damaged: str, attack: str) -> None:
    (tmp_path / "config.json").write_text(json.dumps(named_config("nano").to_dict()))
    (tmp_path / "model.safetensors").write_bytes(b"")
    (tmp_path / damaged).write_bytes(ATTACKS[attack](mark))
    with pytest.raises(ValueError, match="damaged"):
        from_pretrained(tmp_path)
    assert not mark.exists()


@pytest.mark.parametrize("attack", ["torch", "old torch", "pickle"])
def test_a_pipeline_file_may_name_weights_but_not_run_them(tmp_path: Path, mark: Path, attack: str) -> None:
    weights = tmp_path / "network.pth.tar"
    weights.write_bytes(ATTACKS[attack](mark))
    (tmp_path / "mine.toml").write_text(
        f'match = {{ stage = "geotransformer", weights = "{weights}" }}\nestimate = "lgr"\nrefine = "none"\n'
    )
    pipeline = Pipeline.load(tmp_path / "mine.toml")
    pair, _ = sample_pair(0, 300)
    with pytest.raises(ValueError, match="can be read safely") as refused:
        pipeline.run(pair)
    assert "weights_only" not in str(refused.value)  # as torch's own text would have the user set it to False
    assert not mark.exists()


def test_a_simulated_pair_runs_nothing(tmp_path: Path, mark: Path) -> None:
    (tmp_path / "meta.json").write_text('{"source_sensor": "", "target_sensor": ""}')
    (tmp_path / "source.npz").write_bytes(_npz(mark))
    with pytest.raises(ValueError):
        read_pair(tmp_path)
    assert not mark.exists()


# A module that makes the mark when anyone imports it, and a class that does when anyone makes one.
_TRAP = """
from pathlib import Path
Path({mark!r}).touch()
class Stage:
    def __init__(self, **_):
        Path({mark!r}).touch()
    def __call__(self, *_):
        Path({mark!r}).touch()
"""
NAMES = (
    "trap:Stage", "trap.Stage", "trap", "os:system", "os.system", "builtins:eval", "builtins.eval", "__import__",
    "estimate.trap:Stage", "estimate.__class__", "voxel.__init__", "../trap", "hybridreg.stages:trap", "",
)  # fmt: skip


@pytest.fixture
def trap(tmp_path: Path, mark: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "trap.py").write_text(_TRAP.format(mark=str(mark)))
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.chdir(tmp_path)


@pytest.mark.usefixtures("trap")
@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize(
    "shape",
    [
        'estimate = "{name}"',
        'estimate = {{ stage = "{name}", command = "x" }}',
        'match = "none"\nestimate = {{ stage = "candidates", of = [{{ estimate = "{name}" }}] }}',
        'match = "none"\nestimate = {{ stage = "candidates", refine = {{ stage = "{name}" }} }}',
        'overlap = {{ stage = "visibility", baseline = {{ stage = "{name}" }} }}',
        '"{name}" = 1',
    ],
)
def test_a_pipeline_file_makes_registered_stages_alone(
    tmp_path: Path, mark: Path, shape: str, name: str
) -> None:
    path = tmp_path / "mine.toml"
    path.write_text(shape.format(name=name))
    with pytest.raises((ValueError, KeyError)):
        Pipeline.load(path)
    assert not mark.exists()
    assert "trap" not in sys.modules


@pytest.mark.usefixtures("trap")
@pytest.mark.parametrize("name", NAMES[:-1])
def test_tables_and_settings_neither(tmp_path: Path, mark: Path, name: str) -> None:
    refused = (ValueError, KeyError, FileNotFoundError)
    for content in (
        {"row": [{"estimate": name}]},
        {"row": [{"preset": name}]},
        {"row": [{"pipeline": name}]},
    ):
        with pytest.raises(refused):
            table_file.parse(content)
    with pytest.raises(refused):
        changes.build(changes.parse([f"estimate={name}"]))
    with pytest.raises(refused):
        open_dataset(name)
    assert not mark.exists()
    assert "trap" not in sys.modules


@pytest.mark.usefixtures("trap")
@pytest.mark.parametrize("control", [None, {"oracle": True, "pipeline": True}])
def test_stored_predictions_are_drawn_again_by_registered_stages_alone(
    tmp_path: Path, mark: Path, control: Any
) -> None:
    header, *rows = StoredCase(file=FILES[0], line=0).content().decode().splitlines()
    content = json.loads(header)
    if control is None:
        content["config"]["method"]["estimate"] = {"stage": "trap:Stage"}
    else:
        content["config"]["method"]["control"] = control
    (tmp_path / "p.jsonl").write_text("\n".join([json.dumps(content), *rows]) + "\n")
    done = stored_table.of_files([tmp_path / "p.jsonl"])
    with pytest.raises((ValueError, KeyError)):
        redraw(done, PROTOCOLS["cross3dreg"], [], tmp_path / "pictures", 1)
    assert not mark.exists()


@pytest.mark.parametrize(
    "text", ["</script><script>alert(1)</script>", "<!--<script>", "<img src=x onerror=alert(1)>"]
)
def test_a_report_holds_no_markup_of_the_predictions(tmp_path: Path, text: str) -> None:
    header, *rows = StoredCase(file=FILES[0], line=0).content().decode().splitlines()
    content = json.loads(header)
    content["config"]["data"]["name"] = text
    content["config"]["method"]["estimate"] = {"stage": text}
    stored = [{**json.loads(row), "error": text, "reasons": [text], "verdict": text} for row in rows]
    for i, row in enumerate(stored):
        row["id"] = f"{text}{i}"
    path = tmp_path / "p.jsonl"
    path.write_text("\n".join(json.dumps(each) for each in (content, *stored)) + "\n")
    done = stored_table.of_files([path])
    renamed = Entry(name=text, rows=done.methods[0].rows, config=done.methods[0].config)
    hostile = Table(title=text, data=text, seed=0, starts=0, entries=[done.entries[0], renamed])
    table_report.write(hostile, [PROTOCOLS["cross3dreg"]], tmp_path / "report")
    assert text not in (tmp_path / "report" / "report.html").read_text(encoding="utf-8")


def test_pictures_and_predictions_stay_in_their_folder(tmp_path: Path) -> None:
    name = "../../outside"
    content = {"row": [{"name": name, "match": "none", "estimate": "identity", "refine": "none"}]}
    folder = tmp_path / "data" / "pair-0"
    folder.mkdir(parents=True)
    for kind in ("source", "target"):
        write_points(folder / f"{kind}.ply", POINTS)
    (folder / "meta.json").write_text(json.dumps({"T_target_source": np.eye(4).tolist()}))
    table_run.run(table_file.parse(content), open_dataset(tmp_path / "data"), tmp_path / "a" / "b")
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a", "data"]
    assert [p.name for p in (tmp_path / "a" / "b" / "predictions").iterdir()] == ["outside.jsonl"]
