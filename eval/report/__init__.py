# SPDX-License-Identifier: MIT
"""Tables, figures and pages of results."""
