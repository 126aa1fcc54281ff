# SPDX-License-Identifier: MIT
"""Did it work? Evidence for and against a pose, and a verdict in words."""

from hybridreg.verdict.judgement import Judgement, Weighed, judge, weigh

__all__ = ["Judgement", "Weighed", "judge", "weigh"]
