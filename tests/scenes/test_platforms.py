# SPDX-License-Identifier: GPL-3.0-or-later
"""The same picture everywhere: the command line draws scenes of every kind with each level of this machine's processor, and with builds
for others under an emulator; files and planes have the same bytes.

    test_platforms.py [--part K/N] build/out/release/patina [arm64[:LEVEL,...]="qemu-aarch64 -L / build/out/linux-arm64/patina" ...]

LEVEL: cpu-neon; without any all that the build has. --part: of the pictures every N-th from the K-th on, and says so.
"""

import argparse
import hashlib
import platform
import shlex
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

SIZE = "160x120"
PICTURES = {
    "points filled": "bare --unlit",
    "lit": "full --lit",
    "discs": "full --surface splats --lit",
    "filled alone, as in the paper": "full --surface fill --fill paper --quality paper --smooth gaussian --antialias background",
    "box filter, no closing": "bare --smooth box --fill off",
    "without analysis": "bare --analysis off --lit",
    "orthographic": "full --ortho 4 --lit",
    "culled": "full --cull --lit",
    "panorama": "full --panorama 160x80 --eye 0,0,0.3",
    "a region": "full --region 20,30,120,90 --lit",
    "layers": "full --opacity 0.5 --lit",
    "layers of discs": "full --surface splats --opacity 0.4 --lit",
    "shadows": "full --lit --shadows",
    "soft shadows": "full --lit --shadows --sun 40,30,5 --samples 4",
    "shadows of discs": "full --surface splats --lit --shadows",
    "silhouettes": "full --lines 2,0.5",
    "lines of points' own colours": "bare --lines 3 --line-source point --line-surface paper",
    "cues": "full --lit --edl 1 --obscurance 1 --fog 2,9 --toon 3",
    "drawing": "full --lit --hatch 3 --paper 0.5 --contour 0.1",
    "depth of field": "full --lit --focus 4,0.2",
    "finer pixels": "full --lit --pixel-samples 4",
    "averages": "full --average --depth surface",
    "ramp": "full --ramp height --ramp-colors viridis --exposure 0.5 --contrast 1.2",
    "clips": "full --lit --cut-box 0,0,-1,2,2,2 --clip-tint 1,0,0,0.1",
    "soft points, Base": "full --soft base --soft-radius 0.1",
    "soft points, Express": "bare --soft express --soft-radius 0.1",
    "soft points, Concentric": "bare --soft concentric --soft-radius 0.1 --soft-shells 8",
    "trust": "bare --pass trust",
    "soft points among a surface": "full --lit --soft base --soft-field luminance --soft-threshold 0.5 --soft-radius 0.1",
    "contour lines of an attribute": "full --lit --contour 0.2 --attribute turns --effect contour_source=attribute",
    "a mesh among points": "full --lit --shadows --mesh plate.obj",
    "range images": "bare --surface ranges --lit",
    "range images in two passes": "full --surface ranges --lit --range-sharpness 0.7",
}


def write_points(path, points, normals=None):
    fields = [("x", "<f4"), ("y", "<f4"), ("z", "<f4")] + ([(k, "<f4") for k in ("nx", "ny", "nz")] if normals is not None else [])
    fields += [(k, "u1") for k in ("red", "green", "blue")] + [("turns", "<f4")]
    table = np.zeros(len(points), fields)
    table["turns"] = np.sqrt(points[:, 0] ** 2 + points[:, 1] ** 2)  # a root is rounded alike on every machine
    for k in range(3):
        table["xyz"[k]] = points[:, k]
        table[("red", "green", "blue")[k]] = np.uint8(128 + 100 * np.sin(3 * points[:, k] + k))
        if normals is not None:
            table[("nx", "ny", "nz")[k]] = normals[:, k]
    kinds = {"<f4": "float", "u1": "uchar"}
    header = "".join(f"property {kinds[kind]} {name}\n" for name, kind in fields)
    path.write_bytes(f"ply\nformat binary_little_endian 1.0\nelement vertex {len(points)}\n{header}end_header\n".encode() + table.tobytes())


def write_scenes(folder):
    """A torus on ground, near points dense and far ones sparse: with normals, and a part of it without; two triangles."""
    random = np.random.default_rng(5)
    u, v = random.random((2, 9000)) * 2 * np.pi
    ring = np.stack([np.cos(u), np.sin(u), np.zeros_like(u)], 1)
    normals = np.cos(v)[:, None] * ring + np.sin(v)[:, None] * (0, 0, 1)
    flat = (random.random((6000, 2)) ** 2 - 0.3) * 3
    points = np.concatenate([ring + 0.4 * normals, np.column_stack([flat, np.full(len(flat), -0.5)])])
    normals = np.concatenate([normals, np.tile((0.0, 0.0, 1.0), (len(flat), 1))])
    write_points(folder / "full.ply", points, normals)
    write_points(folder / "bare.ply", points[::3])
    (folder / "plate.obj").write_text("v -1 -0.2 -0.4\nv 1.2 0 0.1\nv 0 0.3 1\nv 0.4 1 0.3\nf 1 2 3\nf 2 4 3\n", encoding="utf-8")


def digest(command, options, folder):
    """Of the picture's file and of its planes, by name."""
    scene, *rest = options.split()
    out, planes = folder / "out.png", folder / "planes"
    planes.mkdir(exist_ok=True)
    for old in planes.iterdir():
        old.unlink()
    whole = [] if "--panorama" in rest else ["--size", SIZE, "--dump-planes", str(planes)]
    done = subprocess.run([*command, "render", f"{scene}.ply", "-o", str(out), "--threads", "2", *whole, *rest],
                          capture_output=True, text=True, cwd=folder)
    assert done.returncode == 0, f"{options}: {done.stderr}"
    return {path.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in (out, *sorted(planes.iterdir()))}


def levels_of(tool):
    """The processor's levels that this build and machine have."""
    names = ["cpu-avx512", "cpu-avx2", "cpu-sse42", "cpu-neon", "cpu-scalar"]
    known = []
    for name in names:
        done = subprocess.run([*tool, "render", "-o", "/dev/null", "--device", name, "/dev/null"], capture_output=True, text=True)
        if "no such instruction set" not in done.stderr:
            known.append(name)
    return known


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--part", default="1/1")
    parser.add_argument("here", type=Path)
    parser.add_argument("others", nargs="*")
    given = parser.parse_args()
    tools, only = {"here": [str(given.here.resolve())]}, {}
    for name, text in (one.split("=", 1) for one in given.others):
        name, _, levels = name.partition(":")
        tools[name], only[name] = shlex.split(text), [level for level in levels.split(",") if level]
    first, every = map(int, given.part.split("/"))
    pictures = dict(list(PICTURES.items())[first - 1::every])
    passed = failed = 0
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        write_scenes(folder)
        devices = [(name, tool, level) for name, tool in tools.items() for level in only.get(name) or levels_of(tool)]
        print("levels:", ", ".join(f"{name} {level}" for name, _, level in devices), flush=True)
        for picture, options in pictures.items():
            found = {f"{name} {level}": digest([*tool], f"{options} --device {level}", folder) for name, tool, level in devices}
            first = next(iter(found.values()))
            assert len(first) > 3 or "panorama" in options, f"{picture}: no planes were written"
            wrong = [f"{device}: {key}" for device, one in found.items() for key in first.keys() | one.keys() if one.get(key) != first.get(key)]
            passed, failed = passed + (not wrong), failed + bool(wrong)
            print(f"{'FAILED' if wrong else 'ok'} {first['out.png']} {picture}", *wrong, sep="\n  " if wrong else " ", flush=True)
    x86 = {"cpu-avx512", "cpu-avx2", "cpu-sse42"} if platform.machine() == "x86_64" else set()
    lacks = x86 - {level for name, _, level in devices if name == "here"}
    for level in sorted(lacks):
        print(f"skip pictures/{level}: this processor has no such instructions")
    if len(pictures) < len(PICTURES):
        print(f"{len(pictures)} of {len(PICTURES)} pictures: {', '.join(pictures)}")
    print(f"{passed} passed, {failed} failed, {len(lacks)} skipped")
    return failed != 0


if __name__ == "__main__":
    sys.exit(main())
