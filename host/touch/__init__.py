# SPDX-License-Identifier: Apache-2.0
"""Finding the work by touching it: an edge, a corner, the middle of a hole or of a boss."""
