# SPDX-License-Identifier: MIT
"""A short campaign of `tools.fuzz`, and the watch that it keeps."""

from __future__ import annotations

import os
import signal
import time
from dataclasses import dataclass
from typing import Any, ClassVar

from tools.hostile import campaign
from tools.hostile.case import verdict_on
from tools.hostile.watched import Watched


@dataclass(frozen=True, kw_only=True)
class Bad:
    """A case that goes wrong in a way of its choice."""

    kind: ClassVar[str] = "bad"
    allowed: ClassVar[tuple[type[BaseException], ...]] = (ValueError,)

    way: str

    def run(self) -> str:
        ways: dict[str, Any] = {
            "crash": lambda: os.kill(os.getpid(), signal.SIGSEGV),
            "hang": lambda: time.sleep(60),
            "foreign": lambda: int("no number"),
            "broken promise": lambda: AssertionError("..."),
        }
        made = ways[self.way]()
        if isinstance(made, AssertionError):
            raise made
        return "fine"


def test_a_few_inputs_of_each_kind_make_no_finding() -> None:
    report = campaign.run(140, start=7)
    assert [(name, text, case) for name, case, text in report.findings] == []
    assert sum(report.counts.values()) > 130
    for name in campaign.SHARES:  # nothing may be refused altogether, or it tests the gate alone
        assert name == "paths" or report.counts[name, "fine"] > 0


def test_the_same_seed_draws_the_same_inputs() -> None:
    strategy = campaign.SHARES["toml"][1]
    assert campaign.draw(strategy(), 12, 3) == campaign.draw(strategy(), 12, 3)


def test_a_crash_and_a_hang_are_findings_and_the_watch_goes_on() -> None:
    with Watched(limit=1.0) as watched:
        crash, hang = watched.run(Bad(way="crash")), watched.run(Bad(way="hang"))
    assert (crash.word, crash.text) == ("finding", "crash: signal SIGSEGV")
    assert (hang.word, hang.text) == ("finding", "hang: no answer within 1 s")


def test_an_allowed_type_from_foreign_code_is_a_finding_too() -> None:
    # `int("no number")` raises in this file, which is not the library's.
    assert verdict_on(Bad(way="foreign"))[0] == "finding"
    assert verdict_on(Bad(way="broken promise"))[0] == "finding"
