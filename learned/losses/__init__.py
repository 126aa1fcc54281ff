# SPDX-License-Identifier: MIT
"""Shared losses: circle (coarse), assignment (fine), overlap mask, InfoNCE."""
