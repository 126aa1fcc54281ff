# SPDX-License-Identifier: MIT
"""`hybridreg datasets`: what it tells, and that it does not let inverted poses pass."""

from __future__ import annotations

import pickle
import sys
from pathlib import Path

import numpy as np
import pytest

from hybridreg.cli import main
from hybridreg.data import open_dataset
from hybridreg.data.summary import summarise
from hybridreg.geometry import se3

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "data"))
import loader_trees


def run(capsys: pytest.CaptureFixture[str], *arguments: str) -> tuple[int, str, str]:
    with pytest.raises(SystemExit) as left:
        main(arguments)
    told = capsys.readouterr()
    return int(left.value.code or 0), told.out, told.err


@pytest.fixture(scope="session")
def archive(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return loader_trees.cross3dreg(tmp_path_factory.mktemp("archive")).root


def test_every_data_set_is_listed_with_licence_size_place_and_a_check(
    capsys: pytest.CaptureFixture[str],
) -> None:
    from hybridreg.data import catalogue
    from hybridreg.data.dataset_facts import FACTS

    assert set(FACTS) == set(catalogue.BUILT_IN)
    code, out, _ = run(capsys, "datasets")
    assert code == 0
    for name, facts in FACTS.items():
        assert f"{name}: {facts.what}" in out
        for text in (facts.licence, facts.size, facts.place, facts.check):
            assert text
            assert text in out
        # The command that checks it is one that opens by that loader's own name.
        assert facts.opened == "FOLDER" or facts.opened.startswith(f"{name}:")
    assert "pandaset: forward solid-state" in out
    assert "  licence: CC BY 4.0" in out


def test_the_simulators_check_runs(capsys: pytest.CaptureFixture[str]) -> None:
    code, out, _ = run(capsys, "datasets", "inspect", "sim:test/near#1")
    assert code == 0
    assert "pairs: 1, of which 1 were read" in out


def test_inspect_tells_everything(archive: Path, capsys: pytest.CaptureFixture[str]) -> None:
    code, out, err = run(capsys, "datasets", "inspect", str(archive))
    assert (code, err) == (0, "")
    simulated = loader_trees.simulated()
    assert "pairs: 3, of which 3 were read" in out
    assert "seq_id, frame0, frame1, transform, pcd0, pcd1" in out
    assert "source: array limited (3)" in out
    assert "target: lidar spinning (3)" in out
    assert "images: 3 of 3" in out
    rre = np.mean([se3.angle_deg(each.T_target_source[:3, :3]) for each in simulated])
    rte = np.mean([np.linalg.norm(each.T_target_source[:3, 3]) for each in simulated])
    assert f"identity: RRE {rre:.1f} deg, RTE {rte:.1f} m" in out
    assert "94.7 deg, 9.3 m" in out
    bars = [line.split() for line in out.splitlines() if " to " in line and line.startswith("  ")]
    assert sum(int(words[3]) for words in bars) == 3


def test_inspect_refuses_inverted_poses(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    root = loader_trees.cross3dreg(tmp_path, inverted=True).root
    code, out, err = run(capsys, "datasets", "inspect", f"cross3dreg:{root}")
    assert code == 2
    assert "under their inverses" in out  # the figures are told first
    assert "map target to source; open the data set with inverted=yes" in err
    assert "Traceback" not in err
    assert run(capsys, "datasets", "inspect", f"cross3dreg:{root}#inverted")[0] == 0


def test_inspect_of_a_hostile_list(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    root = loader_trees.cross3dreg(tmp_path).root
    (root / "metadata" / "test.pkl").write_bytes(pickle.dumps([sys.exit]))
    code, out, err = run(capsys, "datasets", "inspect", str(root))
    assert (code, out) == (2, "")
    assert "asks for sys.exit" in err


def test_inspect_of_nothing(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    code, out, err = run(capsys, "datasets", "inspect", str(tmp_path / "nothing"))
    assert (code, out) == (2, "")
    assert "there is no such folder" in err
    assert run(capsys, "datasets", "inspect", f"kitti:{tmp_path}")[0] == 2


def test_inspect_of_any_data_set(real_data: Path, capsys: pytest.CaptureFixture[str]) -> None:
    code, out, _ = run(capsys, "datasets", "inspect", str(real_data), "--pairs", "4")
    assert code == 0
    assert "of which 4 were read" in out


def test_kitti_list_is_made(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    tree = loader_trees.kitti(tmp_path)
    code, out, _ = run(capsys, "datasets", "kitti-list", str(tree.root), "--split", "val")
    assert code == 0
    assert "hybridreg-val.json" in out
    assert open_dataset(f"kitti:{tree.root}#val")[0].pair.meta["poses"] == "T_icp @ M"
    code, _, err = run(capsys, "datasets", "kitti-list", str(tree.root), "--split", "test")
    assert code == 2
    assert "KITTI's sequence 08 is missing" in err


def test_summary_measures_all_poses_but_reads_few_pairs(tmp_path: Path) -> None:
    tree = loader_trees.helipr(tmp_path)
    found = summarise(open_dataset(tree.spelled), n=1)
    assert (found.n_pairs, found.n_read) == (2, 1)
    assert len(found.translation_m) == 2
    assert np.allclose(
        found.translation_m, [np.linalg.norm(T[:3, 3]) for T in tree.truth.values()], atol=1e-6
    )
    assert found.roles["source"].most_common(1)[0][0] == ("Avia", "limited")
    with pytest.raises(ValueError, match="0 pairs"):
        summarise([])
