# SPDX-License-Identifier: Apache-2.0
"""The gap oscilloscope: arm it over the link, read its record, write it as CSV or waveform."""
