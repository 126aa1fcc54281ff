# SPDX-License-Identifier: MIT
"""What is known before the search: a start, bounds, gravity, a region, or that the size is not known."""
