# SPDX-License-Identifier: GPL-3.0-or-later
"""The command line for Windows, under wine: paths of many letters and scripts, numbers, devices, what cannot be written.

    test_windows.py build/out/windows-x64/patina.exe build/out/release/patina
"""
import struct
import subprocess
import sys
import tempfile
import traceback
from pathlib import Path

PATINA, HERE = (str(Path(argument).resolve()) for argument in sys.argv[1:3])
FOLDER = Path()  # a temporary one, set by main


def run(*arguments, code=0, tool=("wine", PATINA)):
    done = subprocess.run([*tool, *map(str, arguments)], capture_output=True, cwd=FOLDER, timeout=300, check=False)
    said = done.stdout.decode("utf-8") + done.stderr.decode("utf-8")
    assert done.returncode == code, f"{arguments}: exit {done.returncode}, expected {code}: {said}"
    return said


def write_wall(path):
    points = [(x / 20 - 1, 0.0, z / 20 - 1) for x in range(41) for z in range(41)]
    head = f"ply\nformat binary_little_endian 1.0\nelement vertex {len(points)}\n" + "".join(f"property float {axis}\n" for axis in "xyz")
    path.write_bytes(head.encode() + b"end_header\n" + b"".join(struct.pack("<3f", *point) for point in points))
    return path


def same_as_here(name):
    """Renders the file there and here: the same bytes, of the picture and of what is printed about the file."""
    run("render", name, "-o", "there.png", "--size", "64x48")
    run("render", name, "-o", "here.png", "--size", "64x48", tool=(HERE,))
    assert (FOLDER / "there.png").read_bytes() == (FOLDER / "here.png").read_bytes(), name
    assert run("info", name) == run("info", name, tool=(HERE,)), name


def test_scripts():
    (FOLDER / "Scans été").mkdir()
    write_wall(FOLDER / "Scans été/测试.ply")
    same_as_here("Scans été/测试.ply")
    run("convert", "Scans été/测试.ply", "Scans été/Größe ß.ply")
    assert "1681" in run("info", "Scans été/Größe ß.ply")
    assert "测试 2.ply" in run("info", "Scans été/测试 2.ply", code=1)


def test_long_path():
    folder = FOLDER / ("a" * 150) / ("b" * 150)
    folder.mkdir(parents=True)
    write_wall(folder / "wall.ply")
    assert len(str(folder)) > 300
    same_as_here(folder / "wall.ply")
    run("convert", folder / "wall.ply", folder / "copy.ply")
    assert (folder / "copy.ply").stat().st_size > 12 * 1681
    run("render", folder / "wall.ply", "-o", folder / "picture.png", "--size", "32x24")
    assert (folder / "picture.png").read_bytes()[:4] == b"\x89PNG"


def test_not_writable():
    """Where nothing can be written a sentence says so, and what was there stays."""
    write_wall(FOLDER / "wall.ply")
    for command in (("convert", "wall.ply"), ("render", "wall.ply", "--size", "32x24", "-o"), ("analyse", "wall.ply", "-o")):
        said = run(*command, "/proc/patina.ply", code=1)  # no user may, root neither
        assert "cannot be written" in said, said
        said = run(*command, "no folder/out.ply", code=1)
        assert "cannot be written: No such file or directory" in said, said


def test_text():
    """Lines of Windows' and numbers; nothing of the locale."""
    (FOLDER / "points.csv").write_bytes("x;y;z\r\n1.5;2;3\r\n1.25e1;2;3\r\n-1,5;2;3\r\n".replace("-1,5", "-1.5").encode())
    said = run("info", "points.csv")
    assert "points      3" in said and "\r" not in said, said


def test_devices():
    write_wall(FOLDER / "wall.ply")
    said = run("render", "wall.ply", "-o", "out.png", "--size", "32x24", "--device", "gl-egl", code=1)
    assert "on Windows Patina computes on the processor" in said, said
    run("render", "wall.ply", "-o", "out.png", "--size", "32x24")  # which is what automatic comes to


def main():
    global FOLDER
    passed = failed = 0
    for name, test in list(globals().items()):
        if name.startswith("test_"):
            with tempfile.TemporaryDirectory() as scratch:
                FOLDER = Path(scratch)
                try:
                    test()
                except Exception:  # noqa: BLE001
                    failed += 1
                    print(f"FAILED {name}\n{traceback.format_exc()}", flush=True)
                else:
                    passed += 1
                    print(f"ok {name}", flush=True)
    print(f"{passed} passed, {failed} failed, 0 skipped")
    return failed != 0


if __name__ == "__main__":
    sys.exit(main())
