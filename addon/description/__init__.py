# SPDX-License-Identifier: GPL-3.0-or-later
"""What images are made of, as dataclasses whose fields are those of the library's descriptors. Does not import bpy."""
