# SPDX-License-Identifier: GPL-3.0-or-later
"""What is found about points: analyses, trust, scans, and the estimates of the last image."""
