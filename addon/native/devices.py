# SPDX-License-Identifier: GPL-3.0-or-later
"""Devices by their names for people."""

from __future__ import annotations

import re

_LEVELS = {"avx512": "AVX-512", "avx2": "AVX2", "sse42": "SSE4.2", "scalar": "Plain"}
_TRADE = re.compile(r"\((?:R|TM|tm|C)\)|®|™")


def label(name: str, description: str, hardware: bool) -> str:
    """"Processor (AVX-512)", "NVIDIA H100 PCIe", "llvmpipe (OpenGL in Software)". name, description: of patina_device_info, where
    OpenGL's are renderer and version."""
    kind, _, level = name.partition("-")
    if kind == "cpu":
        return f"Processor ({_LEVELS.get(level, level.upper())})" if level else "Processor"
    if kind != "gl":
        return name
    renderer = _TRADE.sub("", description.partition(", OpenGL ")[0])
    renderer = " ".join(re.split(r"/| \(", renderer)[0].removeprefix("Mesa ").split())  # what follows are busses and drivers
    return (renderer or "OpenGL") if hardware else f"{renderer or 'OpenGL'} (OpenGL in Software)"
