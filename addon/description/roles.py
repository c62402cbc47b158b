# SPDX-License-Identifier: GPL-3.0-or-later
"""Roles of objects in an image: drawn, cut out, or shown only by the shadows that they catch."""

SEEN, HOLDOUT, CATCHER = "", "holdout", "catcher"
