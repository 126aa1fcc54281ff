# SPDX-License-Identifier: MIT
"""Hierarchical correspondence filtering (VRHCF)."""
