# SPDX-License-Identifier: GPL-3.0-or-later
"""Camera, settings, effects and clips of an image, and the two scenes of Combine by Depth."""
