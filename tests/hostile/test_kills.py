# SPDX-License-Identifier: MIT
"""A batch that is killed loses no finished pair; what is done twice makes the same table."""

from __future__ import annotations

from pathlib import Path

import pytest

from tools.hostile import killed_batch, two_writers

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture
def batch(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    killed_batch.write_data(tmp_path / "data", 3)
    return tmp_path


def test_killed_three_times_and_begun_again(batch: Path) -> None:
    killed_batch.run_whole(batch, "whole", 1)
    story = killed_batch.run_killed(batch, "killed", kills=3, whole="whole", workers=1, seed=1)
    assert story.kills == 3
    killed_batch.same_tables(batch, "whole", "killed")


def test_two_writers_lose_nothing(batch: Path) -> None:
    killed_batch.run_whole(batch, "whole", 1)
    met = two_writers.run_two(batch, "two", rounds=1, workers=1, seed=1)
    assert met.refused + met.finished >= 1
    killed_batch.same_tables(batch, "whole", "two")
    two_writers.overwrite_is_refused(batch, "beside", 1)


@pytest.mark.parametrize(
    ("after", "words"),
    [
        ({"a.jsonl": [b'{"format": 1}\n']}, "lost or changed"),
        ({"a.jsonl": [b'{"format": 1}\n', b'{"id": "x", "index": 1}\n']}, "lost or changed"),
        ({}, "lost or changed"),
        (
            {"a.jsonl": [b'{"format": 1}\n', b'{"id": "x"}\n', b'{"id": "x"}\n']},
            "occur twice",
        ),
    ],
)
def test_the_comparison_sees_what_is_lost_changed_or_doubled(
    after: dict[str, list[bytes]], words: str
) -> None:
    before = {"a.jsonl": [b'{"format": 1}\n', b'{"id": "x"}\n']}
    with pytest.raises(AssertionError, match=words):
        killed_batch.compare(before, after)
