# SPDX-License-Identifier: GPL-3.0-or-later
"""The render engine as Blender sees it: asks sync for the scene, render for the picture, passes to hand it over."""

from __future__ import annotations

import traceback
from pathlib import Path

import bpy

from . import native, passes, render, sync

BUILDING = 0.5  # share of the progress bar for reading the scene; the rest is the picture


class PatinaRenderEngine(bpy.types.RenderEngine):
    """Draws point clouds in image space."""

    bl_idname = "PATINA"
    bl_label = "Patina"
    bl_use_preview = False
    bl_use_postprocess = True
    bl_use_shading_nodes_custom = False
    bl_use_eevee_viewport = True  # Material Preview

    # No __init__: Blender 4.4+ demands *args and **kwargs there. No state on the instance either: instances come
    # and go with every render; what lasts is in sync.clouds.CACHE and render.device_for.

    def update_render_passes(self, scene: bpy.types.Scene | None = None,
                             renderlayer: bpy.types.ViewLayer | None = None) -> None:
        passes.register(self, scene, renderlayer)

    def render(self, depsgraph: bpy.types.Depsgraph) -> None:
        """Renders one view layer. Failures become messages, never exceptions; then nothing is written."""
        try:
            self._render(depsgraph)
        except native.PatinaCancelled:
            pass
        except (native.PatinaError, sync.CameraError) as error:
            self._fail(str(error))
        except Exception as error:  # a bug of ours must not reach Blender's console as a traceback
            where = traceback.extract_tb(error.__traceback__)[-1]
            self._fail(f"{type(error).__name__}: {error} ({Path(where.filename).name}:{where.lineno})")

    def _render(self, depsgraph: bpy.types.Depsgraph) -> None:
        layer = depsgraph.view_layer_eval
        view = sync.final_view(self.camera_override or depsgraph.scene_eval.camera, depsgraph)
        description = sync.describe(depsgraph, view, self._poll_reading)
        for notice in description.notices:
            self._tell('WARNING', notice)
        self._status("Rendering", BUILDING)
        picture = render.draw(description, {item.plane for item in passes.enabled(layer)}, self._poll_drawing)
        if picture.notice:
            self._tell('WARNING', picture.notice)
        passes.write(self, layer, description.camera, picture.planes)
        layers = picture.stats["layers"]
        self._status(f"{picture.stats['points']:,} points, {picture.stats['ms']:.1f} ms, {picture.device}" +
                     (f", {layers} layers" if layers > 1 else ""), 1.0)

    def _poll_reading(self, what: str, progress: float) -> bool:
        self._status(what, BUILDING * progress)
        return self._stopped()

    def _poll_drawing(self, progress: float) -> bool:
        self.update_progress(BUILDING + (1.0 - BUILDING) * progress)
        return self._stopped()

    def _stopped(self) -> bool:
        return self.test_break()

    def _status(self, text: str, progress: float) -> None:
        self.update_stats("", text)
        self.update_progress(progress)

    def _tell(self, kind: str, text: str) -> None:
        self.report({kind}, f"Patina: {text}")

    def _fail(self, text: str) -> None:
        self._tell('ERROR', text)
        if bpy.app.version < (4, 5, 0):  # later ones report it once more
            self.error_set(f"Patina: {text}")


def register() -> None:
    bpy.utils.register_class(PatinaRenderEngine)


def unregister() -> None:
    bpy.utils.unregister_class(PatinaRenderEngine)
