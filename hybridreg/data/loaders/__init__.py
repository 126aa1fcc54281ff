# SPDX-License-Identifier: MIT
"""One published data set, or one kind of folder, a file."""
