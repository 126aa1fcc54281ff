# SPDX-License-Identifier: MIT
"""What a file's coordinate reference system says about the unit of its points."""
