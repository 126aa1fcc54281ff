# SPDX-License-Identifier: MIT
from __future__ import annotations

import json
import pickle
import shutil
from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np
import pytest

from hybridreg.data import PairFolder, catalogue, open_dataset
from hybridreg.geometry import se3
from hybridreg.pair import LabelledPair

T = se3.from_rt(se3.yaw(30.0)[:3, :3], np.array([1.0, 2.0, 3.0]))


def make_pair(folder: Path, seed: int = 0, **meta: object) -> None:
    folder.mkdir(parents=True)
    source = np.random.default_rng(seed).uniform(-9.0, 9.0, (60, 3))
    np.savez(folder / "source.npz", xyz=source.astype(np.float32))
    np.savetxt(folder / "target.xyz", se3.apply(T, source))
    (folder / "meta.json").write_text(json.dumps({"T_target_source": T.tolist(), **meta}))


@pytest.fixture
def root(tmp_path: Path) -> Path:
    for i, name in enumerate(("b", "a", "c")):
        make_pair(tmp_path / "pairs" / name, seed=i)
    (tmp_path / "pairs" / "README.md").write_text("not a pair")
    (tmp_path / "pairs" / "frames" / "one").mkdir(parents=True)
    np.save(tmp_path / "pairs" / "frames" / "one" / "cloud.npy", np.eye(3))
    return tmp_path / "pairs"


def test_reads_pairs_in_the_order_of_their_names(root: Path) -> None:
    pairs = PairFolder(root)
    assert pairs.ids == ("a", "b", "c")
    assert [labelled.pair.id for labelled in pairs] == ["a", "b", "c"]
    assert pairs[-1].pair.id == "c"
    assert [labelled.pair.id for labelled in pairs[1:]] == ["b", "c"]
    first = pairs[0]
    assert np.allclose(
        se3.apply(first.T_target_source, first.pair.source.points), first.pair.target.points, atol=1e-5
    )
    with pytest.raises(IndexError):
        _ = pairs[3]


def test_an_image_comes_along(root: Path) -> None:
    cv2.imwrite(str(root / "a" / "image.png"), np.full((4, 6, 3), (10, 20, 200), np.uint8))
    image = PairFolder(root)[0].pair.image
    assert image is not None
    assert (image.shape, image[0, 0].tolist()) == ((4, 6, 3), [200, 20, 10])
    assert PairFolder(root)[1].pair.image is None


def test_nothing_in_the_pair_tells_the_pose(tmp_path: Path) -> None:
    leaks = {"T_published": T.tolist(), "relative_motion": {"rotation_deg": 30.0}, "overlap": 0.7,
             "image": {"T_camera_source": T.tolist()}, "checks": {"icp_moves_m": 0.1}}  # fmt: skip
    make_pair(tmp_path / "p" / "x", kind="cross-sensor", source_sensor="fan", licence="MIT", **leaks)
    labelled = PairFolder(tmp_path / "p")[0]
    assert labelled.pair.meta == {"kind": "cross-sensor", "source_sensor": "fan", "licence": "MIT"}
    assert labelled.overlap == 0.7


def test_is_lazy_and_pickles_small(root: Path) -> None:
    pairs = PairFolder(root)
    (root / "b" / "source.npz").write_bytes(b"nonsense")
    assert pairs[0].pair.id == "a"
    with pytest.raises(ValueError, match=r"source\.npz"):
        _ = pairs[1]
    stored = pickle.dumps(pairs)
    assert len(stored) < 1000
    assert pickle.loads(stored).ids == pairs.ids


@pytest.mark.parametrize("kind", ["source.npz", "target.xyz", "meta.json"])
def test_says_what_is_missing_and_where(root: Path, kind: str) -> None:
    (root / "b" / kind).unlink()
    with pytest.raises(
        FileNotFoundError, match=rf"pairs.b: {kind.split('.')[0]}.* missing; it must lie in that folder"
    ):
        # Without a source and a meta.json a folder is no pair at all.
        PairFolder(root)


def test_a_folder_without_pairs_says_what_a_pair_is(tmp_path: Path) -> None:
    with pytest.raises(
        FileNotFoundError, match=r"no pairs; each must be a folder .* with source\.\*, target\.\*"
    ):
        PairFolder(tmp_path)
    with pytest.raises(FileNotFoundError, match="no such folder"):
        PairFolder(tmp_path / "nowhere")


def test_two_sources_are_refused(root: Path) -> None:
    shutil.copy(root / "a" / "source.npz", root / "a" / "source.npy")
    with pytest.raises(ValueError, match=r"2 files are called source\.\*"):
        PairFolder(root)


@pytest.mark.parametrize(
    ("meta", "told"),
    [
        ("{", "not a JSON file"),
        ("[]", "T_target_source is missing"),
        ('{"T": 1}', "T_target_source is missing"),
        ('{"T_target_source": [[1, 0], [0, 1]]}', r"expected shape \(4, 4\), got \(2, 2\)"),
        (json.dumps({"T_target_source": (2 * np.eye(4)).tolist()}), "last row"),
    ],
)
def test_a_bad_meta_names_its_file(root: Path, meta: str, told: str) -> None:
    (root / "a" / "meta.json").write_text(meta)
    with pytest.raises(ValueError, match=rf"meta\.json.*{told}"):
        _ = PairFolder(root)[0]


def test_fingerprint_follows_pairs_and_truth(root: Path) -> None:
    before = PairFolder(root).fingerprint()
    assert PairFolder(root).fingerprint() == before
    moved = {"T_target_source": np.eye(4).tolist()}
    (root / "a" / "meta.json").write_text(json.dumps(moved))
    after = PairFolder(root).fingerprint()
    make_pair(root / "d")
    assert len({before, after, PairFolder(root).fingerprint()}) == 3


def test_opens_by_path_and_by_name(root: Path) -> None:
    assert list(open_dataset(root).ids) == list(open_dataset(f"folder:{root}").ids) == ["a", "b", "c"]  # type: ignore[attr-defined]
    with pytest.raises(FileNotFoundError, match=r"no such folder, and no loader.*folder:\.\.\."):
        open_dataset("simm:test/near")


def tiny(rest: str) -> Sequence[LabelledPair]:
    """A loader of somebody else's."""
    raise ValueError(f"asked for {rest}")


def test_other_loaders_come_in_by_name(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(catalogue.known(), "tiny", f"{__name__}:tiny")
    assert "tiny" in catalogue.names()
    with pytest.raises(ValueError, match="asked for test/near"):
        open_dataset("tiny:test/near")


def test_real_pairs_are_of_this_layout(real_data: Path) -> None:
    pairs = PairFolder(real_data)
    folders = [file.parent for file in real_data.glob("*/meta.json")]
    assert len(pairs) == len(folders) >= 15
    assert "frames" not in pairs.ids
    with_image = sum(any(folder.glob("image.*")) for folder in folders)
    assert sum(labelled.pair.image is not None for labelled in pairs) == with_image >= 3
