# SPDX-License-Identifier: MIT
"""Did it work? Evidence for and against a pose, and a verdict in words."""

from hybridreg.verdict.judgement import Judgement, Weighed, judge, of_scale, weigh

__all__ = ["Judgement", "Weighed", "judge", "of_scale", "weigh"]
