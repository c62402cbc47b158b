# SPDX-License-Identifier: GPL-3.0-or-later
"""Files to arrays, without bpy: importers, and the processes that unpack and stream points."""
