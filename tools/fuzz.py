# SPDX-License-Identifier: MIT
"""Fuzzing: hostile inputs of every kind, each in a watched process: no crash, no hang, no undocumented exception.

Arrays, files, images, TOML, stored JSON and weights are drawn by hypothesis, the same ones for the same seed.
A finding is printed with the case that reproduces it: `eval` its text in `tools.hostile`, call `run`.

    python -m tools.fuzz --inputs 2000
"""

from __future__ import annotations

import argparse
import sys
import time

from tools.hostile import campaign
from tools.hostile.case import Case
from tools.hostile.watched import Outcome


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--inputs", type=int, default=2000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--kinds", nargs="*", default=[], help=", ".join(campaign.SHARES))
    parser.add_argument("--limit", type=float, default=30.0, help="seconds beyond which an input hangs")
    parser.add_argument("--messages", action="store_true", help="print one refusal of each sort")
    options = parser.parse_args()
    start = time.perf_counter()
    report = campaign.run(
        options.inputs,
        start=options.seed,
        kinds=tuple(options.kinds),
        limit=options.limit,
        on_case=Teller(),
    )
    if options.messages:
        print("\n".join(sorted(report.messages.values())))
    summary(report, time.perf_counter() - start)
    return 1 if report.findings else 0


class Teller:
    """Prints a finding when it occurs, and further ones from the same place as a dot."""

    def __init__(self) -> None:
        self.seen: set[str] = set()

    def __call__(self, name: str, case: Case, outcome: Outcome) -> None:
        if outcome.word != "finding":
            return
        place = f"{name} {outcome.text.splitlines()[-1][:120]}"
        if place in self.seen:
            print(".", end="", flush=True)
            return
        self.seen.add(place)
        print(f"\nFINDING {name} ({outcome.seconds:.1f} s): {outcome.text}\n    {case!r:.900}", flush=True)


def summary(report: campaign.Report, seconds: float) -> None:
    """Print the counts."""
    print()
    kinds = list(dict.fromkeys(name for name, _ in report.counts))
    print(f"{'kind':24s} {'inputs':>7s} {'fine':>7s} {'refused':>8s} {'findings':>9s}")
    for name in kinds:
        fine, refused, finding = (report.counts[name, word] for word in ("fine", "refused", "finding"))
        print(f"{name:24s} {fine + refused + finding:7d} {fine:7d} {refused:8d} {finding:9d}")
    total = sum(report.counts.values())
    print(f"{total} inputs in {seconds:.0f} s, {len(report.findings)} findings")
    for taken, name, case in report.slowest:
        print(f"slow: {taken:.2f} s, {name}: {case!r:.500}")


if __name__ == "__main__":
    sys.exit(main())
