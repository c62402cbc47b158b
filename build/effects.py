# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads native/include/patina/effects.def, the table of effects, which says how it is to be read."""

from __future__ import annotations

import ast
import re
from pathlib import Path
from typing import Any

LIST = Path(__file__).resolve().parent.parent / "native/include/patina/effects.def"
KINDS = {"NUMBER": 1, "COUNT": 1, "COLOR": 3, "AXIS": 3, "SWITCH": 1, "CHOICE": 1}


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


def read() -> list[dict[str, Any]]:
    """Effects as they are listed: name, label, panel, about, fields: name, kind, property, when, label, about, and by their kind
    least, zero, unit, start, low, usual, high; items (name, label, about); automatic (start, about).

    Raises:
        ValueError: what a row is not known for.
    """
    text = LIST.read_text(encoding="utf-8")
    text = re.sub(r"^\s*(#|//).*$", "", text[text.rindex("#endif"):], flags=re.M)
    effects: list[dict[str, Any]] = []
    for kind, row in re.findall(r"^PATINA_EFFECT(_\w+)?\((.*?)\)$", text, re.M | re.S):
        values = [_value(part) for part in _split(row)]
        fields = effects[-1]["fields"] if effects else []
        if not kind:
            name, label, panel, *_, about = values
            effects.append({"name": name, "label": label, "panel": panel, "about": about, "fields": []})
        elif kind[1:] in KINDS:
            fields.append(_field(kind[1:], values))
        elif kind == "_ITEM":
            fields[-1]["items"].append(tuple([values[0].split("_", 1)[1], *values[2:]]))
        elif kind == "_AUTOMATIC":
            next(field for field in fields if field["name"] == values[0])["automatic"] = tuple(values[1:])
        elif kind != "_RULE":
            raise ValueError(f"{LIST}: PATINA_EFFECT{kind} is not known")
    return effects
