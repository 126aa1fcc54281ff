# SPDX-License-Identifier: MIT
"""Did it work? Evidence for and against a pose, and a verdict in words."""

from hybridreg.verdict.judgement import Judgement, judge

__all__ = ["Judgement", "judge"]
