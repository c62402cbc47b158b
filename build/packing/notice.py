# SPDX-License-Identifier: GPL-3.0-or-later
"""NOTICE: whose code a package contains besides Patina's own, and under which terms."""
import re

from .common import ROOT

GLAD = ROOT / "native/device_gl/glad"


def text(version: str) -> str:
    source = (GLAD / "khrplatform.h").read_text(encoding="utf-8")
    terms = next(comment for comment in re.findall(r"/\*(.*?)\*/", source, re.S) if "Permission is hereby granted" in comment)
    khronos = "\n".join(line.strip().removeprefix("**").strip() for line in terms.strip().splitlines())
    return f"""Patina {version}
Copyright (C) the Patina authors. GPL-3.0-or-later, see LICENSE.

The library contains the output of glad 2.0.8, a generator of OpenGL loaders (https://glad.dav1d.de):

gl.c and gl.h: (WTFPL OR CC0-1.0) AND Apache-2.0. The last applies to what glad takes from the specifications of the Khronos
Group: https://www.apache.org/licenses/LICENSE-2.0

khrplatform.h:

{khronos}
"""
