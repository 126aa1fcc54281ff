# SPDX-License-Identifier: MIT
"""Arrays in, arrays out: nothing here knows about scenes or stages."""
