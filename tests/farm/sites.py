# SPDX-License-Identifier: GPL-3.0-or-later
"""What the farm's tests draw, and how they run a program. Python's own library only."""
import random
import subprocess
from math import cos, pi, sin
from pathlib import Path


def run(*arguments, code=0, cwd=None, env=None, timeout=300):
    """What it printed, both streams; it must end with `code`."""
    done = subprocess.run([str(each) for each in arguments], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, cwd=cwd, env=env,
                          timeout=timeout)
    assert done.returncode == code, f"{arguments}: exit {done.returncode}, expected {code}: {done.stdout}"
    return done.stdout


def write_site(path: Path, count: int = 30000, seed: int = 3) -> Path:
    """A torus over a floor, random points with colours."""
    draw = random.Random(seed)
    rows = []
    for i in range(count):
        if i % 3:
            u, v = draw.uniform(0, 2 * pi), draw.uniform(0, 2 * pi)
            x, y, z = (1 + 0.4 * cos(v)) * cos(u), (1 + 0.4 * cos(v)) * sin(u), 0.4 * sin(v)
        else:
            x, y, z = draw.uniform(-2, 2), draw.uniform(-2, 2), -0.6
        rows.append(f"{x:.5f} {y:.5f} {z:.5f} {int(127 + 60 * x)} {int(127 + 60 * y)} {int(127 + 100 * z)}\n")
    columns = "".join(f"property float {axis}\n" for axis in "xyz")
    columns += "".join(f"property uchar {channel}\n" for channel in ("red", "green", "blue"))
    path.write_text(f"ply\nformat ascii 1.0\nelement vertex {count}\n{columns}end_header\n{''.join(rows)}", encoding="ascii")
    return path
