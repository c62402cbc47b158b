# SPDX-License-Identifier: GPL-3.0-or-later
"""A contact sheet of the pictures of styles: sheet.py FOLDER OUT.jpg|OUT.png. The folder holds STYLE.png each; names come
from addon/presets/styles."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import matplotlib.font_manager
from PIL import Image, ImageDraw, ImageFont

STYLES = Path(__file__).resolve().parents[2] / "addon/presets/styles"
COLUMNS, SIDE, GAP, LABEL = 3, 400, 10, 34  # pixels
PAPER, INK = (250, 250, 248), (40, 40, 40)


def main(folder: Path, target: Path) -> None:
    told = {path.stem: json.loads(path.read_text(encoding="utf-8")) for path in STYLES.glob("*.json")}
    keys = sorted(told, key=lambda key: (key != "scan", told[key]["name"]))
    rows = -(-len(keys) // COLUMNS)
    sheet = Image.new("RGB", (COLUMNS * (SIDE + GAP) + GAP, rows * (SIDE + LABEL + GAP) + GAP), PAPER)
    draw = ImageDraw.Draw(sheet)
    font = ImageFont.truetype(matplotlib.font_manager.findfont("DejaVu Sans"), 19)
    for number, key in enumerate(keys):
        x = GAP + number % COLUMNS * (SIDE + GAP)
        y = GAP + number // COLUMNS * (SIDE + LABEL + GAP)
        with Image.open(folder / f"{key}.png") as picture:
            sheet.paste(picture.convert("RGB").resize((SIDE, SIDE), Image.Resampling.LANCZOS), (x, y))
        draw.text((x + SIDE // 2, y + SIDE + LABEL // 2), told[key]["name"], INK, font, anchor="mm")
    sheet.save(target, **({"quality": 85} if target.suffix == ".jpg" else {}))


main(Path(sys.argv[1]), Path(sys.argv[2]))
