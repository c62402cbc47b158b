# SPDX-License-Identifier: GPL-3.0-or-later
"""What the analysis does to colors: scans are balanced, and uncolored points take their neighbors' color."""

import random

import cli


def test_scans_are_balanced():
    """A wall that two scans took with other exposures: where they overlap it is even by default, and speckled with --no-balance."""
    text, dice = "", random.Random(4)
    for shift, grey in ((0.0, 90), (0.013, 180)):
        text += "40\n40\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n"
        text += "".join(f"{u / 20 - 1 + shift + dice.uniform(0, 0.02)} 3 {v / 20 - 1 + shift} 0.5 {grey} {grey} {grey}\n"
                        for u in range(40) for v in range(40))
    (cli.FOLDER / "exposed.ptx").write_text(text)
    spread = []
    for more in ((), ("--no-balance",)):
        cli.run("render", "exposed.ptx", "-o", "exposed.png", "--size", "40x40", "--look", "0,0,0,0,3,0,25", "--unlit", "--smooth", "off", *more)
        values = [pixel[0] for row in cli.read_png("exposed.png")[3][10:30] for pixel in row[10:30]]
        spread.append(max(values) - min(values))
    assert spread[0] < 12 and spread[1] > 60, spread


def test_black_specks_take_the_color_of_their_neighbors():
    """Unless --keep-colors; a saved cloud keeps them, and info counts them."""
    dice, count = random.Random(5), 60
    points = [(u / 30 - 1 + dice.uniform(-0.005, 0.005), v / 30 - 1 + dice.uniform(-0.005, 0.005), 0.0) for u in range(count) for v in range(count)]
    colors = [(0, 0, 0) if dice.random() < 0.08 else (200, 150, 100) for _ in points]
    cli.write_ply("specks.ply", points, colors)
    cli.run("convert", "specks.ply", "specks.cloud")
    cli.run("analyse", "specks.cloud", "-o", "lent.cloud")
    cli.run("analyse", "specks.cloud", "-o", "kept.cloud", "--keep-colors")
    black = sum(color == (0, 0, 0) for color in colors)
    told = next(line for line in cli.run("info", "lent.cloud").stdout.splitlines() if line.startswith("uncoloured"))
    assert 0.95 * black < int(told.split()[1]) <= black, told
    assert "uncoloured" not in cli.run("info", "kept.cloud").stdout
    for file, more, specks in (("specks.ply", (), False), ("specks.ply", ("--keep-colors",), True), ("lent.cloud", (), False), ("kept.cloud", (), True)):
        cli.run("render", file, "-o", "specks.png", "--size", "60x60", "--look", "0,0,5,0,0,0,16", "--unlit", "--smooth", "off", *more)
        least = min(pixel[0] for row in cli.read_png("specks.png")[3] for pixel in row)
        assert (least < 30) == specks, (file, more, least)
