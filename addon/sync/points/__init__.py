# SPDX-License-Identifier: GPL-3.0-or-later
"""Objects with points: what they hold, the files they link, and the clouds that are built of these."""
