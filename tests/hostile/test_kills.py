# SPDX-License-Identifier: MIT
"""A batch that is killed loses no finished pair; what is done twice makes the same table."""

from __future__ import annotations

from pathlib import Path

import pytest

from benchmarks.hostile import killed

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture
def batch(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    killed.write_data(tmp_path / "data", 3)
    return tmp_path


def test_killed_three_times_and_begun_again(batch: Path) -> None:
    killed.run_whole(batch, "whole", 1)
    story = killed.run_killed(batch, "killed", kills=3, whole="whole", workers=1, seed=1)
    assert story.kills == 3
    killed.same_tables(batch, "whole", "killed")


@pytest.mark.parametrize(
    ("after", "words"),
    [
        ({"a.jsonl": [b'{"format": 1}\n']}, "lost or changed"),
        ({"a.jsonl": [b'{"format": 1}\n', b'{"id": "x", "index": 1}\n']}, "lost or changed"),
        ({}, "lost or changed"),
        (
            {"a.jsonl": [b'{"format": 1}\n', b'{"id": "x"}\n', b'{"id": "x"}\n']},
            "stand twice",
        ),
    ],
)
def test_the_comparison_sees_what_is_lost_changed_or_doubled(
    after: dict[str, list[bytes]], words: str
) -> None:
    before = {"a.jsonl": [b'{"format": 1}\n', b'{"id": "x"}\n']}
    with pytest.raises(AssertionError, match=words):
        killed.compare(before, after)
