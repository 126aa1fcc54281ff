# SPDX-License-Identifier: MIT
"""What speaks for or against one pose."""
