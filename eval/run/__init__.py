# SPDX-License-Identifier: MIT
"""Running methods over a data set, and what is stored."""
