# SPDX-License-Identifier: GPL-3.0-or-later
"""Points of evaluated objects → clouds in the library, built once and kept while their content stays."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import bpy

from ... import native, point_data
from ...description.meshes import MeshItem
from ...description.points import CloudItem
from ...native.abi import LIGHTING
from .. import losses
from ..analyses import analysis, estimates
from ..objects import images, meshes, roles
from ..view import clips, pairs
from . import attributes, edits, linked, node_colors, ranges, soft
from .built import CACHE, Pending
from .content import attribute_names, identity_of, radius_name
from .style import mesh_style, style_of
from .taking import Soon, Take


def collect(depsgraph: bpy.types.Depsgraph, take: Take, notices: list[str],
            visible: Callable[[bpy.types.DepsgraphObjectInstance], bool] = lambda instance: True,
            frame: int | None = None, settle: Callable[[], None] = lambda: None,
            trusting: bool = False) -> list[CloudItem | MeshItem]:
    """Every visible cloud and mesh, instances too. Iterates the depsgraph only; keeps no reference into it. frame: whose
    files sequences show; None: of the scene's. settle: builds what take left for later. trusting: images are as they were unless
    Blender said that they changed."""
    items: list[CloudItem | MeshItem] = []
    taken: dict[tuple, native.Cloud | Pending | meshes.Faces | None] = {}  # by place in memory: it holds while the depsgraph does
    identities: dict[tuple, tuple] = {}  # by place
    used: set[tuple] = set()  # of them
    faces: set[str] = set()
    triangles = meshes.BARE if roles.are_used(depsgraph) or _wants_mattes(depsgraph.view_layer_eval) else meshes.TRIANGLES
    unknown = roles.Unknown(depsgraph.view_layer_eval)
    scales: list[tuple[str, float, native.Cloud | Pending]] = []
    for instance in depsgraph.object_instances:
        obj = instance.object
        if obj.type == 'LIGHT' and instance.show_self:
            unknown.look_at_light(instance)
        if not point_data.may_have_points(obj) or not instance.show_self or not obj.visible_camera or clips.cuts(obj):
            continue
        if not visible(instance) or not losses.is_placed(instance, notices):
            continue
        attributes.finish_edits(obj)
        solid = obj.type == 'MESH' and len(obj.data.polygons) > 0 and not obj.patina.linked_file
        if solid and depsgraph.scene_eval.patina.meshes == 'OFF':
            faces.add(obj.name)
            continue
        link = None
        patina = depsgraph.scene_eval.patina
        analyzed = not ranges.spare_analysis(obj, patina.surface, depsgraph.view_layer_eval)
        if obj.patina.linked_file:
            link = linked.source_of(obj, depsgraph.scene_eval.frame_current if frame is None else frame, notices, analyzed)
            if link is None:
                continue
            if obj.patina.colors.source == 'MATERIAL':
                notices.append(f"'{obj.name}': its file is linked, so it keeps the colors of the file. Import it to color it by a material.")
        role = roles.role_of(instance, depsgraph.view_layer_eval)
        faces_as = 0 if not solid else triangles if patina.meshes == 'TRIANGLES' else patina.mesh_points
        radius = radius_name(obj, patina.surface)
        place = link.identity() if link else (obj.data.as_pointer(), radius, faces_as, *attribute_names(obj), analysis.wanted(obj))
        place = (*place, *meshes.names_of(obj)) if solid else place
        if place not in identities:
            identities[place] = place if link else identity_of(obj, used, radius, faces_as)
            used.add(identities[place])
        if (place, analyzed) not in taken:
            taken[place, analyzed] = take(obj, identities[place], link, analyzed)
        cloud = taken[place, analyzed]
        unknown.look(instance)
        if isinstance(cloud, meshes.Faces):
            notices += [text for text in cloud.notices if text not in notices]
            for part in cloud.parts:
                use = part.surface.use
                texture = images.CACHE.obtain(use, notices, trusting) if use else None
                style = mesh_style(obj, instance.matrix_world, part.surface)
                items.append(MeshItem(part.mesh, style, obj.pass_index, role, *_names(obj), texture))
        elif cloud:
            style = style_of(obj, instance.matrix_world)
            if solid and obj.patina.lighting == 'AUTO':  # its colours are a material's, not a photograph's
                style = replace(style, lighting=LIGHTING["LIT"])
            elif obj.patina.lighting == 'AUTO' and node_colors.used(obj):
                style = replace(style, lighting=LIGHTING["UNLIT" if node_colors.is_emission(obj) else "LIT"])
            edited = edits.state_of(obj)
            softened = soft.soft_of(obj, instance.matrix_world, depsgraph.scene_eval)
            told = ranges.told_of(obj, patina.surface)
            dotted = obj.type == 'MESH' and not solid and not link
            own_depth = solid or obj.type == 'POINTCLOUD' and not link and point_data.shows_spheres(obj)
            items.append(CloudItem(cloud, style, obj.pass_index, role, *_names(obj), edited, softened, dotted, own_depth, told, analyzed))
            scales.append((obj.original.name_full, max(map(abs, instance.matrix_world.to_scale())), cloud))
    settle()
    items = [replace(item, cloud=item.cloud.built) if isinstance(item, CloudItem) and isinstance(item.cloud, Soon) else item
             for item in items]
    CACHE.trim(used)
    meshes.CACHE.trim(used)
    images.CACHE.trim()
    notices += filter(None, [edits.notice(item.name, item.edits, item.cloud) for item in items
                             if isinstance(item, CloudItem) and item.edits and isinstance(item.cloud, native.Cloud)])
    notices += [f"'{item.name}' has no {missing} to be {'hidden' if item.soft.hides else 'soft'} by" for item in items if isinstance(item, CloudItem) and item.soft and
                isinstance(item.cloud, native.Cloud) and (missing := item.soft.missing(item.cloud))]
    told = [(name, scale, built) for name, scale, cloud in scales if (built := cloud.built if isinstance(cloud, Pending) else cloud)]
    estimates.keep({name: built.layer_distance * scale for name, scale, built in told}, {name: built.spacing * scale for name, scale, built in told})
    notices += unknown.notices()
    if not items:
        notices.append(losses.Loss("no visible object has points to draw"))
    if faces and not pairs.first_of(depsgraph.scene):  # else they are drawn by the other scene
        notices.append(f"{len(faces)} mesh object{'s' * (len(faces) > 1)} with faces not drawn: "
                       "Render Properties > Surface > Meshes draws them")
    return items


def _wants_mattes(layer: bpy.types.ViewLayer) -> bool:
    return layer.use_pass_cryptomatte_object or layer.use_pass_cryptomatte_asset


def _names(obj: bpy.types.Object) -> tuple[str, str]:
    """By which Cryptomatte knows an object, and what it is a part of."""
    top = obj
    while top.parent:
        top = top.parent
    return obj.name, top.name
