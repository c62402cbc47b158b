# SPDX-License-Identifier: GPL-3.0-or-later
"""The points of an E57 through pye57's libE57. Used by main.py. Imports nothing of the add-on."""

from __future__ import annotations

from typing import Any

import numpy as np


def run(path: str, order: dict[str, Any], channel: Any) -> None:
    """Answers each {"scan": index, "fields": names, "piece": points}: slots hold the fields one behind the other, as float64, which
    holds what any file declares; pye57's own way knows a few fields of certain types."""
    import pye57
    from pye57 import libe57
    file = pye57.E57(path)
    for wish in channel.orders():
        size, names = wish["piece"], wish["fields"]
        points = file.get_header(wish["scan"]).points
        data = [np.empty(size, np.float64) for _ in names]
        buffers = libe57.VectorSourceDestBuffer()
        for name, values in zip(names, data, strict=True):
            buffers.append(libe57.SourceDestBuffer(file.image_file, name, values, size, True, True))
        reader = points.reader(buffers)
        while count := reader.read():
            slot, memory = channel.slot()
            for index, values in enumerate(data):
                memory[8 * index * count:8 * (index + 1) * count] = values[:count].view(np.uint8).data
            channel.say({"slot": slot, "count": count})
        reader.close()
        channel.say({"end": True})
