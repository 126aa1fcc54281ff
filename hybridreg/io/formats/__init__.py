# SPDX-License-Identifier: MIT
"""Readers of cloud and image formats, one file each."""
