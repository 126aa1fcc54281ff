#!/usr/bin/env bash
# hydra4 0.2.0 gives each point of a Hesai PandarXT-32 its `stamp`: the packet's time plus the offsets of the block and of the
# laser. Those of the lasers are in seconds, those of the blocks in microseconds, and all are added as seconds: the eight
# blocks of one packet, 0.35 ms of firing, come out 350 s apart, and the stamps of a turn go to and fro by minutes. The
# places of the points are right, and nothing warns.
#
# Guess before it was run: stamps within 0.4 ms in a packet, and a tenth of a second over a turn (noted after the code was read).
# For whom it matters: whoever undoes the motion in these scans, or looks poses up by the points' times: all that is interpolated is
# wrong, or clamped to the ends of the trajectory. Set `decoder.block_offset_single` and `block_offset_dual` to a millionth.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "hydra4==0.2.0" "pypcd4==1.5.1" "numpy<2.5"
cd "$folder"
TZ=UTC "$folder/env/bin/python" - <<'PYTHON'
import struct
from datetime import datetime, timezone
from importlib.metadata import version
from types import SimpleNamespace

import numpy as np
from hydra4 import Hydra

STEP = 18  # hundredths of a degree from block to block, at ten turns a second
FIRING = 50  # microseconds from block to block
START = datetime(2026, 1, 1, 12, tzinfo=timezone.utc)


def packet(number):
    """Eight blocks of 32 lasers that see a wall 10 m away, one return each."""
    first = number * 8
    blocks = b"".join(
        struct.pack("<H", (first + k) * STEP % 36_000) + struct.pack("<HBB", 2500, 10, 0) * 32 for k in range(8)
    )
    micro = (first + 7) * FIRING
    time = struct.pack("!6B", 2026 - 1900, 1, 1, 12, 0, micro // 1_000_000) + struct.pack("<I", micro % 1_000_000)
    head = struct.pack("!4B", 0xEE, 0xFF, 0x06, 0x01) + bytes(8)
    tail = bytes(9) + struct.pack("!BBH", 0, 0x37, 600) + time + bytes(1)
    return SimpleNamespace(data=head + blocks + tail)


scan = SimpleNamespace(packets=[packet(k) for k in range(260)])
turn = Hydra(Hydra.Model.PandarXT32).to_pypcd4(scan)[0].pc_data
cured = Hydra(Hydra.Model.PandarXT32)
cured.decoder.block_offset_single = [each * 1e-6 for each in cured.decoder.block_offset_single]
right = cured.to_pypcd4(scan)[0].pc_data["stamp"] - START.timestamp()
distance = np.sqrt(sum(turn[axis].astype(float) ** 2 for axis in "xyz"))
seconds = turn["stamp"] - START.timestamp()
one = seconds[: 8 * 32]
print("hydra4", version("hydra4"), "pypcd4", version("pypcd4"), "numpy", np.__version__)
print(f"  {len(turn)} points of one turn, {distance.min():.3f} to {distance.max():.3f} m away")
print(f"  the first packet, fired within {8 * FIRING / 1000:.2f} ms: stamps from {one.min():.2f} s to {one.max():.2f} s")
print(f"  the turn, of {2000 * FIRING / 1e6:.2f} s: stamps from {seconds.min():.2f} s to {seconds.max():.2f} s")
print(f"  firsts of its blocks: {np.round(one[::32], 2).tolist()}")
print(f"  cured: the first packet from {right[:256].min() * 1e3:.3f} ms to {right[:256].max() * 1e3:.3f} ms, the turn {np.ptp(right):.4f} s")
assert np.allclose(distance, 10.0, atol=0.01)
assert np.ptp(right[:256]) < 5e-4 and abs(np.ptp(right) - 0.1) < 1e-3
assert abs(np.ptp(one) - 350.0) < 0.1 and np.allclose(np.diff(one[::32]), 50.0, atol=0.01), "hydra4 no longer does this"
print("microseconds are added as seconds")
PYTHON
