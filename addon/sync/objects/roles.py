# SPDX-License-Identifier: GPL-3.0-or-later
"""What objects are in a picture beside being seen: holdouts, shadow catchers; and what Patina does not know of such things."""

from __future__ import annotations

from collections.abc import Iterable

import bpy

from ...description.roles import CATCHER, HOLDOUT, SEEN


def are_used(depsgraph: bpy.types.Depsgraph) -> bool:
    """Whether any object may have a role."""
    return (any(obj.is_holdout or obj.is_shadow_catcher for obj in depsgraph.objects)
            or _holds_out(depsgraph.view_layer_eval.layer_collection))


def _holds_out(collection: bpy.types.LayerCollection) -> bool:
    return collection.holdout or any(map(_holds_out, collection.children))


def role_of(instance: bpy.types.DepsgraphObjectInstance, layer: bpy.types.ViewLayer) -> str:
    """Of the object, of the one that instances it, or of the collection that this lies in."""
    obj, base = instance.object, _base(instance)
    if obj.is_holdout or base.is_holdout or base.holdout_get(view_layer=layer):
        return HOLDOUT
    return CATCHER if obj.is_shadow_catcher or base.is_shadow_catcher else SEEN


class Unknown:
    """Gathers what is asked for in vain; each kind is told once."""

    def __init__(self, layer: bpy.types.ViewLayer) -> None:
        self._layer = layer
        self._indirect: dict[str, None] = {}
        self._linking: dict[str, None] = {}

    def look(self, instance: bpy.types.DepsgraphObjectInstance) -> None:
        obj, base = instance.object, _base(instance)
        if base.indirect_only_get(view_layer=self._layer):
            self._indirect[base.name] = None
        if _links_light(obj) or _links_light(base):
            self._linking[base.name] = None

    def look_at_light(self, instance: bpy.types.DepsgraphObjectInstance) -> None:
        if _links_light(instance.object) or _links_light(_base(instance)):
            self._linking[_base(instance).name] = None

    def notices(self) -> list[str]:
        found = []
        if self._layer.material_override:
            found.append(f"the view layer's material override '{self._layer.material_override.name}' is not drawn")
        if self._indirect:
            found.append(f"Indirect Only is not known to Patina, seen as others are: {_names(self._indirect)}")
        if self._linking:
            found.append(f"light linking is not known to Patina, every light reaches everything: {_names(self._linking)}")
        return found


def _base(instance: bpy.types.DepsgraphObjectInstance) -> bpy.types.Object:
    return instance.parent if instance.is_instance else instance.object


def _links_light(obj: bpy.types.Object) -> bool:
    linking = getattr(obj, "light_linking", None)  # from Blender 4.0 on
    return linking is not None and bool(linking.receiver_collection or linking.blocker_collection)


def _names(names: Iterable[str]) -> str:
    first, more = list(names)[:3], len(list(names)) - 3
    return ", ".join(f"'{name}'" for name in first) + (f" and {more} more" if more > 0 else "")
