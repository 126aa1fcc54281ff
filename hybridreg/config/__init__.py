# SPDX-License-Identifier: MIT
"""Configurations: bounds on their fields, and frozen dataclasses from plain values."""
