# SPDX-License-Identifier: MIT
"""GeoTransformer: every recorded output within 1e-4."""

from __future__ import annotations

from pathlib import Path

from arrays import Found, complete
from compare import differences, pairs_at_radius
from plan import read_recording

from hybridreg.learned.cross3dreg.targets import compute_targets

TOLERANCE = 1e-4
# Pairs of patches that may be forgiven for points at the radius: one in a hundred, or two.
_FORGIVEN, _FEWEST = 0.01, 2


def compare(stem: Path) -> Found:
    """Largest difference and tolerance by output, and how many overlaps were forgiven."""
    recording = read_recording(stem)
    found = {name: (value, TOLERANCE) for name, value in differences(recording).items()}
    targets = compute_targets(recording.batch.pyramid, recording.values["in.transform"], recording.config)
    tied = len(pairs_at_radius(recording, targets))
    most = max(_FEWEST, _FORGIVEN * len(recording.values["out.gt_node_corr_overlaps"]))
    found |= {"overlaps forgiven, points at the radius": (float(tied), float(int(most)))}
    return complete(found, recording.values, [name for name in recording.values if ".in." in f".{name}"])
