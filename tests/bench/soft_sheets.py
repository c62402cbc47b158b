# SPDX-License-Identifier: GPL-3.0-or-later
"""Sheets of what tests/blender/soft_pictures.py rendered, for the manual; and the grove that it renders.

    python tests/bench/soft_sheets.py --grove GROVE.npz
    python tests/bench/soft_sheets.py FOLDER TARGET"""

from __future__ import annotations

import sys
from pathlib import Path

import matplotlib.font_manager
import numpy as np
from groves import grove
from PIL import Image, ImageDraw, ImageFont

POINTS = 600_000
SHOWN, GAP, LABEL = (380, 285), 6, 22
PAPER, INK = (250, 250, 248), (40, 40, 40)
STEPS = ("1  as scanned", "2  from beside: strokes of the brush", "3  painted points are soft", "4  opacity 0.05")
MODES = {"surface": "as surface", "SP": "splats (SP)", "OLT": "one layer transparent (OLT)", "ST": "soft (ST)"}


def sheet(rows: list[list[tuple[Path, str]]], target: Path, inset: Path | None = None) -> None:
    columns = max(map(len, rows))
    width = columns * (SHOWN[0] + GAP) - GAP
    page = Image.new("RGB", (width, len(rows) * (SHOWN[1] + LABEL + GAP) - GAP), PAPER)
    font = ImageFont.truetype(matplotlib.font_manager.findfont("DejaVu Sans"), 13)
    pen = ImageDraw.Draw(page)
    for k, row in enumerate(rows):
        for column, (path, label) in enumerate(row):
            at = column * (SHOWN[0] + GAP), k * (SHOWN[1] + LABEL + GAP)
            page.paste(Image.open(path).convert("RGB").resize(SHOWN, Image.LANCZOS), at)
            pen.text((at[0] + 4, at[1] + SHOWN[1] + 3), label, INK, font)
    if inset:  # over the third picture
        small = Image.open(inset).convert("RGB").resize((96, 96), Image.LANCZOS)
        page.paste(small, ((2 % columns) * (SHOWN[0] + GAP) + SHOWN[0] - 102, (2 // columns) * (SHOWN[1] + LABEL + GAP) + 6))
    page.save(target, quality=82, optimize=True)
    print(f"{target}: {target.stat().st_size // 1024} KB")


def main() -> None:
    if sys.argv[1] == "--grove":
        position, normal, color, classes = grove(POINTS)
        np.savez(sys.argv[2], position=position, normal=normal, color=color, classes=classes)
        return
    folder, target = Path(sys.argv[1]), Path(sys.argv[2])
    steps = [(folder / f"paint-{k + 1}.png", label) for k, label in enumerate(STEPS)]
    sheet([steps[:2], steps[2:]], target / "soft-paint.jpg", folder / "paint-histogram.png")
    rows = [[(path, label) for mode, label in MODES.items() if (path := folder / f"{name}-{mode}.png").is_file()] for name in ("trees", "grove")]
    sheet(rows, target / "soft-compared.jpg")


if __name__ == "__main__":
    main()
