# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes, materials, images, and the roles of objects in an image."""
