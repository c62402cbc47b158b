# SPDX-License-Identifier: GPL-3.0-or-later
"""The line by which build/matrix knows where tests ran: `setting: ` and JSON."""

import json
import platform

import bpy


def system():
    """The operating system and the machine, as in "Debian GNU/Linux 12 (bookworm), x86_64"."""
    try:
        name = platform.freedesktop_os_release()["PRETTY_NAME"]
    except OSError:
        name = f"{platform.system()} {platform.release()}"
    return f"{name}, {platform.machine()}"


def graphics():
    """Blender's backend and device; none in the background."""
    if bpy.app.background:
        return "none"
    import gpu
    names = {'OPENGL': "OpenGL", 'VULKAN': "Vulkan", 'METAL': "Metal"}
    backend = gpu.platform.backend_type_get() if hasattr(gpu.platform, "backend_type_get") else 'OPENGL'  # 3.4 and older
    return f"{names.get(backend, backend)}, {gpu.platform.renderer_get()}"


def say(what, part=(1, 1), whole=True):
    """what: which tests, in a few words. part: which one of how many suites. whole: False if the user has named tests; build/matrix leaves
    such runs out."""
    blender = f"{bpy.app.version_string}{'' if bpy.app.binary_path else ', Python module'}"
    print("setting:", json.dumps({"blender": blender, "graphics": graphics(), "system": system(), "run": what, "part": list(part),
                                  "whole": whole}), flush=True)
