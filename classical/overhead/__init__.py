# SPDX-License-Identifier: MIT
"""Searches that look at both clouds from above: filled and free columns, and the relief of the ground."""
