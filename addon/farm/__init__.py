# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures by many machines: job.py writes a job's folder, the other files go into it. Nothing here needs Blender but in_blender.py, which a farm's Blender runs."""
