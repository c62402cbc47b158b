# SPDX-License-Identifier: GPL-3.0-or-later
"""What draws with the library and with Blender's graphics: the engine, the final render, the viewport, passes and overlays."""
