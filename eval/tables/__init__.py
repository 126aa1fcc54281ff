# SPDX-License-Identifier: MIT
"""Tables that come with the library."""
