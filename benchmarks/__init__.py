# SPDX-License-Identifier: MIT
"""Ratios to other libraries, each measured in one run."""
