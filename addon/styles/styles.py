# SPDX-License-Identifier: GPL-3.0-or-later
"""Styles: looks in small files, one key a property.

    {
        "patina_style": 1,
        "name": "Blueprint",
        "about": "White lines on blue paper",
        "scene": {
            "studio.use_background": true,
            "studio.background": "#1d3f7a"
        },
        "points": {
            "lighting": "UNLIT"
        },
        "view": {
            "transform": "Standard"
        }
    }

Keys of "scene" are properties of Scene.patina, of "points" those of Object.patina, by their path in Python; those that
make up a look are listed below, and one that a file leaves out takes its default; those of soft points and of trust only
where the file has one of them, or the style before it had: what an artist has painted or chosen there stays. Angles are in degrees; colours linear
red, green, blue, or "#rrggbb" in sRGB. "view" is left as it is where the file has none. Lights, cameras and worlds are
never touched, nor is a property that is animated or driven. A picture of the same name, .png, is the file's thumbnail.
"""

from __future__ import annotations

import json
import stat
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from functools import lru_cache
from math import degrees
from pathlib import Path
from typing import Any

import bpy
import bpy.utils.previews
import numpy as np

from .. import point_data, whole

VERSION = 1
PLAIN = "scan"  # the style of defaults
SHIPPED = Path(__file__).resolve().parents[1] / "presets/styles"
LARGEST = 1 << 20  # bytes of a file

# What makes up a look; a group stands for all its properties.
SCENE = ("smooth", "use_shadows", "shadow_samples", "studio", "effects", "lines")
POINTS = ("lighting", "opacity", "color", "ambient", "diffuse", "specular", "shininess", "colors.source", "colors.ramp",
          "colors.exposure", "colors.contrast")
SOFT = tuple(f"soft.{name}" for name in ("use", "by", "attribute", "classes", "shape", "use_range", "range_min", "range_max", "invert", "hide",
                                         "threshold", "transition", "opacity"))
TRUST = ("least_trust",)
# What a style sets only if its file has one of it, or if the style before it had. That is noted in the property named behind it.
OPTIONAL = ((SOFT, "soft.styled"), (TRUST, "trust_styled"))


class StyleError(Exception):
    """A style that cannot be had; the text is for the artist."""


@dataclass(frozen=True)
class Entry:
    """A style's file."""

    key: str  # its name without the ending
    path: Path
    label: str
    about: str
    needs: tuple[str, ...] = ()  # data of points without which the style shows nothing of its own: "classes", "an analysis", ...

    @property
    def own(self) -> bool:
        """Whether it is the artist's."""
        return self.path.parent != SHIPPED

    @property
    def thumbnail(self) -> Path:
        return self.path.with_suffix(".png")


@dataclass(frozen=True)
class Style:
    """What a file says, checked. scene, points: property path → value as Blender takes it."""

    label: str
    about: str = ""
    scene: dict[str, Any] = field(default_factory=dict)
    points: dict[str, Any] = field(default_factory=dict)
    transform: str = ""  # view transform; empty: as it is
    unknown: tuple[str, ...] = ()  # keys that this Patina does not know


# ---- files -----------------------------------------------------------------------------------------------------


def own_folder(create: bool = False) -> Path:
    """The artist's styles, among Blender's user presets."""
    return Path(bpy.utils.user_resource('SCRIPTS', path="presets/patina/styles", create=create))


def entries() -> list[Entry]:
    """All styles, the plain one first; the artist's own replace shipped ones of the same key."""
    found = {path.stem: path for folder in (SHIPPED, own_folder()) for path in _files(folder)}
    listed = [_entry(path, path.stat().st_mtime_ns) for path in found.values()]
    return sorted(listed, key=lambda entry: (entry.key != PLAIN, entry.label.lower()))


def entry(key: str) -> Entry:
    """By the name of its file, else by the one that is shown, in letters of either case."""
    known = entries()
    for found in known:
        if found.key == key:
            return found
    for found in known:
        if found.label.lower() == key.strip().lower():
            return found
    raise StyleError(f"there is no style '{key}', only {', '.join(found.key for found in known)}")


def _files(folder: Path) -> list[Path]:
    try:
        return [path for path in folder.iterdir() if path.suffix == ".json"]
    except OSError:
        return []


@lru_cache(maxsize=256)
def _entry(path: Path, _changed: int) -> Entry:
    """A file that is no style is listed by its name, and says why when it is chosen."""
    try:
        found = _parse(path)
        return Entry(path.stem, path, _text(found.get("name")) or bpy.path.display_name(path.stem), _text(found.get("about"), 2000),
                     _needs(found.get("points")))
    except StyleError as error:
        return Entry(path.stem, path, path.stem, str(error))


def _needs(points: Any) -> tuple[str, ...]:
    """Data that the section "points" of a file relies on."""
    points = points if isinstance(points, dict) else {}
    by = points.get("soft.by") if points.get("soft.use") is True else None
    needs = {"classes": by == 'CLASSES', "a height above ground": by == 'ATTRIBUTE' and points.get("soft.attribute") == "height_above_ground",
             "an analysis": by == 'UNCERTAINTY' or points.get("colors.source") == 'TRUST'}
    return tuple(name for name, needed in needs.items() if needed)


def _text(value: Any, most: int = 100) -> str:
    """A text of a file as Blender shows it: on one line, without control characters, and not longer than an artist reads."""
    text = value if isinstance(value, str) else ""
    return "".join(letter if letter.isprintable() else " " for letter in text[:most]).strip()


def _shown(value: Any) -> str:
    """A value of a file in a message."""
    text = json.dumps(value)
    return text if len(text) <= 80 else f"{text[:80]}..."


def _parse(path: Path) -> dict[str, Any]:
    try:
        status = path.stat()
        if not stat.S_ISREG(status.st_mode):
            raise StyleError(f"{path.name} is a folder, device or pipe, not a file")
        if status.st_size > LARGEST:
            raise StyleError(f"{path.name} is larger than any style")
        found = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise StyleError(f"{path}: {error.strerror}") from None
    except UnicodeDecodeError:
        raise StyleError(f"{path.name} is no text in UTF-8") from None
    except (ValueError, RecursionError) as error:  # ValueError alone: a number of more digits than Python reads
        where = f", line {error.lineno}" if isinstance(error, json.JSONDecodeError) else ""
        raise StyleError(f"{path.name}{where}: no valid JSON") from None
    if not isinstance(found, dict) or "patina_style" not in found:
        raise StyleError(f"{path.name} is no style: it has no key 'patina_style'")
    if found["patina_style"] != VERSION:
        raise StyleError(f"{path.name} is a style of version {_shown(found['patina_style'])}, this Patina reads {VERSION}")
    return found


def read(path: Path) -> Style:
    """The style in a file. StyleError with the key that cannot be read, and why."""
    found = _parse(path)
    unknown = [key for key in found if key not in {"patina_style", "name", "about", "scene", "points", "view"}]
    values: dict[str, dict[str, Any]] = {}
    for section in ("scene", "points"):
        known = _known(section)
        values[section] = {}
        for key, raw in _section(path, found, section).items():
            if key not in known:
                unknown.append(f"{section}.{key}")
                continue
            try:
                values[section][key] = _from_file(known[key], raw)
            except ValueError as error:
                raise StyleError(f"{path.name}: {section}.{key} is {_shown(raw)}; {error} was expected") from None
    view = dict(_section(path, found, "view"))
    transform = view.pop("transform", "")
    if not isinstance(transform, str):
        raise StyleError(f"{path.name}: view.transform is {_shown(transform)}; a name was expected")
    unknown += [f"view.{key}" for key in view]
    unknown = [_shown(key)[1:-1] for key in unknown]
    return Style(_text(found.get("name")) or bpy.path.display_name(path.stem), _text(found.get("about"), 2000), values["scene"],
                 values["points"], _text(transform), tuple(unknown))


def _section(path: Path, found: dict[str, Any], name: str) -> dict[str, Any]:
    section = found.get(name, {})
    if not isinstance(section, dict):
        raise StyleError(f"{path.name}: '{name}' holds no keys")
    return section


def write(path: Path, style: Style) -> None:
    """StyleError when the file cannot be written."""
    lines = [f'    "patina_style": {VERSION}', f'    "name": {json.dumps(style.label, ensure_ascii=False)}']
    if style.about:
        lines.append(f'    "about": {json.dumps(style.about, ensure_ascii=False)}')
    view = {"transform": style.transform} if style.transform else {}
    for name, section in (("scene", style.scene), ("points", style.points), ("view", view)):
        if section:
            known = _known(name)
            keys = [f'        "{key}": {json.dumps(_to_file(known.get(key), value))}' for key, value in section.items()]
            lines.append(f'    "{name}": {{\n' + ",\n".join(keys) + "\n    }")
    try:
        whole.write(path, ("{\n" + ",\n".join(lines) + "\n}\n").encode())
    except OSError as error:
        raise StyleError(f"{path}: {error.strerror}") from None


# ---- properties ------------------------------------------------------------------------------------------------


def _properties(group: bpy.types.Struct, names: Iterable[str]) -> Iterator[tuple[str, bpy.types.Property]]:
    """Path and definition of properties of a group, those of groups within it too."""
    for name in names:
        name, _, rest = name.partition(".")
        found = group.properties[name]
        if rest:
            yield from ((f"{name}.{path}", item) for path, item in _properties(found.fixed_type, [rest]))
        elif found.type == 'POINTER':
            inner = [key for key, item in found.fixed_type.properties.items()
                     if key not in {"rna_type", "name"} and not item.is_skip_save]
            yield from ((f"{name}.{path}", item) for path, item in _properties(found.fixed_type, inner))
        else:
            yield name, found


def _known(section: str) -> dict[str, bpy.types.Property]:
    """What keys of a file's section stand for."""
    owners = {"scene": (bpy.types.Scene, SCENE), "points": (bpy.types.Object, POINTS + SOFT + TRUST)}
    if section not in owners:
        return {}
    kind, names = owners[section]
    return dict(_properties(kind.bl_rna.properties["patina"].fixed_type, names))


def _from_file(kind: bpy.types.Property, raw: Any) -> Any:
    """A value as Blender takes it. ValueError that says what was expected."""
    if kind.type == 'BOOLEAN':
        if not isinstance(raw, bool):
            raise ValueError("true or false")
        return raw
    if kind.type == 'ENUM':
        names = [item.identifier for item in kind.enum_items]
        if raw not in names:
            raise ValueError(f"one of {', '.join(names)}")
        return raw
    if kind.type == 'STRING':
        if not isinstance(raw, str):
            raise ValueError("a text")
        return raw
    if kind.subtype == 'COLOR' and isinstance(raw, str):
        raw = _hex_color(raw)
    if getattr(kind, "is_array", False):
        if not isinstance(raw, list) or len(raw) != kind.array_length:
            raise ValueError(f"{kind.array_length} numbers" + (' or "#rrggbb"' if kind.subtype == 'COLOR' else ""))
        return tuple(_number(kind, value) for value in raw)
    return _number(kind, raw)


def _number(kind: bpy.types.Property, raw: Any) -> float | int:
    turn = degrees(1.0) if kind.subtype == 'ANGLE' else 1.0
    low, high = kind.hard_min * turn, kind.hard_max * turn
    whole = kind.type == 'INT'
    if isinstance(raw, bool) or not isinstance(raw, int if whole else (int, float)) or \
            not low - 1e-5 <= raw <= high + 1e-5:  # NaN, too
        ends = f" from {low:g}" + (f" to {high:g}" if high < 2**31 - 1 else " on") if low > -2**31 else ""
        raise ValueError(f"a {'whole ' * whole}number{ends}")
    return raw if whole else float(np.float32(raw / turn))  # as Blender keeps it


def _hex_color(text: str) -> list[float]:
    digits = text[1:]
    if len(text) != 7 or text[0] != "#" or any(digit not in "0123456789abcdefABCDEF" for digit in digits):
        raise ValueError('3 numbers or "#rrggbb"')
    shares = [int(digits[i:i + 2], 16) / 255 for i in (0, 2, 4)]
    return [share / 12.92 if share <= 0.04045 else ((share + 0.055) / 1.055) ** 2.4 for share in shares]


def _to_file(kind: bpy.types.Property | None, value: Any) -> Any:
    """The shortest number that Blender's float32 takes back as it was."""
    if isinstance(value, (tuple, list)):
        return [_to_file(kind, item) for item in value]
    if isinstance(value, float):
        return float(str(np.float32(degrees(value) if kind and kind.subtype == 'ANGLE' else value)))
    return value


def _default(kind: bpy.types.Property) -> Any:
    return tuple(kind.default_array) if getattr(kind, "is_array", False) else kind.default


def _owner(group: bpy.types.PropertyGroup, path: str) -> tuple[bpy.types.PropertyGroup, str]:
    *inner, name = path.split(".")
    for part in inner:
        group = getattr(group, part)
    return group, name


# ---- applying and taking ------------------------------------------------------------------------------------------


def apply_to_scene(scene: bpy.types.Scene, key: str) -> list[str]:
    """Applies a style to a scene and to those of its objects that the scene's choice names. Returns what the artist should
    know; StyleError when nothing was changed."""
    style = read(entry(key).path)
    selected = scene.patina.style.objects == 'SELECTED'
    chosen = [obj for obj in scene.objects if point_data.is_cloud(obj) and obj.library is None and (not selected or obj.select_get())]
    return apply(style, scene, chosen)


def apply(style: Style, scene: bpy.types.Scene, objects: Iterable[bpy.types.Object]) -> list[str]:
    """Sets all properties of a look, to the style's values or else their defaults. Returns notices."""
    kept: list[str] = []
    _set(scene, SCENE, style.scene, kept)
    for obj in objects:
        _set_points(obj, style, kept)
    notices = []
    if style.unknown:
        notices.append(f"unknown keys ignored: {', '.join(style.unknown)}")
    if kept:
        notices.append(f"left to their animation: {', '.join(kept)}")
    if style.transform:
        try:
            scene.view_settings.view_transform, scene.view_settings.look = style.transform, 'None'
        except TypeError:
            notices.append(f"there is no view transform '{style.transform}' here")
    return notices


def dress(scene: bpy.types.Scene, obj: bpy.types.Object) -> None:
    """Gives a new object the look of the style that was chosen last, if there is one that can be read."""
    try:
        style = read(entry(scene.patina.style.applied).path)
    except StyleError:
        return
    _set_points(obj, style, [])


def _set_points(obj: bpy.types.Object, style: Style, kept: list[str]) -> None:
    names = POINTS
    for group, noted in OPTIONAL:
        says = any(path in group for path in style.points)
        owner, name = _owner(obj.patina, noted)
        names += group if says or getattr(owner, name) else ()
        setattr(owner, name, says)
    _set(obj, names, style.points, kept)


def _set(owner: bpy.types.ID, names: Iterable[str], values: dict[str, Any], kept: list[str]) -> None:
    moving = animated(owner)
    for path, kind in _properties(owner.patina.bl_rna, names):
        if f"patina.{path}" in moving:
            kept.append(f"{owner.name}: {path}")
            continue
        group, name = _owner(owner.patina, path)
        value = values.get(path, _default(kind))
        if _get(group, name) != value:
            setattr(group, name, value)


def _get(group: bpy.types.PropertyGroup, name: str) -> Any:
    value = getattr(group, name)
    return value if isinstance(value, (bool, int, float, str)) else tuple(value)


def animated(owner: bpy.types.ID) -> set[str]:
    """Paths of properties that curves or drivers set."""
    data = owner.animation_data
    if data is None:
        return set()
    pairs = [(data.action, getattr(data, "action_slot", None))]
    pairs += [(strip.action, getattr(strip, "action_slot", None)) for track in data.nla_tracks for strip in track.strips]
    curves = [curve for action, slot in pairs if action for curve in curves_in(action, slot)]
    return {curve.data_path for curve in (*curves, *data.drivers)}


def curves_in(action: bpy.types.Action, slot: Any) -> list[bpy.types.FCurve]:
    """The F-curves of an action; slot: that of the owner, from Blender 4.4 on."""
    if hasattr(action, "fcurves"):  # until Blender 4.5
        return list(action.fcurves)
    bags = [strip.channelbag(slot) for layer in action.layers for strip in layer.strips]
    return [curve for bag in bags if bag for curve in bag.fcurves]


def taken(label: str, scene: bpy.types.Scene, obj: bpy.types.Object | None) -> Style:
    """The look of a scene and of an object with points, as a style: what differs from the defaults."""
    names = POINTS
    if obj:
        names += (SOFT if obj.patina.soft.use else ()) + (TRUST if obj.patina.colors.source == 'TRUST' else ())
    return Style(label, scene=_differing(scene.patina, SCENE), points=_differing(obj.patina, names) if obj else {},
                 transform=scene.view_settings.view_transform)


def _differing(group: bpy.types.PropertyGroup, names: Iterable[str]) -> dict[str, Any]:
    found = {}
    for path, kind in _properties(group.bl_rna, names):
        value = _get(*_owner(group, path))
        if value != _default(kind):
            found[path] = value
    return found


# ---- thumbnails in menus ------------------------------------------------------------------------------------------

_previews: bpy.utils.previews.ImagePreviewCollection | None = None


def icon(entry: Entry) -> int:
    """Blender's number of the thumbnail; 0 without one."""
    global _previews
    try:
        changed = entry.thumbnail.stat().st_mtime_ns
    except OSError:
        return 0
    if _previews is None:
        _previews = bpy.utils.previews.new()
    name = f"{entry.thumbnail} {changed}"
    found = _previews.get(name) or _previews.load(name, str(entry.thumbnail), 'IMAGE')
    return found.icon_id


def forget_icons() -> None:
    global _previews
    if _previews is not None:
        bpy.utils.previews.remove(_previews)
        _previews = None
