# SPDX-License-Identifier: MIT
"""Hostile inputs, one kind a file: what `tools.fuzz` draws, and the process in which it is tried."""
