# SPDX-License-Identifier: MIT
"""A conformance suite for stages: the library's own pass it, and so should yours.

>>> from hybridreg.testing import check_stage
>>> check_stage(MyMatcher(), "match")
"""

from hybridreg.testing.small_inputs import sample_pair, sample_scene, true_matches
from hybridreg.testing.stage_checks import check_stage, checks, slot_of

__all__ = ["check_stage", "checks", "sample_pair", "sample_scene", "slot_of", "true_matches"]
