# SPDX-License-Identifier: MIT
"""Hostile inputs, one kind a file: what `tools.fuzz` generates, and the process in which it is tried."""
