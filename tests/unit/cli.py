# SPDX-License-Identifier: GPL-3.0-or-later
"""What tests of the command line share: test_cli.py PATH_OF_PATINA runs them. Needs Python's own library only."""

import math
import shlex
import struct
import subprocess
import sys
import zlib
from pathlib import Path

_given = sys.argv[1] if len(sys.argv) > 1 else "build/out/release/patina"
*RUNNER, _PROGRAM = [_given] if Path(_given).exists() else shlex.split(_given)  # `wine patina.exe`
PATINA = [*RUNNER, str(Path(_PROGRAM).resolve())]
FOLDER = Path()  # a temporary one, set by test_cli.py


def run(*arguments, code=0):
    done = subprocess.run([*PATINA, *map(str, arguments)], capture_output=True, text=True, cwd=FOLDER, timeout=300)
    assert done.returncode == code, f"{arguments}: exit {done.returncode}, expected {code}: {done.stderr}{done.stdout}"
    return done


def read_png(path):
    """(width, height, channels, rows from the top); 8-bit, not interlaced."""
    data = (FOLDER / path).read_bytes()
    assert data[:8] == b"\x89PNG\r\n\x1a\n"
    at, packed = 8, b""
    while at < len(data):
        (size,), kind = struct.unpack(">I", data[at:at + 4]), data[at + 4:at + 8]
        body = data[at + 8:at + 8 + size]
        if kind == b"IHDR":
            width, height, depth, color = struct.unpack(">IIBB", body[:10])
        elif kind == b"IDAT":
            packed += body
        at += size + 12
    assert depth == 8 and color in (2, 6)
    channels = 3 if color == 2 else 4
    raw, stride, rows, above = zlib.decompress(packed), width * channels, [], bytes(width * channels)
    for y in range(height):
        kind, row = raw[y * (stride + 1)], bytearray(raw[y * (stride + 1) + 1:(y + 1) * (stride + 1)])
        if kind == 1:
            for x in range(channels, stride):
                row[x] = (row[x] + row[x - channels]) & 255
        elif kind == 2:
            row = bytearray((value + b) & 255 for value, b in zip(row, above, strict=True))
        elif kind:
            for x in range(stride):
                a = row[x - channels] if x >= channels else 0
                b, c = above[x], above[x - channels] if x >= channels else 0
                p = a + b - c
                nearest = min((abs(p - a), 0, a), (abs(p - b), 1, b), (abs(p - c), 2, c))[2]
                row[x] = (row[x] + ((a + b) // 2 if kind == 3 else nearest)) & 255
        rows.append([tuple(row[x:x + channels]) for x in range(0, stride, channels)])
        above = row
    return width, height, channels, rows


def write_ply(name, points, colors=None, normals=None, kind="float"):
    with open(FOLDER / name, "w", encoding="ascii") as file:
        file.write(f"ply\nformat ascii 1.0\nelement vertex {len(points)}\n")
        file.write("".join(f"property {kind} {axis}\n" for axis in "xyz"))
        if normals:
            file.write("".join(f"property float n{axis}\n" for axis in "xyz"))
        if colors:
            file.write("".join(f"property uchar {channel}\n" for channel in ("red", "green", "blue")))
        file.write("end_header\n")
        for i, point in enumerate(points):
            row = [*point, *(normals[i] if normals else ()), *(colors[i] if colors else ())]
            file.write(" ".join(map(str, row)) + "\n")
    return name


def wall(name, color, count=120, y=0.0):
    """A square of 2 x 2 in the plane y, upright, `color(x, z)`."""
    step = 2 / (count - 1)
    points = [(x * step - 1, y, z * step - 1) for x in range(count) for z in range(count)]
    return write_ply(name, points, [color(x, z) for x, _, z in points], [(0, -1, 0)] * len(points))


def ball(name, count=20000, origin=(0, 0, 0), kind="float", colors=None):
    points, normals = [], []
    for i in range(count):
        z, angle = 1 - (2 * i + 1) / count, i * math.pi * (3 - math.sqrt(5))
        r = math.sqrt(1 - z * z)
        normal = (r * math.cos(angle), r * math.sin(angle), z)
        normals.append(tuple(round(v, 6) for v in normal))
        points.append(tuple(v + o for v, o in zip(normal, origin)))
    return write_ply(name, points, colors, normals, kind)


FRONT = ("--look", "0,-6,0,0,0,0,30", "--size", "64x64")
