# SPDX-License-Identifier: Apache-2.0
"""The host program on the PC."""
