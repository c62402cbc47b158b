# SPDX-License-Identifier: GPL-3.0-or-later
"""The command line for Windows, under wine: paths of many letters and scripts, numbers, devices, OpenGL, what cannot be written: read-only
folders, full disks, files that another program holds. Each time one message, and what was there stays.

    test_windows.py build/out/windows-x64/patina.exe build/out/release/patina [WORD of a test's name ...]
"""
import contextlib
import shutil
import struct
import subprocess
import sys
import tempfile
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))
from runs import Skip, run_tests  # noqa: E402

PATINA, HERE = (str(Path(argument).resolve()) for argument in sys.argv[1:3])
FOLDER = Path()  # a temporary one, set by main
WINESERVER = shutil.which("wineserver") or "/usr/lib/wine/wineserver64"


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


@contextlib.contextmanager
def mounted(*options):
    """A small file system of its own. Skip where this user may not have one."""
    place = FOLDER / "mounted"
    place.mkdir()
    done = subprocess.run(["mount", "-t", "tmpfs", "-o", ",".join(options), "tmpfs", place], capture_output=True, text=True, check=False)
    if done.returncode:
        raise Skip(f"no file system can be mounted here: {done.stderr.strip()}")
    try:
        yield place
    finally:
        subprocess.run(["umount", place], check=True)


def outputs(place):
    """Commands that write into a folder."""
    return (("convert", "wall.ply", place / "out.ply"), ("analyse", "wall.ply", "-o", place / "out.ply"),
            ("render", "wall.ply", "--size", "640x480", "-o", place / "out.png"))


def test_read_only():
    write_wall(FOLDER / "wall.ply")
    with mounted("size=1m") as place:
        (place / "out.ply").write_bytes(b"old")
        (place / "out.png").write_bytes(b"old")
        subprocess.run(["mount", "-o", "remount,ro", place], check=True)
        for command in outputs(place):
            said = run(*command, code=1)
            assert "cannot be written" in said and command[-1].name in said, said
        assert {path.name: path.read_bytes() for path in place.iterdir()} == {"out.ply": b"old", "out.png": b"old"}


def test_full_disk():
    write_wall(FOLDER / "wall.ply")
    with mounted("size=8k") as place:
        (place / "out.ply").write_bytes(b"old")
        for command in outputs(place)[:2]:
            said = run(*command, code=1)
            assert "cannot be written: No space left on device" in said and command[-1].name in said, said
        assert {path.name: path.read_bytes() for path in place.iterdir()} == {"out.ply": b"old"}, "nothing is left half written"


def test_held_open():
    """Of a file that another program has open the old one stays, and is whole."""
    write_wall(FOLDER / "wall.ply")
    held = FOLDER / "held.ply"
    held.write_bytes(b"old")
    with subprocess.Popen(["wine", "cmd", "/c", "pause >> held.ply"], cwd=FOLDER, stdin=subprocess.PIPE, stdout=subprocess.DEVNULL) as holder:
        deadline = time.monotonic() + 60
        while held.stat().st_size == 3 and time.monotonic() < deadline:  # until it has written that a key is to be pressed
            time.sleep(0.2)
        before = held.read_bytes()
        said = run("convert", "wall.ply", "held.ply", code=1)
        holder.communicate(b"\r\n", timeout=60)
    assert len(before) > 3 and "held.ply" in said and "another program holds the file open" in said, said
    assert held.read_bytes().startswith(before) and sorted(path.name for path in FOLDER.iterdir()) == ["held.ply", "wall.ply"]
    run("convert", "wall.ply", "held.ply")  # once it is let go
    assert held.stat().st_size > 12 * 1681


def test_text():
    """Lines of Windows' and numbers; nothing of the locale."""
    (FOLDER / "points.csv").write_bytes("x;y;z\r\n1.5;2;3\r\n1.25e1;2;3\r\n-1,5;2;3\r\n".replace("-1,5", "-1.5").encode())
    said = run("info", "points.csv")
    assert "points      3" in said and "\r" not in said, said


def test_devices():
    write_wall(FOLDER / "wall.ply")
    said = run("render", "wall.ply", "-o", "out.png", "--size", "32x24", "--device", "gl-egl", code=1)
    assert "gl-egl: libEGL.so.1 is not installed" in said, said
    run("render", "wall.ply", "-o", "out.png", "--size", "32x24")  # which is what automatic comes to


@contextlib.contextmanager
def screen():
    """A display for wine, which programs that run share: whoever began without one has to end before and after."""
    if not shutil.which("Xvfb"):
        raise Skip("xvfb is not installed")
    subprocess.run([WINESERVER, "-k"], check=False)
    with subprocess.Popen(["Xvfb", "-displayfd", "1", "-screen", "0", "640x480x24"], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL,
                          text=True) as server:
        try:
            yield ("env", f"DISPLAY=:{server.stdout.readline().strip()}", "wine", PATINA)
        finally:
            subprocess.run([WINESERVER, "-k"], check=False)
            server.terminate()


def test_opengl():
    """WGL, here by Mesa's llvmpipe: the keys are the processor's, bit for bit."""
    write_wall(FOLDER / "wall.ply")
    with screen() as tool:
        compare_keys(tool)
    said = run("render", "wall.ply", "-o", "out.png", "--size", "32x24", "--device", "gl-wgl", code=1,
               tool=("env", "-u", "DISPLAY", "wine", PATINA))
    assert "gl-wgl: Windows gives no window that OpenGL could draw in" in said, said


def compare_keys(screen):
    for number, options in enumerate(((), ("--surface", "splats", "--lit"), ("--opacity", "0.5"), ("--lit", "--shadows", "--edl", "1"))):
        planes = []
        for device, tool in (("gl-wgl", screen), ("cpu", (HERE,))):
            folder = FOLDER / f"{number}-{device}"
            folder.mkdir()
            run("render", "wall.ply", "-o", "out.png", "--size", "96x72", "--device", device, "--dump-planes", folder, *options, tool=tool)
            planes.append({path.name: path.read_bytes() for path in folder.iterdir()})
        there, here = planes
        keys = [name for name in here if "key" in name.lower() and not name.endswith(".txt")]
        assert keys and all(there.get(name) == here[name] for name in keys), f"{options}: {keys}, {sorted(there)}"


def main():
    """Runs each test in a folder of its own."""
    with tempfile.TemporaryDirectory() as scratch:
        def before():
            global FOLDER
            FOLDER = Path(tempfile.mkdtemp(dir=scratch))

        return run_tests(globals(), sys.argv[3:], before)[1] != 0


if __name__ == "__main__":
    sys.exit(main())
