# SPDX-License-Identifier: MIT
"""One number for one thing: masks at the threshold that is applied, inliers before any filter."""

from __future__ import annotations

import ast
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from hybridreg import testing
from hybridreg.cli import doctor
from hybridreg.eval import PROTOCOLS
from hybridreg.eval.run.prediction import predict
from hybridreg.eval.run.row import Row
from hybridreg.eval.run.truth import mask_threshold
from hybridreg.eval.score import scoring
from hybridreg.geometry import se3
from hybridreg.matches import Correspondences, Overlap
from hybridreg.pair import LabelledPair
from hybridreg.pipeline import Pipeline
from hybridreg.scene import Scene

ROOT = Path(__file__).resolve().parents[2]


@dataclass(frozen=True, kw_only=True)
class HalfWrong:
    """Fifty right matches and fifty wrong ones, of which its filter leaves out all but ten."""

    filtered: bool = True
    min_overlap: float | None = 0.5
    gives = frozenset({"matches"})

    def __call__(self, scene: Scene, overlap: Overlap) -> Correspondences:
        source = scene.source.points[:50]
        target = se3.apply(testing.sample_scene()[1], source)
        wrong = 10 if self.filtered else 50
        return Correspondences.of(
            np.vstack([source, source[:wrong]]), np.vstack([target, target[:wrong] + 30.0])
        )

    def unfiltered(self) -> HalfWrong | None:
        return HalfWrong(filtered=False, min_overlap=self.min_overlap) if self.filtered else None


def graded(scene: Scene) -> Overlap:
    """0.4 for the first half of each level, 0.8 for the rest."""
    return Overlap(
        *(
            np.where(np.arange(len(level)) < len(level) // 2, 0.4, 0.8)
            for level in (scene.source, scene.target)
        )
    )


@pytest.fixture(scope="module")
def labelled() -> LabelledPair:
    pair, T = testing.sample_pair()
    return LabelledPair(pair=pair, T_target_source=T)


def row(labelled: LabelledPair, tmp_path: Path, **fields: object) -> Row:
    match = HalfWrong(**fields)  # type: ignore[arg-type]
    pipe = Pipeline(voxel=0.5, overlap=graded, match=match, refine="none")
    return predict(pipe, [labelled], tmp_path / "rows.jsonl", overwrite=True)[0]


def test_inliers_are_counted_before_the_filter_and_after_it_beside(
    labelled: LabelledPair, tmp_path: Path
) -> None:
    found = row(labelled, tmp_path)
    assert found.error is None
    assert found.n_matches == 60
    assert found.inlier_ratio is not None
    assert found.inlier_ratio_filtered is not None
    assert found.inlier_ratio["1"] == 0.5
    assert found.inlier_ratio_filtered["1"] == pytest.approx(50 / 60)
    score = scoring.score([found], PROTOCOLS["cross3dreg"])
    assert (score.inlier_ratio, score.inlier_ratio_filtered) == (0.5, pytest.approx(50 / 60))


def test_without_a_filter_both_are_one(labelled: LabelledPair, tmp_path: Path) -> None:
    found = row(labelled, tmp_path, filtered=False)
    assert found.inlier_ratio_filtered is None
    score = scoring.score([found], PROTOCOLS["cross3dreg"])
    assert score.inlier_ratio == score.inlier_ratio_filtered == 0.5


def test_masks_are_scored_where_they_are_cut(labelled: LabelledPair, tmp_path: Path) -> None:
    low, high = (row(labelled, tmp_path, min_overlap=cut) for cut in (0.3, 0.5))
    assert (low.mask_threshold, high.mask_threshold) == (0.3, 0.5)
    assert low.mask is not None
    assert high.mask is not None
    assert low.mask["recall"] == 1.0
    assert high.mask["recall"] < 1.0


def test_a_network_says_where_it_cuts() -> None:
    from hybridreg import Fpfh, Vgam

    assert mask_threshold(Vgam(weights="cross3dreg-small")) == 0.3
    assert mask_threshold(Vgam(weights="cross3dreg-small", as_published=True)) == 0.5
    assert mask_threshold(Vgam(weights="cross3dreg-small", min_overlap=0.7)) == 0.7
    assert mask_threshold(Fpfh(min_overlap=0.2)) == 0.2
    assert mask_threshold(lambda scene, overlap: None) == 0.5


def test_a_shipped_network_leaves_out_what_its_filters_do_and_nothing_as_published() -> None:
    from hybridreg import GeoTransformer

    assert GeoTransformer(weights="geotransformer-small").unfiltered() == GeoTransformer(
        weights="geotransformer-small", filtered=False
    )
    assert GeoTransformer(weights="geotransformer-small", as_published=True).unfiltered() is None
    assert GeoTransformer(weights="geotransformer-small", filtered=False).unfiltered() is None


def test_a_downsampling_that_does_not_reach_the_matcher_stands_in_the_table() -> None:
    from hybridreg.eval.scored_table import Entry, Table
    from hybridreg.learned.stages.network_grid import note_grid

    scene, _ = testing.sample_scene()
    assert not note_grid(scene, 0.8)
    truth = np.eye(4).tolist()
    rows = [Row(index=0, id="p", T_true=truth, notes=list(scene.notes))]
    entries = [
        Entry(name="learned, finely", rows=rows),
        Entry(name="fpfh", rows=[Row(index=0, id="p", T_true=truth)]),
    ]
    told = Table(title="t", data="d", seed=0, starts=0, entries=entries).remarks()
    assert told == [
        "What the downsample slot chose did not reach the networks of learned, finely: each put the clouds on a "
        "grid of its own"
    ]
    both = [Entry(name=name, rows=rows) for name in ("learned, finely", "learned, coarsely")]
    told = Table(title="t", data="d", seed=0, starts=0, entries=both).remarks()
    assert told == [
        "What the downsample slot chose did not reach the networks of all methods: each put the clouds on a grid of "
        "its own"
    ]


def test_doctor_claims_no_package_that_nothing_imports() -> None:
    imported = set()
    for top in ("hybridreg", "classical", "learned", "eval"):
        for path in (ROOT / top).rglob("*.py"):
            if path.stem == "doctor":
                continue
            for node in ast.walk(ast.parse(path.read_text())):
                if isinstance(node, ast.Import):
                    imported |= {alias.name.partition(".")[0] for alias in node.names}
                elif isinstance(node, ast.ImportFrom):
                    imported.add((node.module or "").partition(".")[0])
                elif isinstance(node, ast.Call) and ast.unparse(node.func).endswith(
                    ("import_module", "load")
                ):
                    texts = [a for arg in node.args for a in ast.walk(arg) if _is_text(a)]
                    imported |= {ast.literal_eval(a).partition(".")[0] for a in texts}
    # joblib's backend "dask" imports distributed.
    assert {name.partition(".")[0] for name in doctor._NEEDED} - imported == {"distributed"}


def _is_text(node: ast.AST) -> bool:
    return isinstance(node, ast.Constant) and isinstance(node.value, str)
