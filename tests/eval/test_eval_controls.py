# SPDX-License-Identifier: MIT
"""Controls know what no method does; nobody else does, and the table says so."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from eval_stubs import Scattered

import hybridreg as hr
from hybridreg import testing
from hybridreg.eval import table_file, table_run
from hybridreg.eval.report import formats
from hybridreg.eval.run.controls import MARK, Control, TrueOverlap, after
from hybridreg.eval.run.prediction import predict
from hybridreg.geometry import se3
from hybridreg.matches import Correspondences, Overlap
from hybridreg.pair import LabelledPair
from hybridreg.scene import Scene

STILL = {"voxel": 0.5, "match": "none", "estimate": "identity", "refine": "none"}


class Yards(Scattered):
    """Pairs with a camera image, as the made courtyards have."""

    def load(self, index: int) -> LabelledPair:
        pair, T = testing.sample_pair(index, 900)
        return LabelledPair(pair=dataclasses.replace(pair, id=self.ids[index]), T_target_source=T)


@dataclasses.dataclass(frozen=True, kw_only=True)
class Watching:
    """A matcher that leaves word of what it was shown."""

    def __call__(self, scene: Scene, overlap: Overlap) -> Correspondences:
        sees = "an image" if scene.pair.image is not None else "no image"
        scene.note(f"sees {sees}, keeps {int((overlap.source > 0.5).sum())} of {len(scene.source)}")
        assert not any("T_target_source" in vars(thing) for thing in (scene, scene.pair))
        return Correspondences.of(np.zeros((0, 3)), np.zeros((0, 3)))


PIPE = hr.Pipeline(voxel=0.5, match=Watching(), estimate="identity", refine="none")


def test_the_oracle_mask_is_the_overlap_under_the_truth() -> None:
    labelled = Yards().load(0)
    pipeline, pair = Control(pipeline=PIPE, oracle=True).told(labelled)
    scene = pipeline.downsample(pair)
    found = pipeline.overlap(scene)
    moved = se3.apply(labelled.T_target_source, scene.source.points)
    apart = np.linalg.norm(moved[:, None] - scene.target.points[None], axis=2)
    assert np.array_equal(found.source > 0.5, apart.min(axis=1) < 1.0)
    assert np.array_equal(found.target > 0.5, apart.min(axis=0) < 1.0)
    assert 0.2 < found.source.mean() < 1.0
    assert PIPE.overlap != pipeline.overlap, "the pipeline that was given is as it was"


def test_rows_of_a_control_have_the_true_mask_and_rows_of_the_pipeline_do_not(tmp_path: Path) -> None:
    told = predict(Control(pipeline=PIPE, oracle=True), Yards(2), tmp_path / "oracle.jsonl")
    plain = predict(PIPE, Yards(2), tmp_path / "plain.jsonl")
    assert all(row.error is None for row in (*told, *plain))
    assert [row.mask["f1"] for row in told if row.mask] == [1.0, 1.0]
    assert [row.mask for row in plain] == [None, None]
    assert all(any("from the ground truth" in note for note in row.notes) for row in told)
    with pytest.raises(ValueError, match=r"another configuration .*control"):
        predict(PIPE, Yards(2), tmp_path / "oracle.jsonl")


def test_a_withheld_image_is_not_there(tmp_path: Path) -> None:
    (blind,) = predict(Control(pipeline=PIPE, image=False), Yards(1), tmp_path / "blind.jsonl")
    (seeing,) = predict(Control(pipeline=PIPE), Yards(1), tmp_path / "seeing.jsonl")
    assert any(note.startswith("sees no image") for note in blind.notes)
    assert any(note.startswith("sees an image") for note in seeing.notes)


def test_another_pairs_image_is_the_next_ones() -> None:
    first, second = (LabelledPair(pair=dataclasses.replace(Yards().load(0).pair, image=np.full((8, 8, 3), k, np.uint8)),
                                  T_target_source=np.eye(4)) for k in (10, 20))  # fmt: skip
    control = Control(pipeline=PIPE, image="other")
    for index, shown in ((0, second), (1, first)):
        both = [first, second]
        _, pair = control.told(both[index], after(both, index))
        assert np.array_equal(pair.image, shown.pair.image)
        assert np.array_equal(pair.source.points, [first, second][index].pair.source.points)
    assert control.to_spec()["control"]["image"] == "other"


@pytest.mark.parametrize("image", ["others", 1, None])
def test_an_image_is_the_pairs_or_none_or_anothers(image: object) -> None:
    with pytest.raises(ValueError, match="image = .*expected true, false or 'other'"):
        Control(pipeline=PIPE, image=image)  # type: ignore[arg-type]


def test_the_truth_cannot_be_named_in_a_pipeline_file(tmp_path: Path) -> None:
    told, _ = Control(pipeline=hr.Pipeline(**STILL), oracle=True).told(Yards().load(0))
    assert isinstance(told.overlap, TrueOverlap)
    with pytest.raises(ValueError, match="not registered"):
        told.save(tmp_path / "p.toml")
    with pytest.raises(KeyError, match="only name registered stages"):
        hr.Pipeline(overlap="hybridreg.eval.run.controls:TrueOverlap")


def test_rows_of_a_file_become_controls_and_are_marked(tmp_path: Path) -> None:
    read = table_file.parse(
        {
            "base": STILL,
            "row": [
                {"name": "plain"},
                {"name": "mask", "oracle": "overlap"},
                {"name": "blind", "image": False},
            ],
        }
    )
    plain, mask, blind = (line.method for line in read.lines)
    assert isinstance(plain, hr.Pipeline)
    assert mask == Control(pipeline=plain, oracle=True)
    assert blind == Control(pipeline=plain, image=False)
    assert [line.name for line in read.lines] == ["plain", f"mask{MARK}", "blind"]
    done = table_run.run(read, Yards(1), tmp_path, data="yards")
    assert sorted(f.name for f in (tmp_path / "predictions").iterdir()) == [
        "blind.jsonl", "mask.jsonl", "plain.jsonl",
    ]  # fmt: skip
    text = formats.markdown(done, read.protocols)
    assert f"| mask{MARK} |" in text
    assert f"| mask{MARK} | 1 | 100.0 | 100.0 | 100.0 | 100.0 |" in text, "a mask from the truth is right"
    assert "are controls, not methods" in text
    assert r"mask $\dagger$" in formats.latex(done, read.protocols)


@pytest.mark.parametrize(
    ("row", "told"),
    [
        ({"oracle": "pose"}, "oracle = 'pose': only 'overlap'"),
        ({"image": 0}, "image = 0: expected true, false or"),
    ],
)
def test_other_controls_are_refused(row: dict[str, object], told: str) -> None:
    with pytest.raises(ValueError, match=told):
        table_file.parse({"base": STILL, "row": [row]})
