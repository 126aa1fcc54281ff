# SPDX-License-Identifier: MIT
"""SIGKILL during a batch at random moments: no finished pair is lost, doubled or changed, and the table is the same.

A table of two methods on small synthetic pairs is run once undisturbed, then repeatedly killed at seeded moments and
restarted, with one worker and with two. Then two at a time are started in one folder: one is refused, and again
nothing is lost.

    python -m tools.kills --kills 20
"""

from __future__ import annotations

import argparse
import os
import tempfile
from pathlib import Path

from tools.hostile import killed_batch, two_writers


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--kills", type=int, default=20)
    parser.add_argument("--meetings", type=int, default=5, help="rounds of two writers")
    parser.add_argument("--pairs", type=int, default=20)
    parser.add_argument("--workers", type=int, nargs="*", default=[1, 2])
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    # The children run elsewhere, and must find this checkout.
    here = str(Path(__file__).resolve().parent.parent)
    os.environ["PYTHONPATH"] = os.pathsep.join([here, os.environ.get("PYTHONPATH", "")]).rstrip(os.pathsep)
    for workers in options.workers:
        with tempfile.TemporaryDirectory() as folder:
            root = Path(folder)
            killed_batch.write_data(root / "data", options.pairs)
            seconds = killed_batch.run_whole(root, "whole", workers)
            story = killed_batch.run_killed(
                root, "killed", kills=options.kills, whole="whole", workers=workers, seed=options.seed
            )
            killed_batch.same_tables(root, "whole", "killed")
            met = two_writers.run_two(
                root, "two", rounds=options.meetings, workers=workers, seed=options.seed
            )
            killed_batch.same_tables(root, "whole", "two")
            two_writers.overwrite_is_refused(root, "beside", workers)
        print(
            f"{workers} worker(s): {seconds:.1f} s undisturbed, {4 * options.pairs} rows; {story.kills} kills, "
            f"rows found at each start {story.began}; nothing lost, doubled or changed, same table",
            flush=True,
        )
        print(
            f"{workers} worker(s), two writers: {options.meetings} rounds, {met.refused} refused, {met.killed} killed, "
            f"{met.finished} finished; nothing lost, doubled or changed, same table; --overwrite beside one refused",
            flush=True,
        )


if __name__ == "__main__":
    main()
