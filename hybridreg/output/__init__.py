# SPDX-License-Identifier: MIT
"""Results in the words, files and pictures of other tools."""
