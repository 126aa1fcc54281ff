# SPDX-License-Identifier: MIT
"""Ratios against peers, each measured in one run."""
