# SPDX-License-Identifier: GPL-3.0-or-later
"""Points wider than what is looked at, on the command line, whose centers lie beyond a border: tests that test_cli.py runs."""

import cli


def wide_points(name, count=14, step=0.25):
    """A grid of few points that lie far apart, of which each has its own color, over a floor's height of waves."""
    points = [((x - count / 2) * step, (y - count / 2) * step, 0.1 * ((x * 7 + y * 5) % 5)) for x in range(count) for y in range(count)]
    return cli.write_ply(name, points, [((x * 50) % 256, (y * 90) % 256, 128) for x in range(count) for y in range(count)], [(0, 0, 1)] * len(points))


VIEW = ("--look", "0.1,-0.4,1.6,0.1,0.1,0,40", "--size", "96x64", "--transparent")
KINDS = {"balls": ("--soft", "base", "--soft-radius", "0.5", "--soft-opacity", "0.7"),
         "shells": ("--soft", "concentric", "--soft-radius", "0.5"),
         "discs": ("--surface", "splats", "--radius", "0.4"),
         "glass": ("--surface", "splats", "--radius", "0.4", "--opacity", "0.5", "--layers", "3"),
         "lit": ("--surface", "splats", "--radius", "0.4", "--lit", "--sun", "-30,20", "--shadows")}


def test_borders_of_regions_and_tiles():
    """What a region, a tile or a strip shows is what the whole picture shows there, whatever reaches into it from outside."""
    wide_points("wide.ply")
    cli.run("convert", "wide.ply", "wide.cloud")
    for kind, options in KINDS.items():
        cli.run("render", "wide.cloud", "-o", "whole.png", *VIEW, *options)
        whole = cli.read_png("whole.png")[3]
        assert sum(pixel[3] > 0 for row in whole for pixel in row) > 3000, kind
        for x0, y0, x1, y1 in ((0, 0, 96, 1), (40, 20, 41, 21), (95, 0, 96, 64), (17, 30, 60, 33)):
            cli.run("render", "wide.cloud", "-o", "part.png", *VIEW, *options, "--region", f"{x0},{y0},{x1},{y1}")
            part = cli.read_png("part.png")[3]
            assert part == [row[x0:x1] for row in whole[64 - y1:64 - y0]], f"{kind}: {x0},{y0},{x1},{y1}"
        for tiles in ("2x2", "1x3"):
            columns, rows = map(int, tiles.split("x"))
            names = []
            for number in range(1, columns * rows + 1):
                names.append(f"tile{number}.png")
                cli.run("render", "wide.cloud", "-o", names[-1], *VIEW, *options, "--tiles", tiles, "--tile", number)
            cli.run("merge", *names, "-o", "joined.png")
            assert cli.read_png("joined.png")[3] == whole, f"{kind}: {tiles}"
        for rows in (7, 33):
            cli.run("render", "wide.cloud", "-o", "strips.png", *VIEW, *options, "--strip", rows)
            assert (cli.FOLDER / "strips.png").read_bytes() == (cli.FOLDER / "whole.png").read_bytes(), f"{kind}: strips of {rows} rows"


def test_linked_chunks_reach_beyond_their_centers():
    """A saved cloud, whose chunks are chosen before they are read, shows what the cloud in memory shows where chunks lie outside of the view."""
    count = 260
    points = [((i % count) * 0.02 - 2.6, (i // count) * 0.02 - 2.6, 0.05 * ((i * 7) % 3)) for i in range(count * count)]
    cli.write_ply("reach.ply", points, None, [(0, 0, 1)] * len(points))
    cli.run("convert", "reach.ply", "reach.cloud")
    view = ("--look", "0,0,0.5,0,0.001,0,20", "--size", "48x32", "--transparent")
    for kind, options in {"balls": ("--soft", "express", "--soft-radius", "0.3", "--soft-opacity", "0.1"), "discs": ("--surface", "splats", "--radius", "0.3")}.items():
        pictures = []
        for name in ("reach.ply", "reach.cloud"):
            cli.run("render", name, "-o", "reach.png", *view, *options)
            pictures.append(cli.read_png("reach.png")[3])
        assert pictures[0] == pictures[1] and any(pixel[3] for row in pictures[0] for pixel in row), kind
