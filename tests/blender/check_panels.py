# SPDX-License-Identifier: GPL-3.0-or-later
"""What the artist sees of properties: each is in a panel, has a name and a tooltip, and is written as the others are."""

import re
import sys
from types import SimpleNamespace

import bpy
import numpy as np
import patina
from harness import REPOSITORY, add_points, check, new_scene
from patina.properties import heard

GROUPS = (bpy.types.Scene, bpy.types.Object, bpy.types.ViewLayer, bpy.types.World)
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


class Drawn:
    """A layout that writes down which properties it is given."""

    use_property_decorate = False

    def __init__(self):
        self.names = set()

    def row(self, **_):
        return self

    def label(self, **_):
        pass

    def prop(self, _group, name, **_):
        self.names.add(name)


def names_of_effects():
    """Properties in the panels of effects, which are made of the library's table; every item of a choice is tried."""
    found, effects = set(), bpy.context.scene.patina.effects
    for panel in patina.ui.effects.PANELS:
        choices = [field for field in panel.effect["fields"] if field["kind"] == "CHOICE"] or [None]
        for choice in choices:
            for item, *_ in choice["items"] if choice else [("",)]:
                if choice:
                    setattr(effects, choice["property"], item)
                drawn = Drawn()
                drawing = SimpleNamespace(layout=drawn, effect=panel.effect)
                panel.draw_header(drawing, bpy.context)
                panel.draw(drawing, bpy.context)
                found |= drawn.names
    return found


def test_every_property_is_in_a_panel():
    """A switch stands in the row of its number."""
    new_scene()
    source = "\n".join(path.read_text(encoding="utf-8") for path in (REPOSITORY / "addon/ui").glob("*.py"))
    effects = names_of_effects()
    for path, kind in properties():
        name = path.rpartition(".")[2]
        if path.startswith("Scene.patina.effects."):
            check(name in effects or f"use_{name}" in effects, f"{path} is in no panel")
            continue
        if kind.is_skip_save:
            name = name.removeprefix("use_")
        check(f'"{name}"' in source, f"{path} is in no panel")


def switches():
    """(group, number, switch) of every number whose zero is automatic, in a new scene."""
    scene = new_scene()
    for owner in (scene.patina, scene.patina.effects, scene.patina.lines, add_points([(0, 0, -4)]).patina):
        for name, kind in owner.bl_rna.properties.items():
            if kind.is_skip_save and name.startswith("use_"):
                yield owner, name.removeprefix("use_"), name


def test_automatic_is_a_box():
    """Zero is automatic, and -1 where zero is a number of the artist's; the box gives a number to begin with, and takes it; scripts see
    the number alone."""
    found = list(switches())
    check(len(found) >= 11, f"{[name for _, _, name in found]}")
    for group, number, box in found:
        kind = group.bl_rna.properties[number]
        automatic = -1 if number == "least_trust" else 0
        check(kind.default == automatic and not getattr(group, box), f"{number}: it begins as {kind.default}")
        setattr(group, box, True)
        value = getattr(group, number)
        check(value > 0 and getattr(group, box), f"{number}: ticked, it is {value}")
        setattr(group, number, kind.type == 'INT' and 7 or 0.5)
        setattr(group, box, True)
        check(getattr(group, number) == (kind.type == 'INT' and 7 or 0.5), f"{number}: ticked twice")
        setattr(group, box, False)
        check(getattr(group, number) == automatic and not getattr(group, box), f"{number}: {getattr(group, number)}")
    lines = bpy.context.scene.patina.lines
    lines.near, lines.far = 30.0, 20.0
    check(not lines.use_far, "not beyond Near is automatic")
    lines.use_far = True
    check(lines.far > 30.0, f"{lines.far}")


def test_no_tooltip_speaks_of_zero():
    """As automatic: what an artist sees says Automatic."""
    kinds = [kind for _, kind in properties()] + list(patina.preferences.PatinaPreferences.bl_rna.properties)
    found = [kind.description for kind in kinds if re.search(r"(^|[;.,] )0(: | follows| is automatic)", kind.description)
             and kind.subtype not in {'ANGLE'} and kind.identifier not in {"tint_strength"}]
    check(not found, f"{found}")


def test_tooltips_of_operators_are_whole():
    """Blender 3.4 cuts an operator's description after 239 bytes, without a sign."""
    found = [cls for cls in bpy.types.Operator.__subclasses__() if cls.__module__.startswith("patina.")]
    check(len(found) > 50, f"{len(found)} operators")
    long = [f"{cls.__name__}: {len(text)}" for cls in found if len(text := (cls.__doc__ or "").encode()) > 239]
    check(not long, f"{long}")


# ---- panels, drawn into a list -----------------------------------------------------------------------------------


class Row:
    """Stands for a UILayout: keeps (kind, owner, name, text) of what is drawn."""

    def __init__(self, drawn=None):
        object.__setattr__(self, "drawn", [] if drawn is None else drawn)
        object.__setattr__(self, "use_property_decorate", True)

    def __setattr__(self, name, value):
        check(name in bpy.types.UILayout.bl_rna.properties, f"layouts have no {name}")

    def __getattr__(self, kind):
        def call(*arguments, **options):
            named = bpy.types.UILayout.bl_rna.functions[kind].parameters
            check(set(options) <= set(named.keys()), f"{kind} takes no {set(options) - set(named.keys())}")
            owner = arguments[0] if kind.startswith(("prop", "template")) else None
            names = [item for item in arguments if isinstance(item, str)]
            text = options.get("text", options.get("heading", ""))
            if owner is not None and names:
                check(names[0] in owner.bl_rna.properties, f"{owner} has no {names[0]}")
                text = options.get("text", owner.bl_rna.properties[names[0]].name)
            self.drawn.append((kind, owner, names[0] if names else "", text))
            return type("Options", (), {})() if kind.startswith("operator") else Row(self.drawn)
        return call


class Drawing:
    """A panel that draws into another layout than Blender's for it."""

    def __init__(self, cls, layout):
        self.__dict__.update(cls=cls, layout=layout)

    def __getattr__(self, name):
        found = getattr(self.cls, name)
        return (lambda *arguments: found(self, *arguments)) if callable(found) and not hasattr(found, "__self__") else found


def context_of(obj=None, **more):
    scene = bpy.context.scene
    return SimpleNamespace(scene=scene, object=obj, engine=scene.render.engine, view_layer=bpy.context.view_layer, area=None,
                           region=None, material=None, light=None, camera=None, preferences=bpy.context.preferences,
                           window_manager=bpy.context.window_manager, **more)


def drawn_by(cls, context):
    """None where it does not show."""
    if not cls.poll(context):
        return None
    layout = Row()
    cls.draw(Drawing(cls, layout), context)
    return layout.drawn


def of_points(place):
    """The panels of a place that show for an object of points, and what they draw."""
    space, tab = place
    obj = add_points([(0, 0, -4)], np.full((1, 4), 128, np.uint8))
    found = {}
    for cls in panels():
        if cls.bl_space_type == space and getattr(cls, "bl_context", "") == tab:
            drawn = drawn_by(cls, context_of(obj))
            if drawn is not None:
                found[cls] = drawn
    return obj, found


def test_first_lines():
    """Color, opacity, lighting, radius and clip of the active points: in the sidebar, and in the object's own tab."""
    for place in (('VIEW_3D', ""), ('PROPERTIES', "object")):
        new_scene()
        obj, found = of_points(place)
        lines = [drawn for cls, drawn in found.items() if cls.bl_label == "Points"]
        check(len(lines) == 1, f"{place}: {[cls.__name__ for cls in found]}")
        names = [name for kind, owner, name, _ in lines[0] if owner is not None]
        check(names == ["opacity", "lighting", "use_radius", "use_least_trust", "use_clips"], f"{place}: {names}")
        obj.patina.use_radius = True
        obj.patina.colors.source = 'HEIGHT'
        _, found = of_points(place)
        panel = next(cls for cls in found if cls.bl_label == "Points")
        names = [name for _, owner, name, _ in drawn_by(panel, context_of(obj)) if owner is not None]
        check(names == ["ramp", "opacity", "lighting", "use_radius", "radius", "radius", "use_least_trust", "use_clips"], f"{place}: {names}")


def test_first_lines_offer_light():
    """Lit points that no light reaches: both panels say so, above a button that adds one. With its light, the two lines are gone."""
    scene = new_scene()
    scene.world = None
    obj = add_points([(0, 0, -4)])
    button = ("operator", "scene.patina_add_light", "")

    def offers(place):
        """Whether the sentence, in one line or broken, stands right above the button."""
        panel = next(cls for cls in panels() if cls.bl_label == "Points" and (cls.bl_space_type, getattr(cls, "bl_context", "")) == place)
        lines = [(kind, name, text) for kind, owner, name, text in drawn_by(panel, context_of(obj)) if kind in {"label", "operator"}]
        above = lines[:lines.index(button)] if button in lines else []
        return " ".join(text for kind, _, text in above if kind == "label").endswith("No light reaches this cloud")

    places = (('VIEW_3D', ""), ('PROPERTIES', "object"))
    for lighting, wanted in (('UNLIT', False), ('LIT', True)):
        obj.patina.lighting = lighting
        check([offers(place) for place in places] == [wanted] * 2, f"{lighting}: {[offers(place) for place in places]}")
    check(bpy.ops.scene.patina_add_light() == {'FINISHED'}, "the button")
    check(not any(offers(place) for place in places), "with a light")


def test_first_lines_are_of_points():
    """A mesh with faces has none in the sidebar, a lamp neither; one whose modifiers may make points has."""
    scene = new_scene()
    panel = bpy.types.PATINA_PT_sidebar_points
    mesh = bpy.data.meshes.new("faces")
    mesh.from_pydata([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [], [(0, 1, 2)])
    obj = bpy.data.objects.new("faces", mesh)
    check(not panel.poll(context_of(obj)) and not panel.poll(context_of(scene.camera)) and not panel.poll(context_of(None)), "polls")
    obj.modifiers.new("points", 'NODES')
    check(panel.poll(context_of(obj)), "modifiers")
    scene.render.engine = 'BLENDER_WORKBENCH'
    check(not panel.poll(context_of(add_points([(0, 0, 0)]))), "another engine")


def test_one_color():
    """Among the data's panels one is called Color, and one label in all of them."""
    new_scene()
    obj, found = of_points(('PROPERTIES', "data"))
    check([cls.bl_label for cls in found if "color" in cls.bl_label.lower()] == ["Color"], f"{found.keys()}")
    for source in ('OWN', 'FIXED', 'SCALAR', 'HEIGHT'):
        obj.patina.colors.source = source
        texts = [text for cls in found for _, owner, _, text in drawn_by(cls, context_of(obj)) if owner is not None]
        check(texts.count("Color") == (source == 'FIXED') and "Colors" not in texts, f"{source}: {texts}")


def test_objects_show_nothing_of_the_scene():
    new_scene()
    for tab in ("data", "object"):
        _, found = of_points(('PROPERTIES', tab))
        for cls, drawn in found.items():
            own = [name for _, owner, name, _ in drawn if isinstance(getattr(owner, "id_data", None), bpy.types.Scene)]
            check(not own, f"{cls.__name__} shows {own}")


def test_combine_has_a_panel():
    """It offers what can be done, then says which scene is which, in both, and goes over."""
    scene = new_scene()
    add_points([(0, 0, -4)])
    panel = bpy.types.PATINA_PT_combine

    def operators():
        return [name for kind, _, name, _ in drawn_by(panel, context_of()) if kind.startswith("operator")]

    check(operators() == ["scene.patina_combine"], f"{operators()}")
    surface = drawn_by(bpy.types.PATINA_PT_surface, context_of())
    check(not any(name == "scene.patina_combine" for _, _, name, _ in surface), "it is in Surface too")
    points = scene.copy()
    points[patina.sync.view.pairs.MARK] = scene
    scene.render.engine = 'BLENDER_WORKBENCH'
    try:
        check(operators() == ["scene.patina_other"], f"{operators()}")
        bpy.ops.scene.patina_other()
        check(bpy.context.scene == points and operators() == ["scene.patina_other"], bpy.context.scene.name)
        bpy.ops.scene.patina_other()
        check(bpy.context.scene == scene, "back")
    finally:
        bpy.data.scenes.remove(points)
    check(drawn_by(panel, context_of()) is None, "of another engine, with nothing combined")


def test_material_tab_shows_base_color():
    new_scene()
    material = bpy.data.materials.new("paint")
    panel = bpy.types.PATINA_PT_material
    shown = {cls.__name__ for cls in bpy.types.Panel.__subclasses__() if 'PATINA' in getattr(cls, "COMPAT_ENGINES", ())}
    check("EEVEE_MATERIAL_PT_context_material" in shown, "slots")
    if bpy.app.version < (5, 0, 0):
        context = context_of()
        context.material = material
        check([name for _, _, name, _ in drawn_by(panel, context)] == ["diffuse_color"], "without nodes")
        material.use_nodes = True
    context = context_of()
    context.material = material
    check([kind for kind, *_ in drawn_by(panel, context)] == ["template_node_view"], "with nodes")
    context.material = None
    check(drawn_by(panel, context) is None, "without a material")
    bpy.data.materials.remove(material)


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
        shown = path == "Object.patina.linked_file"  # says what linked_data holds, which is overridable
        check(kind.is_overridable or shown or ".style." in path or path.startswith("ViewLayer.patina.use_pass"), path)


def test_properties_are_heard():
    """Each tells what shows it where a script sets it: their modules take Blender's kinds from `heard`, and none past it."""
    kinds = {name: getattr(bpy.props, name) for name in vars(heard) if name.endswith("Property")}
    modules = [module for name, module in sys.modules.items() if name.startswith("patina.properties.") and module is not heard]
    check(len(kinds) == 8 and len(modules) > 8, f"{kinds}, {modules}")
    for module in [*modules, sys.modules["patina.properties"]]:
        for name, kind in kinds.items():
            check(getattr(module, name, None) is not kind, f"{module.__name__} takes {name} from Blender")


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
    check(len(shipped) == 6, f"{shipped}")
    for path in shipped:
        settings = new_scene().patina
        settings.error_target, settings.quality, settings.fill, settings.fill_iterations = 50.0, 'PAPER', 'OFF', 9
        settings.antialias, settings.samples, settings.average = 'OFF', 77, True
        lines = [line.split(" = ")[0] for line in path.read_text().splitlines() if line.startswith("patina.")]
        check(lines == [f"patina.{name}" for name in names], f"{path.name} sets {lines}")
        bpy.ops.script.execute_preset(filepath=str(path), menu_idname="PATINA_PT_presets")
        found = {name: getattr(settings, name) for name in names}
        if path.stem == "Standard":
            wanted = {name: settings.bl_rna.properties[name].default for name in names}
            check(found == wanted, f"{found} is not {wanted}")
        if path.stem == "Final":
            check(found["samples"] == 16 and found["quality"] == 'REFINED' and not found["average"], f"{found}")
        if path.stem == "Animation":
            check(found["samples"] == 16 and found["average"], f"{found}")


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


def test_devices_have_names_for_people():
    """As drivers and processors name themselves."""
    from patina import native
    for name, description, hardware, wanted in (
            ("cpu-avx512", "AMD EPYC 9654 96-Core Processor", False, "Processor (AVX-512)"),
            ("cpu-scalar", "", False, "Processor (Plain)"), ("cpu-neon", "", False, "Processor (NEON)"),
            ("gl-egl", "NVIDIA H100 PCIe/PCIe/SSE2, OpenGL 4.6.0 NVIDIA 535.1", True, "NVIDIA H100 PCIe"),
            ("gl-egl", "Mesa Intel(R) UHD Graphics 620 (KBL GT2), OpenGL 4.6 (Core Profile) Mesa 22.3.6", True, "Intel UHD Graphics 620"),
            ("gl-egl", "AMD Radeon RX 6800 XT (navi21, LLVM 15.0.6, DRM 3.49), OpenGL 4.6", True, "AMD Radeon RX 6800 XT"),
            ("gl-osmesa", "llvmpipe (LLVM 15.0.6, 256 bits), OpenGL 4.5", False, "llvmpipe (OpenGL in Software)"),
            ("gl-egl", "", True, "OpenGL")):
        found = native.devices.label(name, description, hardware)
        check(found == wanted, f"{description}: '{found}'")
    with_device = native.Device("cpu")
    check(with_device.label.startswith("Processor ("), with_device.label)
    with_device.close()
