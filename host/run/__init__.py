# SPDX-License-Identifier: Apache-2.0
"""A run of a tape: set-up, events, report."""
