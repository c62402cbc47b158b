# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads native/include/patina/effects.def, the table of effects, which says how it is to be read."""

from __future__ import annotations

import ast
import re
from pathlib import Path
from typing import Any

LIST = Path(__file__).resolve().parent.parent / "native/include/patina/effects.def"
KINDS = {"NUMBER": 1, "COUNT": 1, "COLOR": 3, "AXIS": 3, "SWITCH": 1, "CHOICE": 1}
PANELS = ("CUES", "DRAWING", "IMAGE", "CAMERA")
UNITS = ("NONE", "SHARE", "PIXELS", "LENGTH", "HEIGHT", "COLOR")


def _split(text: str) -> list[str]:
    """At commas that stand in no string and no brackets."""
    found, depth, quoted, start = [], 0, False, 0
    for i, letter in enumerate(text):
        quoted ^= letter == '"' and text[i - 1] != "\\"
        depth += 0 if quoted else (letter == "(") - (letter == ")")
        if letter == "," and not depth and not quoted:
            found.append(text[start:i])
            start = i + 1
    return [*found, text[start:]]


def _value(text: str) -> Any:
    """A string, a number, some of these in brackets; or a word."""
    text = text.strip()
    try:
        return ast.literal_eval(re.sub(r"(?<=\d)f$", "", text))
    except (ValueError, SyntaxError):
        return text


def _field(kind: str, values: list[Any]) -> dict[str, Any]:
    name, when = values[:2]
    field = {"name": name, "kind": kind, "property": name, "when": when, "label": values[-2], "about": values[-1]}
    if kind in ("NUMBER", "COUNT"):
        _, _, least, _, zero, unit, (start, low, usual, high), *_ = values
        return field | {"least": least, "zero": zero, "unit": unit, "start": start, "low": low, "usual": usual, "high": high}
    if kind == "COLOR":
        return field | {"zero": values[2], "unit": "COLOR", "start": values[3], "low": 0, "usual": 1, "high": values[4]}
    if kind == "SWITCH":
        return field | {"property": values[2]}
    return field | ({"items": []} if kind == "CHOICE" else {})


def _check(effect: dict[str, Any], option: str, values: str) -> None:
    """What C's macros take as it comes, and the command line would end by."""
    fields, where = [field["name"] for field in effect["fields"]], f"effects.def: {effect['name']}"
    if effect["panel"] not in PANELS:
        raise ValueError(f"{where}: panel {effect['panel']} is none of {', '.join(PANELS)}")
    for name in re.findall(r"(?<![\w.])[a-z]\w*", values):
        if name not in fields:
            raise ValueError(f"{where}: {option} takes {name}, which is none of its fields {', '.join(fields)}")
    for field in effect["fields"]:
        if field.get("unit", "NONE") not in UNITS:
            raise ValueError(f"{where}: {field['name']}: unit {field['unit']} is none of {', '.join(UNITS)}")


def read() -> list[dict[str, Any]]:
    """The project's table: see parse."""
    return parse(LIST.read_text(encoding="utf-8"))


def own() -> list[dict[str, Any]]:
    """Effects with a panel and properties of their own: all but those that take the camera's."""
    return [effect for effect in read() if effect["panel"] != "CAMERA"]


def parse(text: str) -> list[dict[str, Any]]:
    """Effects as they are listed: name, label, panel, about, fields: name, kind, property, when, label, about, and by their kind
    least, zero, unit, start, low, usual, high; items (name, label, about); automatic (start, about).

    Raises:
        ValueError: what is wrong with which row.
    """
    text = re.sub(r"^\s*(#|//).*$", "", text[text.rindex("#endif"):], flags=re.M)
    effects: list[dict[str, Any]] = []
    options: list[tuple[str, str]] = []
    for kind, row in re.findall(r"^PATINA_EFFECT(_\w+)?\((.*?)\)$", text, re.M | re.S):
        values = [_value(part) for part in _split(row)]
        fields = effects[-1]["fields"] if effects else []
        if not kind:
            name, label, panel, option, taken, *_, about = values
            options.append((option, taken))
            effects.append({"name": name, "label": label, "panel": panel, "about": about, "fields": []})
        elif kind[1:] in KINDS:
            fields.append(_field(kind[1:], values))
        elif kind == "_ITEM":
            fields[-1]["items"].append(tuple([values[0].split("_", 1)[1], *values[2:]]))
        elif kind == "_AUTOMATIC":
            next(field for field in fields if field["name"] == values[0])["automatic"] = tuple(values[1:])
        elif kind not in ("_RULE", "_GRID"):
            raise ValueError(f"effects.def: PATINA_EFFECT{kind} is not known")
    for effect, (option, taken) in zip(effects, options):
        _check(effect, option, taken)
    words = 1 + sum(3 if field["kind"] in ("COLOR", "AXIS") else 1 for effect in effects for field in effect["fields"])  # and exact
    if words % 2:
        raise ValueError(f"effects.def: {words} words would leave padding behind the last effect, where callers compiled with fewer "
                         "leave anything: give it one field more")
    return effects
