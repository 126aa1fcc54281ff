# SPDX-License-Identifier: MIT
"""Several entries for one pose, the cheapest first, until one answer is beyond doubt."""
