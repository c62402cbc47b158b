# SPDX-License-Identifier: GPL-3.0-or-later
"""Scenes, the frames that render them, and panoramas."""

from __future__ import annotations

import ctypes
import json
import os
from collections.abc import Sequence
from ctypes import byref, c_double, c_uint32, c_void_p
from typing import Any

import numpy as np

from . import abi
from .abi import PASSES as PLANES
from .clouds import Cloud, Mesh, Texture
from .handles import Device, Handle, Task, note_losses
from .loader import PatinaError, check, library, split_plane


class Scene(Handle):
    """Clouds, lights, a camera and settings; keyword arguments are the fields of the header's descriptors."""

    _kind = "scene"

    def __init__(self) -> None:
        super().__init__()
        self.clouds: list[Cloud] = []  # by instance; the native scene points to them and what is kept
        self._kept: list[Handle] = []

    def add_cloud(self, cloud: Cloud, ramp: bytes = b"", mask: Handle | None = None, grade: Handle | None = None,
                  field: Handle | None = None, scans: Handle | None = None, **style: Any) -> None:
        """ramp: linear RGB, float32, two colours or more; empty: black to white. mask, grade, field, scans: of points.py."""
        fields = abi.CloudStyle(**style, mask=mask and mask._handle, grade=grade and grade._handle, scans=scans and scans._handle,
                                field=field and field._handle)
        if ramp:
            colors = np.frombuffer(ramp, np.float32)  # the library copies it
            fields.ramp, fields.ramp_count = colors.ctypes.data, len(colors) // 3
        self._call("add_cloud", cloud._handle, byref(fields))
        self.clouds.append(cloud)
        self._kept += [handle for handle in (mask, grade, field, scans) if handle]

    def ramp_range(self, instance: int) -> tuple[float, float]:
        """The values at the ends of a cloud's ramp, automatic ones too; set the camera before. PatinaError where it has no points."""
        found = (c_double * 2)()
        self._call("ramp_range", instance, found)
        return tuple(found)

    def add_mesh(self, mesh: Mesh, texture: Texture | None = None, **style: Any) -> None:
        self._call("add_mesh", mesh._handle, byref(abi.MeshStyle(texture=texture._handle if texture else None, **style)))
        self._kept += [mesh, texture] if texture else [mesh]

    def add_clip(self, **clip: Any) -> None:
        self._call("add_clip", byref(abi.Clip(**clip)))

    def add_light(self, **light: Any) -> None:
        self._call("add_light", byref(abi.LightDesc(**light)))

    def set_camera(self, **camera: Any) -> None:
        self._call("set_camera", byref(abi.Camera(**camera)))

    def frame_camera(self, azimuth: float, elevation: float, fov: float) -> dict[str, Any]:
        """The fields of a camera that frames the clouds: degrees around z, degrees above the horizon, vertical field of view in degrees (0:
        45.8). Follows the aspect ratio of the settings."""
        camera = abi.Camera()
        self._call("frame_camera", azimuth, elevation, fov, byref(camera))
        values = {name: getattr(camera, name) for name, _ in abi.Camera._fields_[1:]}
        return values | {"world_from_camera": tuple(camera.world_from_camera)}

    def extent(self) -> np.ndarray:
        """(2, 3) float64: the corners of the box of all that may be drawn. Least corner above the greatest: nothing."""
        corners = np.empty((2, 3))
        self._call("extent", corners[0].ctypes.data, corners[1].ctypes.data)
        return corners

    def set_settings(self, **settings: Any) -> None:
        self._call("set_settings", byref(abi.Settings(**settings)))

    def set_effects(self, **effects: Any) -> None:
        self._call("set_effects", byref(abi.Effects(**effects)))

    def set_lines(self, **lines: Any) -> None:
        self._call("set_lines", byref(abi.Lines(**lines)))


class Frame(Handle):
    """Renders scenes on a device and keeps the planes; closes before its device."""

    _kind = "frame"

    def __init__(self, device: Device) -> None:
        super().__init__(device._handle, blame=(device._handle,))
        self._device = device

    def render(self, scene: Scene) -> None:
        if not self._finalizer.alive:
            raise PatinaError("this frame is closed")
        check(library().patina_frame_render(self._handle, scene._handle), self._handle, scene._handle,
               self._device._handle)

    def start(self, scene: Scene, planes: Sequence[str], height: int, width: int,
              spare: Sequence[np.ndarray] = (), refine_ms: float | None = None) -> Task:
        """A task that renders, and gives these planes of the picture as read() would. Its size: of the scene's region.
        spare: what start() gave for another picture of these planes and is no longer needed; where it fits it is written
        again, for fresh memory costs more than what is written to it. refine_ms: as refine(), in place of rendering."""
        shapes = [(height, width, PLANES[plane][1]) for plane in planes]
        fits = [values.shape for values in spare] == shapes
        pixels = list(spare) if fits else [np.empty(shape, np.float32) for shape in shapes]
        reads = (abi.Read * len(pixels))(*(abi.Read(PLANES[plane][0], values.ctypes.data, values.nbytes)
                                        for plane, values in zip(planes, pixels, strict=True)))
        call, *how = ("render",) if refine_ms is None else ("refine", refine_ms)
        return Task(call, self._handle, scene._handle, *how, reads, len(reads),
                    keep=(self, self._device, scene, reads, pixels), finish=lambda task: pixels)

    def plan(self, scene: Scene) -> None:
        """Plans the picture without drawing it: clouds know then which pages it would want."""
        library().patina_frame_plan_text(self._handle, scene._handle, None, 0)

    def refine(self, scene: Scene, ms: float) -> None:
        """Betters the picture by samples of the same scene until so many milliseconds have passed, for as long as stats() say
        that some are pending. PatinaCancelled keeps those that there are."""
        if not self._finalizer.alive:
            raise PatinaError("this frame is closed")
        check(library().patina_frame_refine(self._handle, scene._handle, ms), self._handle, scene._handle, self._device._handle)

    def bake_shadows(self, scene: Scene) -> None:
        """Whole shadow textures of the scene's casting lights, without a picture."""
        self._call("bake_shadows", scene._handle)

    def save_shadows(self, path: str) -> None:
        self._call("save_shadows", os.fsencode(path))

    def load_shadows(self, scene: Scene, path: str) -> None:
        """Raises PatinaError with the reason when the file is damaged, stale, or of another scene."""
        self._call("load_shadows", scene._handle, os.fsencode(path))

    def shadows(self, instance: int, light: int, count: int) -> np.ndarray:
        """The share of a casting light that arrives at each of the instance's `count` points, float32."""
        values = np.empty(count, np.float32)
        self._call("read_shadows", instance, light, values.ctypes.data, values.nbytes)
        return values

    def cancel(self) -> None:
        library().patina_frame_cancel(self._handle)

    def progress(self) -> float:
        return library().patina_frame_progress(self._handle)

    def read(self, plane: str) -> np.ndarray:
        """A plane of the last picture or of one of its layers, (height, width, channels) float32, row 0 at the
        bottom."""
        name, layer = split_plane(plane)
        number, channels = PLANES[name]
        stats = self.stats()
        pixels = np.empty((stats["height"], stats["width"], channels), np.float32)
        if layer:
            self._call("read_layer", layer, number, pixels.ctypes.data, pixels.nbytes)
        else:
            self._call("read", number, pixels.ctypes.data, pixels.nbytes)
        return pixels

    def read_keys(self) -> np.ndarray:
        """What each pixel shows, (height, width, 1) uint64: float bits of z << 32 | id."""
        stats = self.stats()
        keys = np.empty((stats["height"], stats["width"], 1), np.uint64)
        self._call("read_keys", keys.ctypes.data, keys.nbytes)
        return keys

    def read_numbers(self) -> np.ndarray:
        """The number of what each pixel shows, (height, width, 1) uint64, in scenes of any size; 2**64 - 1: nothing."""
        stats = self.stats()
        numbers = np.empty((stats["height"], stats["width"], 1), np.uint64)
        self._call("read_numbers", numbers.ctypes.data, numbers.nbytes)
        return numbers

    def stats(self) -> dict[str, Any]:
        stats = abi.FrameStats()
        self._call("get_stats", byref(stats))
        values = {name: getattr(stats, name) for name, _ in abi.FrameStats._fields_[1:]}
        note_losses(values["points_lost"])
        values["expected"] = {name: getattr(stats.expected, name) for name, _ in abi.ExpectedError._fields_}
        return values

    def measure(self, each: bool = True) -> None:
        """From the next render on a GPU times each pass by itself; at first it times most passes together, which takes fewer calls."""
        self._call("measure", int(each))

    def pass_stats(self) -> dict[str, Any]:
        """Milliseconds by pass, and why each other pass was left out."""
        size = library().patina_frame_stats_json(self._handle, None, 0) + 1
        buffer = ctypes.create_string_buffer(size)
        library().patina_frame_stats_json(self._handle, buffer, size)
        return json.loads(buffer.value or b"{}")


class Panorama:
    """An equirectangular picture; keyword arguments are the fields of patina_panorama."""

    FACES = 6

    def __init__(self, **fields: Any) -> None:
        self._panorama = abi.Panorama(**fields)
        x0, y0, x1, y1 = self._panorama.region
        self._size = (y1 - y0, x1 - x0)

    def camera(self, face: int) -> tuple[dict[str, Any], int]:
        """The fields of a face's camera, and the pixels of its side."""
        camera, side = abi.Camera(), c_uint32()
        check(library().patina_panorama_camera(byref(self._panorama), face, byref(camera), byref(side)))
        values = {name: getattr(camera, name) for name, _ in abi.Camera._fields_[1:]}
        return values | {"world_from_camera": tuple(camera.world_from_camera)}, side.value

    def join(self, plane: str, faces: list[np.ndarray]) -> np.ndarray:
        """The region's plane from those of the six faces, (height, width, channels)."""
        name, _ = split_plane(plane)
        pixels = np.empty((*self._size, faces[0].shape[2]), faces[0].dtype)
        pointers = (c_void_p * 6)(*(face.ctypes.data for face in faces))
        if name in ("KEYS", "NUMBERS"):
            check(library().patina_panorama_join_keys(byref(self._panorama), pointers, pixels.ctypes.data, pixels.nbytes))
        else:
            check(library().patina_panorama_join(byref(self._panorama), PLANES[name][0], pointers, pixels.ctypes.data,
                                                  pixels.nbytes))
        return pixels
