# SPDX-License-Identifier: GPL-3.0-or-later
"""OSPRay's particle volume, by its C interface: a sum of Gaussians, cut off at three deviations, marched by the renderer "scivis".
Its libraries come with PyPI's ovito, of which nothing else is used.

    python peer_ospray.py LIBRARIES SCENE.npz TARGET.npz THREADS RATE...

SCENE: position (n, 3), radius (n,) where a Gaussian ends, weight (n,) of each, most: that they add up to somewhere, side: of the square that is seen along -z,
around the origin, size: pixels. TARGET: alpha of each rate, (size, size), the lowest row first. The last line that is printed is JSON."""

from __future__ import annotations

import json
import sys
import time
from ctypes import CDLL, CFUNCTYPE, POINTER, RTLD_GLOBAL, byref, c_char_p, c_float, c_int, c_uint32, c_uint64, c_void_p, cast
from pathlib import Path

import numpy as np

BEFORE = ("libtbb.so.12", "libtbbmalloc.so.2", "librkcommon.so.1", "libopenvkl.so.2", "libembree4.so.4", "libopenvkl_module_cpu_device.so.2")
FLOAT, VEC3F, INT, INSTANCE, VOLUMETRIC = 6000, 6002, 4000, 0x8000000 + 108, 0x8000000 + 115  # OSPDataType
RGBA32F, COLOR, POINT_FILTER = 3, 1, 0
DEVIATIONS = 3.0  # of a Gaussian, where OSPRay cuts it off
FRAMES, PATIENCE = 3, 60.0  # of a rate; seconds of a frame after which no other follows


class Ospray:
    def __init__(self, folder: Path, threads: int) -> None:
        for name in BEFORE:
            CDLL(str(folder / name), mode=RTLD_GLOBAL)
        self.lib = CDLL(str(folder / "libospray.so.3"), mode=RTLD_GLOBAL)
        self.kept: list[np.ndarray] = []
        if self.lib.ospLoadModule(b"cpu"):
            raise OSError("OSPRay's module for processors cannot be loaded")
        device, count = self.new("Device", b"cpu"), c_int(threads)
        self.lib.ospDeviceSetParam(device, b"numThreads", INT, byref(count))
        self._heard = CFUNCTYPE(None, c_void_p, c_int, c_char_p)(lambda _user, code, text: print(f"OSPRay {code}: {text}", file=sys.stderr))
        self.lib.ospDeviceSetErrorCallback(device, self._heard, None)
        self.lib.ospDeviceCommit(device)
        self.lib.ospSetCurrentDevice(device)

    def new(self, what: str, *arguments: object) -> c_void_p:
        call = getattr(self.lib, f"ospNew{what}")
        call.restype = c_void_p
        return c_void_p(call(*arguments))

    def made(self, thing: c_void_p, **parameters: object) -> c_void_p:
        """Sets parameters by their Python types and commits."""
        for name, value in parameters.items():
            key = name.replace("__", ".").encode()
            if isinstance(value, c_void_p):
                self.lib.ospSetObject(thing, key, value)
            elif isinstance(value, bool):
                self.lib.ospSetBool(thing, key, int(value))
            elif isinstance(value, int):
                self.lib.ospSetInt(thing, key, value)
            elif isinstance(value, c_uint32):
                self.lib.ospSetUInt(thing, key, value)
            elif isinstance(value, float):
                self.lib.ospSetFloat(thing, key, c_float(value))
            else:
                self.lib.ospSetVec3f(thing, key, *map(c_float, value))
        self.lib.ospCommit(thing)
        return thing

    def data(self, array: np.ndarray) -> c_void_p:
        array = np.ascontiguousarray(array, np.float32)
        self.kept.append(array)
        kind = VEC3F if array.ndim == 2 else FLOAT
        return self.made(self.new("SharedData1D", c_void_p(array.ctypes.data), c_uint32(kind), c_uint64(len(array))))

    def holding(self, what: str, name: bytes, kind: int, inner: c_void_p) -> c_void_p:
        thing = self.new(what, *([inner] if what == "Instance" else []))
        if kind:
            self.lib.ospSetObjectAsData(thing, name, c_uint32(kind), inner)
        return self.made(thing)


def main() -> None:
    folder, source, target, threads = Path(sys.argv[1]), sys.argv[2], sys.argv[3], int(sys.argv[4])
    rates = [float(rate) for rate in sys.argv[5:]]
    scene = np.load(source)
    size, most = int(scene["size"]), float(scene["most"])
    osp = Ospray(folder, threads)
    start = time.process_time()
    volume = osp.made(osp.new("Volume", b"particle"), particle__position=osp.data(scene["position"]),
                      particle__radius=osp.data(scene["radius"] / DEVIATIONS), particle__weight=osp.data(scene["weight"]))
    built = 1e3 * (time.process_time() - start)
    ramp = osp.new("TransferFunction", b"piecewiseLinear")
    osp.lib.ospSetBox1f(ramp, b"value", c_float(0.0), c_float(most))
    osp.made(ramp, color=osp.data(np.ones((2, 3))), opacity=osp.data(np.array([0.0, 1.0])))
    model = osp.made(osp.new("VolumetricModel", volume), transferFunction=ramp, densityScale=most)
    group = osp.holding("Group", b"volume", VOLUMETRIC, model)
    world = osp.holding("World", b"instance", INSTANCE, osp.made(osp.new("Instance", group)))
    camera = osp.made(osp.new("Camera", b"orthographic"), height=float(scene["side"]), aspect=1.0, position=(0.0, 0.0, 10.0),
                      direction=(0.0, 0.0, -1.0), up=(0.0, 1.0, 0.0))
    alphas, times, walls = [], [], []
    for rate in rates:
        renderer = osp.made(osp.new("Renderer", b"scivis"), pixelSamples=1, pixelFilter=c_uint32(POINT_FILTER), volumeSamplingRate=rate)
        buffer = osp.made(osp.new("FrameBuffer", c_int(size), c_int(size), c_uint32(RGBA32F), c_uint32(COLOR)))
        own, wall = [], []
        for _ in range(FRAMES):
            start, clock = time.process_time(), time.perf_counter()
            osp.lib.ospRenderFrameBlocking(buffer, renderer, camera, world)
            own.append(1e3 * (time.process_time() - start))
            wall.append(1e3 * (time.perf_counter() - clock))
            if wall[-1] > 100.0 * PATIENCE:  # a tenth
                break
        osp.lib.ospMapFrameBuffer.restype = c_void_p
        at = osp.lib.ospMapFrameBuffer(buffer, c_uint32(COLOR))
        alphas.append(np.ctypeslib.as_array(cast(c_void_p(at), POINTER(c_float)), (size, size, 4))[..., 3].copy())
        osp.lib.ospUnmapFrameBuffer(c_void_p(at), buffer)
        times.append(sorted(own)[len(own) // 2])
        walls.append(sorted(wall)[len(wall) // 2])
        print(f"{rate:g}: {times[-1]:.0f} ms of the processor, {walls[-1]:.0f} by the clock", file=sys.stderr, flush=True)
        if walls[-1] > 1e3 * PATIENCE:
            break
    np.savez(target, alpha=np.stack(alphas))
    print(json.dumps({"built": built, "times": times, "walls": walls}))


if __name__ == "__main__":
    main()
