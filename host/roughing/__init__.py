# SPDX-License-Identifier: Apache-2.0
"""Planning of roughing: basic data, networks, staircase, program."""
