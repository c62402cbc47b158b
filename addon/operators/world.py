# SPDX-License-Identifier: GPL-3.0-or-later
"""Bake World: a picture of the world all around, rendered by Cycles, that stands for nodes which Patina does not know."""

from __future__ import annotations

from pathlib import Path

import bpy
from bpy.props import IntProperty
from bpy.types import Context, Operator
from mathutils import Matrix

# A camera that looks along +x, z up: then its picture is laid out as an environment texture.
_ALONG_X = Matrix(((0, 0, -1, 0), (-1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 0, 1)))


class PATINA_OT_bake_world(Operator):
    """Render the world with Cycles once, and use that image in place of its nodes"""

    bl_idname = "world.patina_bake"
    bl_label = "Bake World"
    bl_options = {'REGISTER', 'UNDO'}

    width: IntProperty(
        name="Width", default=2048, min=64, max=16384, subtype='PIXEL',
        description="Width of the image. Its height is half of that")
    samples: IntProperty(name="Samples", default=16, min=1, soft_max=256, description="Samples per pixel")

    @classmethod
    def poll(cls, context: Context) -> bool:
        return context.scene.world is not None

    def execute(self, context: Context) -> set[str]:
        world = context.scene.world
        scene = bpy.data.scenes.new("Patina Bake World")
        camera = bpy.data.cameras.new("Patina Bake World")
        eye = bpy.data.objects.new("Patina Bake World", camera)
        try:
            import tempfile
            with tempfile.TemporaryDirectory() as folder:
                path = Path(folder) / "world.exr"
                self._render(scene, eye, world, path)
                image = bpy.data.images.load(str(path))
                image.pack()
        except (TypeError, RuntimeError) as error:
            why = "Cycles is switched off, see Preferences > Add-ons" if isinstance(error, TypeError) else error
            self.report({'ERROR'}, f"Patina: {why}")
            return {'CANCELLED'}
        finally:
            bpy.data.objects.remove(eye)
            bpy.data.cameras.remove(camera)
            bpy.data.scenes.remove(scene)
        image.name = f"{world.name} all around"
        image.filepath_raw = ""
        before, world.patina.picture = world.patina.picture, image
        world.patina.use_picture = True
        if before and before.packed_file and not before.users:
            bpy.data.images.remove(before)
        self.report({'INFO'}, f"Baked the nodes of world '{world.name}' to image '{image.name}'. Bake again after editing them")
        return {'FINISHED'}

    def _render(self, scene: bpy.types.Scene, eye: bpy.types.Object, world: bpy.types.World, path: Path) -> None:
        scene.collection.objects.link(eye)
        scene.camera, scene.world = eye, world
        eye.matrix_world = _ALONG_X
        scene.render.engine = 'CYCLES'
        eye.data.type = 'PANO'
        panorama = eye.data if hasattr(eye.data, "panorama_type") else eye.data.cycles
        panorama.panorama_type = 'EQUIRECTANGULAR'
        render = scene.render
        render.resolution_x, render.resolution_y, render.resolution_percentage = self.width, self.width // 2, 100
        render.film_transparent = False
        scene.cycles.samples, scene.cycles.use_denoising, scene.cycles.use_adaptive_sampling = self.samples, False, False
        scene.cycles.pixel_filter_type = 'BOX'
        settings = render.image_settings
        settings.file_format, settings.color_mode, settings.color_depth = 'OPEN_EXR', 'RGB', '32'
        bpy.ops.render.render(scene=scene.name)
        bpy.data.images['Render Result'].save_render(str(path), scene=scene)


register, unregister = bpy.utils.register_classes_factory((PATINA_OT_bake_world,))
