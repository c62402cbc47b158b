# SPDX-License-Identifier: GPL-3.0-or-later
"""Lights and the world."""
