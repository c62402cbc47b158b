# SPDX-License-Identifier: GPL-3.0-or-later
"""Looks in small files: reading, applying and writing them."""
