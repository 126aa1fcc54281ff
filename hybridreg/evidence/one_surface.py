# SPDX-License-Identifier: MIT
"""Does the shape of the one surface that both clouds show hold the pose?

On hills, dunes and the sea floor all there is faces up: most of the evidence finds nothing to weigh there, and smooth
slopes have no relief of a few metres. But where the clouds lie on one another everywhere, and anywhere beside the pose
they would lie less closely, it is no pose to be called wrong. A level field lies as closely anywhere.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hybridreg.evidence.evidence import Evidence
from hybridreg.evidence.pose_evidence import PoseEvidence
from hybridreg.evidence.surface_distance import closeness
from hybridreg.geometry import se3

Array = NDArray[np.float64]

# Of what both saw: agreeing share, share seen through, share of either cloud that is visible. All by hand, as below: of
# 25 pairs of different places that were called "failed" (hard kinds with even seeds) none comes near all of these.
_ALL, _NONE, _SEEN = 0.85, 0.01, 0.3
# Nats per point by which they lie closer than by chance, at least: 17 right poses on made hills have 1.2 to 2.3, eight
# wrong ones no more than 0.35.
_CLOSELY = 0.6
# Tolerances that the pose is moved along what holds it least, and the nats per point that it must lose by that: these
# lose 0.09 to 2.1, level fields some 0.02.
_MOVED, _LOSES = 2.0, 0.05
# Motions that are tried, those that are held least.
_DIRECTIONS = 3


def holds(at: PoseEvidence, evidence: Evidence, metres: float) -> bool:
    """Whether both clouds lie on one another, and less closely beside the pose, by tolerances of so many `metres`."""
    visible = min(evidence.visible_source, evidence.visible_target)
    one = evidence.agreement_most > _ALL and evidence.looked_through < _NONE and visible > _SEEN
    if not one or at.closeness < _CLOSELY or evidence.overturned:
        return False
    beside = [closeness(at.views.fine, T) for T in _beside(at, _MOVED * metres)]
    return at.closeness - max(beside) > _LOSES


def _beside(at: PoseEvidence, metres: float) -> list[Array]:
    # The pose, moved either way along the motions that hold it least.
    moves = np.concatenate([way * metres * at.information.loosest(_DIRECTIONS) for way in (-1.0, 1.0)])
    centre = at.information.centre
    return [se3.about(centre, se3.rotation_about(move[:3]), move[3:]) @ at.T for move in moves]
