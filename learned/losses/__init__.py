# SPDX-License-Identifier: MIT
"""Losses that several networks use."""
