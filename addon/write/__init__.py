# SPDX-License-Identifier: GPL-3.0-or-later
"""Arrays to files, without bpy."""
