# SPDX-License-Identifier: Apache-2.0
"""Tapes: codes, texts and punched rows, checks."""
