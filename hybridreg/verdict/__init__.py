# SPDX-License-Identifier: MIT
"""Did it work? Evidence for and against a pose, and a verdict in words."""

from hybridreg.verdict.judgement import Judgement, judge, of_scale
from hybridreg.verdict.weighing import Weighed, weigh

__all__ = ["Judgement", "Weighed", "judge", "of_scale", "weigh"]
