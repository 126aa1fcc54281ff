# SPDX-License-Identifier: MIT
"""Fuzzing, kills, pictures and README figures: what maintainers run."""
