# SPDX-License-Identifier: MIT
"""Run the benchmarks that compare the library with others: `python -m benchmarks --data FOLDER`."""

from __future__ import annotations

import argparse
import subprocess
import sys

# Each in its own process, so that none measures what another left in memory.
AGAINST_PEERS = ("voxel_speed", "nearest_speed", "ransac_speed", "peers")


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", default=list(AGAINST_PEERS), help="; ".join(AGAINST_PEERS))
    parser.add_argument("--data", default="../shared/data/real", help="a folder of pairs")
    options = parser.parse_args()
    worst = 0
    for name in options.names:
        print(f"\n== {name}", flush=True)
        command = [sys.executable, "-m", f"benchmarks.{name}", "--data", options.data]
        worst = max(worst, subprocess.run(command, check=False).returncode)
    return worst


if __name__ == "__main__":
    sys.exit(main())
