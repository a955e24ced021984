# SPDX-License-Identifier: Apache-2.0
"""Machines to run a tape on, and the format of their files."""
