# SPDX-License-Identifier: MIT
"""The point pyramid: points, neighbours and links of every stage."""
