# SPDX-License-Identifier: GPL-3.0-or-later
"""The largest and the narrowest images, many points at one place, and little memory: each gives an image or one message, and what cannot be is refused
before work begins.

    PATINA_LIBRARY=... python tests/files/test_extremes.py [NAME ...]"""

import ctypes
import os
import resource
import struct
import subprocess
import sys
import tempfile
import zlib
from pathlib import Path

from runner import Skip, run_tests

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "addon/native"))
import abi  # noqa: E402

PATINA = str(Path(os.environ["PATINA_LIBRARY"]).parent / "patina")
SCRATCH = Path(tempfile.mkdtemp(prefix="patina-extremes-"))
GIGA = 1 << 30
CLOSE = ("--look", "0.5,0.5,12,0.5,0.501,0,40")  # points of some() fill a ninth of the width: the gaps between them are few pixels wide
FLAT = ("--analysis", "off", "--smooth", "off")


def cloud(name, points):
    path = SCRATCH / name
    path.write_text(f"ply\nformat ascii 1.0\nelement vertex {len(points)}\nproperty float x\nproperty float y\nproperty float z\nend_header\n" +
                    "".join(f"{x} {y} {z}\n" for x, y, z in points))
    return name


def patina(*arguments, memory=0):
    """What ended, and the processor's seconds and the bytes that it took; memory: of addresses that it may have."""
    limit = (lambda: resource.setrlimit(resource.RLIMIT_AS, (memory, memory))) if memory else None
    process = subprocess.Popen([PATINA, *map(str, arguments)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=SCRATCH, preexec_fn=limit)
    out, said = process.stdout.read(), process.stderr.read()
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    return process.returncode, out, said, usage.ru_utime, usage.ru_maxrss * 1024


def size_of(path):
    """Width, height, and whether anything is drawn, of a PNG."""
    data = (SCRATCH / path).read_bytes()
    width, height = struct.unpack_from(">II", data, 16)
    unpack, at, colors = zlib.decompressobj(), 8, set()
    while at < len(data):
        size = struct.unpack_from(">I", data, at)[0]
        if data[at + 4:at + 8] == b"IDAT" and len(colors) < 3:
            colors |= set(unpack.decompress(data[at + 8:at + 8 + size]))
        at += size + 12
    return width, height, len(colors) > 1


def refused(result, *words, memory=GIGA // 2):
    """One message, before work began: neither seconds nor memory went into it."""
    code, _, said, seconds, peak = result
    lines = [line for line in said.splitlines() if line]
    assert code == 1 and len(lines) == 1 and any(word in said for word in words), f"{code}: {said}"
    assert seconds < 2 and peak < memory, f"{seconds} s of a processor, {peak >> 20} MiB: {said}"


def some():
    return cloud("some.ply", [(i % 50 / 50, i // 50 / 50, i % 7 / 70) for i in range(2500)])


def test_too_large_for_the_memory():
    """16384 x 16384 with 2 GB, of points so far apart that strips do not help, and more pixels than a plane has: statistics
    are of whole images, which are not drawn in strips. The message is about the whole image, not about the last strip that was tried."""
    refused(patina("render", some(), "-o", "x.png", "--size", "16384x16384", *FLAT, memory=2 * GIGA), "render it in regions")
    for more in (("--stats", "json"), ()):
        refused(patina("render", some(), "-o", "x.png", "--size", "65536x65536", *FLAT, *more, memory=4 * GIGA), "pixels are too large: render in regions")
    assert not (SCRATCH / "x.png").exists()


def test_little_memory():
    """2 GB are enough for 4096 x 4096, or one message says that they are not."""
    code, _, said, _, _ = patina("render", some(), "-o", "four.png", "--size", "4096x4096", "--device", "cpu", "--threads", "1", *FLAT, memory=2 * GIGA)
    assert code == 0 and size_of("four.png") == (4096, 4096, True) or code == 1 and len(said.splitlines()) == 1 and "memory" in said, said


def test_strips_where_memory_lacks():
    """An image that is larger than the memory is drawn in strips, which give the same file."""
    close = ("--size", "2048x2048", "--device", "cpu", "--threads", "1", *CLOSE, *FLAT)
    files, peaks = [], []
    for name, memory in (("whole.png", 0), ("strips.png", 6 * GIGA // 10)):
        code, _, said, _, peak = patina("render", some(), "-o", name, *close, memory=memory)
        assert code == 0, said
        files.append((SCRATCH / name).read_bytes())
        peaks.append(peak)
    assert files[0] == files[1]
    assert peaks[1] < 0.8 * peaks[0], peaks


def test_narrow():
    narrow("65535x1", "0.5,0.5,3,0.5,0.501,0,40")
    narrow("1x65535", "0.5,0.5,3,0.5,0.501,0,40")


def narrow(size, look, *more):
    code, _, said, _, _ = patina("render", some(), "-o", "narrow.png", "--size", size, "--look", look, *FLAT, *more)
    assert code == 0, said
    width, height, drawn = size_of("narrow.png")
    assert f"{width}x{height}" == size and drawn, (width, height, drawn)


def test_layers_in_one_pixel():
    """10,000 points one behind the other, glass and soft, which all lie in a pixel."""
    name = cloud("deep.ply", [(0, 0, i * 0.01) for i in range(10_000)])
    for options in (("--opacity", "0.001", "--layers", "16"), ("--soft", "base", "--soft-radius", "0.005", "--soft-opacity", "0.001"), ("--surface", "splats")):
        code, _, said, _, _ = patina("render", name, "-o", "deep.png", "--size", "33x33", "--look", "0,0.001,200,0,0,0,20", *FLAT, *options)
        assert code == 0 and size_of("deep.png")[2], (options, said)


def test_a_billion_points_at_one_place():
    """In pages, whose boxes are points: the scene is planned, and the pages are wanted. A page of more points than it may have is refused."""
    library = ctypes.CDLL(os.environ["PATINA_LIBRARY"])

    def call(name, *arguments):
        return getattr(library, f"patina_{name}")(*arguments)

    def begin(*counts):
        pages = (abi.Page * len(counts))(*(abi.Page((1, 2, 3), (1, 2, 3), 1e-9, count, 0xFFFFFFFF) for count in counts))
        found = ctypes.c_void_p()
        return call("cloud_pages_begin", ctypes.byref(abi.PagesDesc(pages=ctypes.addressof(pages), page_count=len(counts))), ctypes.byref(found)), found

    before = resource.getrusage(resource.RUSAGE_SELF).ru_utime
    code, found = begin(*[10 ** 7] * 100)
    assert code == 0, code
    device, scene, frame = (ctypes.c_void_p() for _ in range(3))
    camera = abi.Camera(world_from_camera=(1, 0, 0, 1, 0, 1, 0, 2, 0, 0, 1, 9, 0, 0, 0, 1), left=-.3, right=.3, bottom=-.3, top=.3, near_clip=.1, far_clip=20)
    for name, *arguments in (("device_create", ctypes.byref(abi.DeviceDesc(name=b"cpu", threads=1)), ctypes.byref(device)), ("scene_create", ctypes.byref(scene))):
        assert call(name, *arguments) == 0, name
    for name, *arguments in (("scene_add_cloud", scene, found, None), ("scene_set_camera", scene, ctypes.byref(camera)),
                             ("scene_set_settings", scene, ctypes.byref(abi.Settings(width=32, height=32))), ("frame_create", device, ctypes.byref(frame)),
                             ("frame_render", frame, scene)):
        assert call(name, *arguments) == 0, name
    wanted, count = (ctypes.c_uint32 * 200)(), ctypes.c_uint32()
    library.patina_cloud_wanted.argtypes = [ctypes.c_void_p, ctypes.c_double, ctypes.c_void_p, ctypes.c_uint32, ctypes.c_void_p]
    assert call("cloud_wanted", found, 0.0, wanted, 200, ctypes.byref(count)) == 0 and count.value == 100, count.value
    for handle, kind in ((frame, "frame"), (scene, "scene"), (device, "device"), (found, "cloud")):
        call(f"{kind}_destroy", handle)
    assert begin(1 << 31)[0] in abi.ERROR.values() and begin(1 << 31)[0] < 0
    assert begin(0)[0] < 0
    assert resource.getrusage(resource.RUSAGE_SELF).ru_utime - before < 2


def test_large_light_maps():
    """Points so close together that the light's map is as fine as is allowed: where a driver's blocks are smaller than that, one message says so
    before anything is drawn."""
    name = cloud("dense.ply", [(i * 1e-4 + at, k * 1e-4 + at, 0.2 * at) for at in (0, 1) for i in range(110) for k in range(110)])
    view = (name, "-o", "map.png", "--size", "64x64", "--shadows", *FLAT)
    code, _, said, _, _ = patina("render", *view, "--device", "cpu")
    assert code == 0, said
    (SCRATCH / "map.png").unlink()
    needs_opengl()
    result = patina("render", *view, "--device", "gl-egl")
    if result[0]:
        refused(result, "lower the shadow resolution")
    assert (SCRATCH / "map.png").exists() == (result[0] == 0)


def test_large_panoramas():
    """Faces that do not fit into memory, one of them or all six, are refused before the first is drawn, with a way that helps."""
    for size, memory, words in (("65536x32768", 16 * GIGA, "make the panorama smaller"), ("16384x8192", 4 * GIGA, "six faces of")):
        refused(patina("render", some(), "-o", "around.png", "--panorama", size, "--device", "cpu", "--threads", "1", *FLAT, memory=memory), words)
    assert not (SCRATCH / "around.png").exists()


def test_soft_points_in_one_pixel():
    """More balls behind one another than a driver's block has room for: one message, before they are drawn."""
    path = SCRATCH / "balls.ply"
    path.write_bytes(b"ply\nformat binary_little_endian 1.0\nelement vertex 3000000\nproperty float x\nproperty float y\nproperty float z\n"
                     b"end_header\n" + bytes(12 * 3_000_000))
    view = (path, "-o", "balls.png", "--size", "33x33", "--look", "0,0.001,9,0,0,0,20", *FLAT, "--soft", "base", "--soft-radius", "0.01")
    code, _, said, seconds, _ = patina("render", *view, "--device", "gl-egl")
    assert code == 0 or len(said.splitlines()) == 1, said
    if code and "driver" not in said:
        raise Skip(f"there is no OpenGL device here: {said.strip()}")
    if code:
        assert "MB are the most that its driver allows" in said and not (SCRATCH / "balls.png").exists(), said


def needs_opengl():
    code, _, said, _, _ = patina("render", some(), "-o", "small.png", "--size", "64x64", "--device", "gl-egl", *FLAT)
    if code:
        raise Skip(f"there is no OpenGL device here: {said.strip()}")


def test_small_blocks():
    """4096 x 4096 on OpenGL, where shaders may reach no more than 128 MiB of a plane, as in Mesa's software: strips give an image. Where points
    are so far apart that no strip does, at this size or at 16384 x 16384, one message says so before any is drawn."""
    needs_opengl()
    code, _, said, _, _ = patina("render", some(), "-o", "blocks.png", "--size", "4096x4096", "--device", "gl-egl", *CLOSE, *FLAT)
    assert code == 0 and size_of("blocks.png") == (4096, 4096, True), said
    for side, *strips in ((4096,), (16384,), (16384, "--strip", "256")):
        (SCRATCH / "sparse.png").unlink(missing_ok=True)
        result = patina("render", some(), "-o", "sparse.png", "--size", f"{side}x{side}", "--device", "gl-egl", *strips, *FLAT)
        if result[0] == 0:
            assert size_of("sparse.png") == (side, side, True)
        else:
            refused(result, f"a {side} x {side} image needs")
            assert result[2].strip().endswith("render it in regions") and not (SCRATCH / "sparse.png").exists(), result[2]


def test_narrow_on_opengl():
    needs_opengl()
    narrow("65535x1", "0.5,0.5,3,0.5,0.501,0,40", "--device", "gl-egl")
    narrow("1x65535", "0.5,0.5,3,0.5,0.501,0", "--ortho", "0.02", "--device", "gl-egl")  # in which points lie close together: margins are small


if __name__ == "__main__":
    run_tests(globals(), SCRATCH)
