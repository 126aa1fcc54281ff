# SPDX-License-Identifier: MIT
"""Maintainers' tools: fuzzing, kill tests, pictures and README figures."""
