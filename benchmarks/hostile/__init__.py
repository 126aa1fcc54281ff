# SPDX-License-Identifier: MIT
"""Hostile inputs, one kind a file: what `benchmarks.fuzz` draws, and the process in which it is tried."""
