# SPDX-License-Identifier: MIT
"""Poses as people, other tools and this library write them down."""
