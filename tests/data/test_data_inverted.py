# SPDX-License-Identifier: MIT
"""Sets whose poses map target to source stop before the first pair; those that are right, odd or unclear do not."""

from __future__ import annotations

import json
from pathlib import Path

import loader_trees
import numpy as np
import pytest
from typer.testing import CliRunner

import hybridreg as hr
from hybridreg.cli.app import app
from hybridreg.data import PairFolder, YawStarts, open_dataset
from hybridreg.data.dataset import vouch
from hybridreg.data.hard import box_world
from hybridreg.data.lists import direction, listed
from hybridreg.data.lists.listed import ListedPairs
from hybridreg.data.loaders import folder as folder_module
from hybridreg.eval import predict
from hybridreg.geometry import se3
from hybridreg.learned.training.data import opened_source

SAID = "the poses seem to map target to source, open the folder by .*#inverted; .*#trusted takes them as they are"


@pytest.fixture(autouse=True)
def nothing_checked_yet(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(folder_module, "_CHECKED", set())
    monkeypatch.setattr(listed, "_CHECKED", set())


def drawn(rng: np.random.Generator, scale: float = 1.0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Two scans of a made street some metres apart, and the pose between them."""
    world = box_world.street(rng, crossing=True)
    a, b = (box_world.sensor_pose(x, 0.5, 1.8, rng.uniform(-180, 180)) for x in (-4.0, 4.0))
    clouds = [box_world.scan(world, "rings16", T, rng, density=0.3) * scale for T in (a, b)]
    T = se3.inverse(b) @ a
    T[:3, 3] *= scale
    return clouds[0], clouds[1], T


def write(root: Path, name: str, source: np.ndarray, target: np.ndarray, T: np.ndarray) -> None:
    (root / name).mkdir(parents=True)
    np.save(root / name / "source.npy", source)
    np.save(root / name / "target.npy", target)
    (root / name / "meta.json").write_text(json.dumps({"T_target_source": T.tolist()}))


def made(root: Path, n: int = 3, inverted: bool = True, scale: float = 1.0, offset: float = 0.0) -> Path:
    for k in range(n):
        source, target, T = drawn(np.random.default_rng(k), scale)
        shift = np.array([offset, offset, 0.0])
        T = T @ se3.from_rt(np.eye(3), -shift)
        write(root, f"p{k}", source + shift, target, se3.inverse(T) if inverted else T)
    return root


@pytest.mark.parametrize("scale, offset", [(1.0, 0.0), (0.01, 0.0), (1.0, 4e6)])
def test_inverted_poses_are_told_with_both_figures(tmp_path: Path, scale: float, offset: float) -> None:
    pairs = open_dataset(made(tmp_path / "pairs", scale=scale, offset=offset))
    with pytest.raises(direction.WrongDirection, match=f"mean overlap of 3 pairs at .*{SAID}"):
        vouch(pairs)
    right = open_dataset(f"{tmp_path / 'pairs'}#inverted")
    vouch(right)
    labelled = right[0]
    assert direction.overlap(labelled, 0.5 * scale) > 0.3
    assert right.fingerprint() != pairs.fingerprint()  # type: ignore[attr-defined]
    vouch(open_dataset(f"{tmp_path / 'pairs'}#trusted"))
    assert len(pairs[0].pair.source) > 0  # reading a pair is not stopped


@pytest.mark.parametrize("scale, offset", [(1.0, 0.0), (0.01, 0.0), (1.0, 4e6)])
def test_right_poses_pass_and_are_refused_as_inverted(tmp_path: Path, scale: float, offset: float) -> None:
    made(tmp_path / "pairs", inverted=False, scale=scale, offset=offset)
    vouch(open_dataset(tmp_path / "pairs"))
    with pytest.raises(direction.WrongDirection, match="open the folder without inverted"):
        vouch(open_dataset(f"folder:{tmp_path / 'pairs'}#inverted"))


def test_table_eval_predict_and_train_stop_before_the_first_pair(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    root = made(tmp_path / "pairs")
    ran: list[str] = []

    def method(pair: hr.Pair, seed: int) -> np.ndarray:
        ran.append(pair.id)
        return np.eye(4)

    for pairs in (PairFolder(root), YawStarts(PairFolder(root), 1)):
        with pytest.raises(ValueError, match=SAID):
            predict(method, pairs, tmp_path / "rows.jsonl")
    assert not (tmp_path / "rows.jsonl").exists()
    assert ran == []
    (tmp_path / "t.toml").write_text('[[row]]\npreset = "icp"\n')
    for command in (["table", str(tmp_path / "t.toml")], ["eval", "--preset", "icp"]):
        more = ["--out", str(tmp_path / "out")]
        line = [*command, "--data", str(root), *more]
        done = CliRunner().invoke(app, line)
        assert done.exit_code == 2, done.output
        assert "seem to map target to source" in done.stderr
        assert not (tmp_path / "out").exists()
    monkeypatch.setattr(opened_source, "pair_fingerprints_of", lambda *_: pytest.fail("beyond the check"))
    source = type("Source", (), {"data": str(root), "pairs": 0, "prepared": True, "title": "mine"})()
    with pytest.raises(ValueError, match="seem to map target to source"):
        opened_source.opened(source, tmp_path, rescales=False)
    done = CliRunner().invoke(app, ["datasets", "inspect", str(root)])
    assert done.exit_code == 2
    assert "#inverted" in done.stderr


def test_pairs_that_tell_nothing_do_not_speak(tmp_path: Path) -> None:
    source, target, T = drawn(np.random.default_rng(1))
    far = se3.from_rt(np.eye(3), np.array([0.0, 900.0, 0.0]))
    for k in range(4):  # of two places: no pose brings them together
        write(tmp_path / "apart", f"p{k}", source, target + [500.0, 0, 0], far)
    write(tmp_path / "same", "one", source, source, np.eye(4))
    for name in ("apart", "same"):
        vouch(PairFolder(tmp_path / name))
    # One inverted pair among disjoint and right ones does not speak for all; among disjoint ones alone it does.
    for k in range(3):
        write(tmp_path / "mixed", f"right{k}", source, target, T)
    write(tmp_path / "mixed", "wrong", source, target, se3.inverse(T))
    vouch(PairFolder(tmp_path / "mixed"))
    write(tmp_path / "apart", "wrong", source, target, se3.inverse(T))
    vouch(PairFolder(tmp_path / "apart"))  # a fifth of the pairs: too few
    write(tmp_path / "apart", "wrong too", source, target, se3.inverse(T))
    with pytest.raises(ValueError, match="seem to map"):
        vouch(PairFolder(tmp_path / "apart"))


def test_one_pair_that_cannot_be_read_does_not_hide_the_others(tmp_path: Path) -> None:
    root = made(tmp_path / "pairs")
    (root / "p0" / "source.npy").write_bytes(b"nothing")
    with pytest.raises(ValueError, match="mean overlap of 2 pairs"):
        vouch(PairFolder(root))
    for k in (1, 2):
        (root / f"p{k}" / "target.npy").write_bytes(b"nothing")
    vouch(PairFolder(root))  # told where they are read


def test_a_list_of_known_direction_that_was_turned_is_stopped_too(tmp_path: Path) -> None:
    # As if somebody had remade KITTI's list the other way round: reading is not stopped, a table is.
    tree = loader_trees.helipr(tmp_path)
    from hybridreg.data import HeLiPr

    entries = HeLiPr(tree.root).entries
    right = ListedPairs(list(entries), tmp_path)
    vouch(right)
    import dataclasses

    turned = [dataclasses.replace(e, T_target_source=se3.inverse(e.T_target_source)) for e in entries]
    with pytest.raises(direction.WrongDirection, match="seem to map target to source, invert them"):
        vouch(ListedPairs(turned, tmp_path))
    assert len(ListedPairs(turned, tmp_path)[0].pair.source) > 0


def test_the_real_and_the_simulated_pairs_pass(real_data: Path) -> None:
    vouch(PairFolder(real_data))
    for tier in ("near", "disjoint"):
        found = direction.measured(Simulated4(tier), 4)
        assert found.n_inverted == 0


class Simulated4:
    """Four pairs of a tier, to be read without a check."""

    overlap_radius = 0.5

    def __init__(self, tier: str) -> None:
        self.pairs = open_dataset(f"sim:val/{tier}#4")

    def __len__(self) -> int:
        return len(self.pairs)

    def read(self, index: int) -> hr.LabelledPair:
        return self.pairs[index]
