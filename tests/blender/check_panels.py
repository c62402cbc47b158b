# SPDX-License-Identifier: GPL-3.0-or-later
"""What the artist sees of properties: each is in a panel, has a name and a tooltip, and is written as the others are."""

import re

import bpy
from harness import REPOSITORY, check, new_scene

import patina

GROUPS = (bpy.types.Scene, bpy.types.Object, bpy.types.ViewLayer)
SMALL = {"a", "an", "and", "as", "at", "by", "for", "from", "in", "of", "on", "or", "per", "the", "to", "with"}


def properties():
    """(path, definition) of every property that is Patina's and not hidden."""
    def walk(group, path):
        for name, kind in group.properties.items():
            if name in {"rna_type", "name"} or kind.is_hidden:
                continue
            if kind.type == 'POINTER' and kind.fixed_type.identifier.startswith("Patina"):
                yield from walk(kind.fixed_type, f"{path}.{name}")
            else:
                yield f"{path}.{name}", kind

    for owner in GROUPS:
        yield from walk(owner.bl_rna.properties["patina"].fixed_type, f"{owner.__name__}.patina")


def panels():
    return [cls for cls in bpy.types.Panel.__subclasses__() if cls.__module__.startswith("patina.")]


def test_there_are_many():
    check(len(list(properties())) > 40 and len(panels()) > 10, f"{len(list(properties()))}, {len(panels())}")


def test_every_property_is_in_a_panel():
    source = "\n".join(path.read_text(encoding="utf-8") for path in (REPOSITORY / "addon/ui").glob("*.py"))
    for path, _ in properties():
        name = path.rpartition(".")[2]
        check(f'"{name}"' in source, f"{path} is in no panel")


def test_names():
    for path, kind in properties():
        words = kind.name.split()
        check(words and words[0][0].isupper(), f"{path}: '{kind.name}'")
        for word in words[1:]:
            check(word[0].isupper() or word in SMALL or not word[0].isalpha(), f"{path}: '{kind.name}' has '{word}'")


def test_tooltips():
    """Blender ends them with a full stop of its own."""
    for path, kind in properties():
        text = kind.description
        check(len(text) > 10 and text[0].isupper() and not text.endswith((".", " ")), f"{path}: '{text}'")
        check(text != kind.name, path)


def test_items():
    for path, kind in properties():
        if kind.type != 'ENUM' or path.endswith("style.chosen"):
            continue
        for item in kind.enum_items:
            check(re.fullmatch("[A-Z0-9_]+", item.identifier), f"{path}: {item.identifier}")
            check(len(item.description) > 3 and not item.description.endswith("."), f"{path}: {item.identifier}: "
                                                                                    f"'{item.description}'")
        numbers = [item.value for item in kind.enum_items]
        check(len(set(numbers)) == len(numbers), f"{path}: {numbers}")


def test_limits():
    """Numbers that the library limits say so, and what a slider shows is within."""
    for path, kind in properties():
        if kind.type in {'INT', 'FLOAT'}:
            check(kind.hard_min <= kind.soft_min <= kind.soft_max <= kind.hard_max, f"{path}: limits")
            default = kind.default_array if kind.is_array else [kind.default]
            check(all(kind.hard_min <= value <= kind.hard_max for value in default), f"{path}: default")


def test_overridable():
    for path, kind in properties():
        check(kind.is_overridable or ".style." in path or path.startswith("ViewLayer.patina.use_pass"), path)


def test_labels():
    """Panels of one place differ in label, children have their parent, what has no own engine check is found out."""
    seen = set()
    known = {cls.__name__ for cls in panels()}
    for cls in panels():
        place = (cls.bl_space_type, cls.bl_region_type, getattr(cls, "bl_context", ""), getattr(cls, "bl_parent_id", ""),
                 cls.bl_label)
        check(place not in seen or cls.__name__ == "PATINA_PT_presets", f"two panels {place}")
        seen.add(place)
        check(getattr(cls, "bl_parent_id", "") in known | {""}, f"{cls.__name__} hangs from nothing")
        check(cls.__name__.startswith("PATINA_PT_"), cls.__name__)
    check(patina.bl_info["name"] == "Patina", "loaded")


def test_shipped_presets():
    """Each sets all that a preset holds, and nothing else; Standard is what a new scene has."""
    from patina.ui import presets
    names = [value.partition(".")[2] for value in presets.PATINA_OT_preset_add.preset_values]
    shipped = sorted(presets.SHIPPED.glob("*.py"))
    check(len(shipped) == 5, f"{shipped}")
    for path in shipped:
        settings = new_scene().patina
        settings.error_target, settings.quality, settings.fill, settings.fill_iterations = 50.0, 'PAPER', 'OFF', 9
        settings.antialias, settings.samples = 'OFF', 77
        lines = [line.split(" = ")[0] for line in path.read_text().splitlines() if line.startswith("patina.")]
        check(lines == [f"patina.{name}" for name in names], f"{path.name} sets {lines}")
        bpy.ops.script.execute_preset(filepath=str(path), menu_idname="PATINA_PT_presets")
        found = {name: getattr(settings, name) for name in names}
        if path.stem == "Standard":
            wanted = {name: settings.bl_rna.properties[name].default for name in names}
            check(found == wanted, f"{found} is not {wanted}")
        if path.stem == "Final":
            check(found["samples"] == 16 and found["quality"] == 'REFINED', f"{found}")


def test_american_spelling():
    """As Blender has it: names, tooltips, items of menus, labels of panels and operators."""
    british = re.compile(r"colour|metres?\b|neighbour|\bgrey|centre|analyse|organis|favour", re.I)
    found = []
    kinds = (bpy.types.PropertyGroup, bpy.types.Operator, bpy.types.AddonPreferences, bpy.types.Panel)
    for cls in (cls for kind in kinds for cls in kind.__subclasses__() if cls.__module__.startswith("patina.")):
        texts = [getattr(cls, "bl_label", ""), cls.bl_rna.description]
        for kind in cls.bl_rna.properties:
            texts += [kind.name, kind.description]
            if kind.type == 'ENUM':
                texts += [text for item in kind.enum_items for text in (item.name, item.description)]
        found += [f"{cls.__name__}: {text}" for text in texts if text and british.search(text)]
    check(not found, f"{len(found)}: {found[:3]}")
