# SPDX-License-Identifier: GPL-3.0-or-later
"""What the viewport needs of Blender's own graphics, and the message if this backend or driver lacks it."""

from __future__ import annotations

from collections.abc import Callable

import bpy
import gpu
import numpy as np

_NAMES = {'OPENGL': "OpenGL", 'VULKAN': "Vulkan", 'METAL': "Metal"}


class GraphicsError(Exception):
    """Blender's graphics cannot draw what the viewport needs. The text is for the artist."""


def name() -> str:
    """Blender's backend and device, as in "Vulkan, llvmpipe"."""
    if bpy.app.background and not hasattr(gpu, "init"):
        return "none"
    backend = gpu.platform.backend_type_get() if hasattr(gpu.platform, "backend_type_get") else 'OPENGL'  # 3.5 and later tell
    return f"{_NAMES.get(backend, backend)}, {gpu.platform.renderer_get()}"


def _lacks(error: Exception) -> GraphicsError:
    return GraphicsError(f"Blender's graphics ({name()}) cannot draw Patina's image in the viewport: {error}. Renders (F12) work. Update the "
                         "driver, or choose another backend in Preferences > System")


def texture(pixels: np.ndarray, kind: str) -> gpu.types.GPUTexture:
    """Of (height, width, channels) pixels. kind: Blender's format. Raises GraphicsError."""
    height, width = pixels.shape[:2]
    flat = np.ascontiguousarray(pixels, np.float32).reshape(-1)
    try:
        return gpu.types.GPUTexture((width, height), format=kind, data=gpu.types.Buffer('FLOAT', flat.size, flat))
    except Exception as error:  # of whatever type: it differs between backends
        raise _lacks(error) from error


class Shaders:
    """Compiles each shader once. One that failed is not compiled again with each redraw."""

    def __init__(self) -> None:
        self._known: dict[str, gpu.types.GPUShader | str] = {}  # a text: why there is none

    def get(self, kind: str, create: Callable[[], gpu.types.GPUShader]) -> gpu.types.GPUShader:
        """Raises GraphicsError."""
        if kind not in self._known:
            try:
                self._known[kind] = create()
            except Exception as error:
                self._known[kind] = str(_lacks(error))  # an exception that is kept would keep the engine that drew
        found = self._known[kind]
        if isinstance(found, str):
            raise GraphicsError(found)
        return found

    def forget(self) -> None:
        self._known.clear()
