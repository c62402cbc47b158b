# SPDX-License-Identifier: GPL-3.0-or-later
"""The binding of patina.h: the only file that knows ctypes.

Structures and enumerations follow native/include/patina/patina.h field by field; every call that fails raises
`PatinaError` with the library's own sentence. Calls release the GIL. A handle may be used from any thread, one
call at a time; `Frame.cancel`, `Frame.progress`, `Progress.cancel` and `Progress.value` at any time. What `start` in
a name begins is a `Task`, which runs without Python.
"""

from __future__ import annotations

import ctypes
import json
import os
import sys
import threading
import weakref
from collections.abc import Callable, Sequence
from ctypes import POINTER, Structure, byref, c_char, c_char_p, c_double, c_float, c_int
from ctypes import c_size_t, c_uint32, c_uint64, c_void_p, sizeof
from pathlib import Path
from typing import Any

import numpy as np

VERSION = (0, 1)  # of the header that this file follows; the patch number may differ

CANCELLED = -7  # PATINA_ERROR_CANCELLED
INTERNAL = -10  # PATINA_ERROR_INTERNAL

# patina_pass: plane name → (number, channels)
PLANES = {"COMBINED": (0, 4), "DEPTH": (1, 1), "NORMAL": (2, 3), "SOURCE": (3, 1), "SHADOW": (4, 1), "LINE": (5, 1),
          "CERTAINTY": (6, 1), "THICKNESS": (7, 1)}

MOST_LAYERS = 16  # PATINA_MAX_LAYERS
MOST_RAMP = 256  # PATINA_MAX_RAMP


def split_plane(plane: str) -> tuple[str, int]:
    """"DEPTH 3" is the depth of layer 3; "DEPTH" that of the picture, layer 0."""
    name, _, layer = plane.partition(" ")
    return name, int(layer or 0)


KINDS = ("UNKNOWN", "SURFACE", "BORDER", "LINE", "VOLUME", "STRAY")  # patina_kind

# Arrays of patina_neighbourhoods: type and width, 0: one number a point, -1: as many as neighbours.
NEIGHBOURHOODS = {"normal": (np.float32, 3), "axis": (np.float32, 3), "spacing": (np.float32, 0), "half_axes": (np.float32, 2),
                  "sigma": (np.float32, 0), "kind": (np.uint8, 0), "certainty": (np.float32, 0), "seen_through": (np.uint8, 0), "numbers": (np.uint32, -1),
                  "distances": (np.float64, -1), "soft_radius": (np.float32, 0), "uncertainty": (np.float32, 0)}

# patina_type by numpy type
_TYPES = {"float32": 1, "float64": 2, "uint8": 3, "uint16": 4, "uint32": 5, "int8": 6, "int16": 7, "int32": 8}


class PatinaError(Exception):
    """A call that failed: `code` from the header's list, the library's sentence as text."""

    def __init__(self, message: str, code: int = INTERNAL) -> None:
        super().__init__(message)
        self.code = code


class PatinaCancelled(PatinaError):
    """A call that was cancelled on request."""


# ---- structures ----------------------------------------------------------------------------------------------


class _Descriptor(Structure):
    """A structure whose first field is its size; zero everywhere else means "default"."""

    def __init__(self, **fields: Any) -> None:
        super().__init__(struct_size=sizeof(self))
        types = dict(self._fields_)
        for name, value in fields.items():
            kind = types[name]
            setattr(self, name, kind(*value) if issubclass(kind, ctypes.Array) else value)


class _Array(Structure):
    _fields_ = [("data", c_void_p), ("type", c_uint32), ("components", c_uint32), ("stride", c_uint64)]


class _DeviceDesc(_Descriptor):
    _fields_ = [("struct_size", c_size_t), ("name", c_char_p), ("threads", c_uint32), ("batch", c_uint32),
                ("memory_cap", c_uint64)]


class _DeviceInfo(_Descriptor):
    _fields_ = [("struct_size", c_size_t), ("name", c_char * 32), ("description", c_char * 192),
                ("threads", c_uint32), ("hardware", c_uint32), ("key64", c_uint32)]


class _CloudDesc(_Descriptor):
    _fields_ = [("struct_size", c_size_t), ("count", c_uint64), ("position", _Array), ("normal", _Array),
                ("color", _Array), ("opacity", _Array), ("scalar", _Array), ("classes", _Array),
                ("origin", c_double * 3), ("threads", c_uint32), ("radius", _Array)]


class _CloudInfo(_Descriptor):
    _fields_ = [("struct_size", c_size_t), ("count", c_uint64), ("drawn", c_uint64), ("chunks", c_uint64),
                ("bytes", c_uint64), ("box_min", c_double * 3), ("box_max", c_double * 3), ("spacing", c_double),
                ("spacing_min", c_double), ("spacing_max", c_double), ("invalid_positions", c_uint64),
                ("invalid_normals", c_uint64), ("invalid_colors", c_uint64), ("has_normals", c_uint32),
                ("has_colors", c_uint32), ("has_opacities", c_uint32), ("origin", c_double * 3),
                ("layer_distance", c_double), ("has_radii", c_uint32), ("radius_most", c_float),
                ("has_scalars", c_uint32), ("has_classes", c_uint32), ("scalar_range", c_float * 2),
                ("class_bits", c_uint32 * 8), ("has_shapes", c_uint32), ("normals_oriented", c_uint32),
                ("estimated_normals", c_uint64), ("kinds", c_uint64 * 6), ("seen_through", c_uint64)]


class _AnalysisDesc(_Descriptor):
    _fields_ = [("struct_size", c_size_t), ("neighbours", c_uint32), ("threads", c_uint32), ("keep_normals", c_uint32),
                ("station_count", c_uint32), ("stations", c_void_p), ("station", _Array), ("free_space", c_uint32),
                ("row", _Array), ("column", _Array)]


class _Neighbourhoods(_Descriptor):
    _fields_ = [("struct_size", c_size_t), ("normal", c_void_p), ("axis", c_void_p), ("spacing", c_void_p),
                ("half_axes", c_void_p), ("sigma", c_void_p), ("kind", c_void_p), ("certainty", c_void_p),
                ("seen_through", c_void_p), ("neighbours", c_uint32), ("threads", c_uint32), ("numbers", c_void_p), ("distances", c_void_p),
                ("soft_radius", c_void_p), ("uncertainty", c_void_p)]


class _FileInfo(_Descriptor):
    _fields_ = [("struct_size", c_size_t), ("format", c_char * 48), ("count", c_uint64), ("attributes", c_uint32),
                ("position_type", c_uint32), ("color_type", c_uint32), ("has_normals", c_uint32),
                ("origin", c_double * 3), ("box_min", c_double * 3), ("box_max", c_double * 3),
                ("invalid_positions", c_uint64), ("stations", c_uint32)]


class _FileAttribute(_Descriptor):
    _fields_ = [("struct_size", c_size_t), ("name", c_char * 64), ("type", c_uint32)]


class _GridDesc(_Descriptor):
    _fields_ = [("struct_size", c_size_t), ("count", c_uint64), ("position", c_void_p), ("column", c_void_p),
                ("row", c_void_p), ("station", c_double * 3)]


class _CloudStyle(_Descriptor):
    _fields_ = [("struct_size", c_size_t), ("world_from_object", c_double * 16), ("lighting", c_uint32),
                ("cull_back", c_uint32), ("d_min", c_float), ("color", c_float * 3), ("ambient", c_float),
                ("diffuse", c_float), ("specular", c_float), ("shininess", c_uint32), ("transparency", c_float),
                ("shadow_off", c_uint32), ("radius", c_float), ("color_source", c_uint32), ("ramp", c_void_p), ("ramp_count", c_uint32),
                ("ramp_range", c_float * 2), ("exposure", c_float), ("contrast", c_float),
                ("hidden_classes", c_uint32 * 8), ("clip_off", c_uint32), ("free_space", c_uint32),
                ("hidden_kinds", c_uint32), ("least_certainty", c_float), ("largest_gap", c_float)]


class _Clip(_Descriptor):
    _fields_ = [("struct_size", c_size_t), ("world_from_clip", c_double * 16), ("shape", c_uint32), ("cut", c_uint32),
                ("tint", c_float * 3), ("tint_strength", c_float), ("tint_width", c_float)]


class _MeshDesc(_Descriptor):
    _fields_ = [("struct_size", c_size_t), ("vertex_count", c_uint64), ("position", _Array), ("normal", _Array),
                ("color", _Array), ("triangle_count", c_uint64), ("indices", c_void_p)]


class _MeshStyle(_Descriptor):
    _fields_ = [("struct_size", c_size_t), ("world_from_object", c_double * 16), ("color", c_float * 3),
                ("shadow_off", c_uint32)]


class _LightDesc(_Descriptor):
    _fields_ = [("struct_size", c_size_t), ("type", c_uint32), ("color", c_float * 3), ("power", c_float),
                ("position", c_double * 3), ("direction", c_double * 3), ("side", c_double * 3), ("angle", c_float),
                ("radius", c_float), ("size", c_float * 2), ("shape", c_uint32), ("cone", c_float),
                ("blend", c_float), ("shadows", c_uint32)]


class _Camera(_Descriptor):
    _fields_ = [("struct_size", c_size_t), ("orthographic", c_uint32), ("world_from_camera", c_double * 16),
                ("left", c_double), ("right", c_double), ("bottom", c_double), ("top", c_double),
                ("near_clip", c_double), ("far_clip", c_double)]


class _Panorama(_Descriptor):
    _fields_ = [("struct_size", c_size_t), ("width", c_uint32), ("height", c_uint32), ("region", c_uint32 * 4),
                ("world_from_camera", c_double * 16), ("longitude", c_double * 2), ("latitude", c_double * 2),
                ("near_clip", c_double), ("far_clip", c_double)]


class _Settings(_Descriptor):
    _fields_ = [("struct_size", c_size_t), ("width", c_uint32), ("height", c_uint32), ("region", c_uint32 * 4),
                ("quality", c_uint32), ("fill", c_uint32), ("fill_iterations", c_uint32), ("smooth", c_uint32),
                ("antialias", c_uint32), ("film_transparent", c_uint32), ("world_color", c_float * 3),
                ("passes", c_uint32), ("layers", c_uint32), ("layer_passes", c_uint32), ("error_target", c_float),
                ("strata", c_uint32), ("shadow_samples", c_uint32), ("shadow_resolution", c_uint32),
                ("shadow_lazy", c_uint32), ("shadow_progressive", c_uint32), ("shadow_error", c_float),
                ("own_background", c_uint32), ("background", c_float * 3), ("surface", c_uint32), ("shadow_uncut", c_uint32),
                ("pixel_samples", c_uint32), ("depth", c_uint32)]


class _Effects(_Descriptor):
    _fields_ = [("struct_size", c_size_t), ("edl_strength", c_float), ("edl_radius", c_float),
                ("obscurance_strength", c_float), ("obscurance_radius", c_float), ("toon_bands", c_uint32),
                ("toon_softness", c_float), ("hatch_levels", c_uint32), ("hatch_spacing", c_float),
                ("hatch_opacity", c_float), ("hatch_ground", c_float), ("hatch_color", c_float * 3),
                ("fog_density", c_float), ("fog_start", c_float), ("fog_end", c_float), ("fog_fixed", c_uint32),
                ("fog_color", c_float * 3), ("focus_aperture", c_float), ("focus_distance", c_float),
                ("paper_color", c_float * 3), ("paper_grain", c_float)]


class _Lines(_Descriptor):
    _fields_ = [("struct_size", c_size_t), ("width", c_float), ("world", c_uint32), ("offset", c_float),
                ("source", c_uint32), ("color", c_float * 3), ("far_color", c_float * 3), ("range", c_float * 2),
                ("transparency", c_float), ("soft", c_float), ("surface", c_uint32), ("paper", c_float * 3)]


class _Read(Structure):
    _fields_ = [("pass_", c_uint32), ("pixels", c_void_p), ("size", c_size_t)]


class _ExpectedError(Structure):
    _fields_ = [("color", c_float), ("coverage", c_float), ("depth", c_float), ("normal", c_float),
                ("doubt", c_float)]


class _FrameStats(_Descriptor):
    _fields_ = [("struct_size", c_size_t), ("width", c_uint32), ("height", c_uint32), ("points", c_uint64),
                ("points_scattered", c_uint64), ("triangles", c_uint64), ("chunks", c_uint64), ("chunks_culled", c_uint64),
                ("ms", c_double), ("plane_bytes", c_uint64), ("layers", c_uint32), ("spacing_px", c_float),
                ("expected", _ExpectedError), ("shadow_bytes", c_uint64), ("shadow_maps", c_uint32),
                ("shadow_width", c_uint32), ("shadow_height", c_uint32), ("shadow_pending", c_uint32),
                ("shadow_samples", c_uint32), ("shadow_error", c_float), ("chunks_clipped", c_uint64),
                ("chunks_cut", c_uint64)]


# ---- the library ---------------------------------------------------------------------------------------------

_OUT = POINTER(c_void_p)

# name → argument types; everything returns int except what _RESULTS names
_CALLS = {
    "patina_version": (),
    "patina_message": (c_void_p, c_char_p, c_size_t),
    "patina_log_next": (c_char_p, c_size_t, POINTER(c_int)),
    "patina_progress_create": (_OUT,),
    "patina_progress_destroy": (c_void_p,),
    "patina_progress_cancel": (c_void_p,),
    "patina_progress_value": (c_void_p,),
    "patina_device_create": (POINTER(_DeviceDesc), _OUT),
    "patina_device_destroy": (c_void_p,),
    "patina_device_get_info": (c_void_p, POINTER(_DeviceInfo)),
    "patina_cloud_create": (POINTER(_CloudDesc), c_void_p, _OUT),
    "patina_cloud_destroy": (c_void_p,),
    "patina_cloud_save": (c_void_p, c_char_p),
    "patina_cloud_open": (c_char_p, _OUT),
    "patina_cloud_set_colors": (c_void_p, POINTER(_Array)),
    "patina_cloud_get_info": (c_void_p, POINTER(_CloudInfo)),
    "patina_mesh_create": (POINTER(_MeshDesc), _OUT),
    "patina_mesh_destroy": (c_void_p,),
    "patina_file_open": (c_char_p, c_void_p, _OUT),
    "patina_file_destroy": (c_void_p,),
    "patina_file_get_info": (c_void_p, POINTER(_FileInfo)),
    "patina_file_get_attribute": (c_void_p, c_uint32, POINTER(_FileAttribute)),
    "patina_file_read_positions": (c_void_p, c_void_p, c_size_t),
    "patina_file_read_normals": (c_void_p, c_void_p, c_size_t),
    "patina_file_read_colors_u8": (c_void_p, c_void_p, c_size_t),
    "patina_file_read_colors_f32": (c_void_p, c_void_p, c_size_t),
    "patina_file_read_stations": (c_void_p, c_void_p, c_size_t),
    "patina_file_read_attribute": (c_void_p, c_uint32, c_void_p, c_size_t),
    "patina_scene_create": (_OUT,),
    "patina_scene_destroy": (c_void_p,),
    "patina_scene_add_cloud": (c_void_p, c_void_p, POINTER(_CloudStyle)),
    "patina_scene_add_mesh": (c_void_p, c_void_p, POINTER(_MeshStyle)),
    "patina_scene_add_light": (c_void_p, POINTER(_LightDesc)),
    "patina_scene_add_clip": (c_void_p, POINTER(_Clip)),
    "patina_ramp": (c_char_p, c_void_p),
    "patina_cloud_set_scalars": (c_void_p, POINTER(_Array)),
    "patina_cloud_analyse": (c_void_p, POINTER(_AnalysisDesc), c_void_p),
    "patina_cloud_neighbourhoods": (c_void_p, POINTER(_Neighbourhoods), c_void_p),
    "patina_cloud_scalar_range": (c_void_p, c_double, c_void_p),
    "patina_cloud_dense_box": (c_void_p, c_void_p, c_void_p),
    "patina_scene_set_camera": (c_void_p, POINTER(_Camera)),
    "patina_scene_set_lines": (c_void_p, POINTER(_Lines)),
    "patina_scene_set_settings": (c_void_p, POINTER(_Settings)),
    "patina_scene_set_effects": (c_void_p, POINTER(_Effects)),
    "patina_frame_create": (c_void_p, _OUT),
    "patina_frame_destroy": (c_void_p,),
    "patina_frame_render": (c_void_p, c_void_p),
    "patina_frame_cancel": (c_void_p,),
    "patina_frame_progress": (c_void_p,),
    "patina_frame_read": (c_void_p, c_uint32, c_void_p, c_size_t),
    "patina_frame_read_keys": (c_void_p, c_void_p, c_size_t),
    "patina_frame_read_layer": (c_void_p, c_uint32, c_uint32, c_void_p, c_size_t),
    "patina_frame_bake_shadows": (c_void_p, c_void_p),
    "patina_frame_save_shadows": (c_void_p, c_char_p),
    "patina_frame_load_shadows": (c_void_p, c_void_p, c_char_p),
    "patina_frame_read_shadows": (c_void_p, c_uint32, c_uint32, c_void_p, c_size_t),
    "patina_frame_get_stats": (c_void_p, POINTER(_FrameStats)),
    "patina_frame_stats_json": (c_void_p, c_char_p, c_size_t),
    "patina_panorama_camera": (POINTER(_Panorama), c_uint32, POINTER(_Camera), POINTER(c_uint32)),
    "patina_panorama_join": (POINTER(_Panorama), c_uint32, c_void_p * 6, c_void_p, c_size_t),
    "patina_panorama_join_keys": (POINTER(_Panorama), c_void_p * 6, c_void_p, c_size_t),
    "patina_task_render": (c_void_p, c_void_p, c_void_p, c_uint32, _OUT),
    "patina_task_build": (POINTER(_CloudDesc), c_void_p, _OUT),
    "patina_task_set_colors": (c_void_p, POINTER(_Array), _OUT),
    "patina_task_grid_normals": (POINTER(_GridDesc), c_void_p, c_void_p, _OUT),
    "patina_task_fingerprint": (POINTER(_CloudDesc), POINTER(c_uint64), _OUT),
    "patina_task_open_file": (c_char_p, c_void_p, _OUT),
    "patina_task_save": (c_void_p, c_char_p, _OUT),
    "patina_task_take_file": (c_void_p, _OUT),
    "patina_task_done": (c_void_p,),
    "patina_task_analyse": (c_void_p, POINTER(_AnalysisDesc), c_void_p, _OUT),
    "patina_task_apply": (c_void_p,),
    "patina_task_wait": (c_void_p,),
    "patina_task_take_cloud": (c_void_p, _OUT),
    "patina_task_destroy": (c_void_p,),
}
_RESULTS = {
    "patina_version": c_char_p, "patina_message": c_size_t, "patina_log_next": c_size_t,
    "patina_progress_destroy": None, "patina_progress_cancel": None, "patina_progress_value": c_float,
    "patina_device_destroy": None, "patina_cloud_destroy": None, "patina_mesh_destroy": None, "patina_file_destroy": None,
    "patina_scene_destroy": None, "patina_frame_destroy": None, "patina_frame_cancel": None,
    "patina_frame_progress": c_float, "patina_frame_stats_json": c_size_t, "patina_task_destroy": None,
}

_loaded: ctypes.CDLL | None = None
_loading = threading.Lock()


def library_path() -> Path:
    """Where the library is looked for: $PATINA_LIBRARY, else lib/ in this package."""
    override = os.environ.get("PATINA_LIBRARY")
    if override:
        return Path(override)
    name = {"win32": "patina.dll", "darwin": "libpatina.dylib"}.get(sys.platform, "libpatina.so")
    return Path(__file__).parent / "lib" / name


def library() -> ctypes.CDLL:
    """Loads the library at the first call. PatinaError when it is missing or of another version."""
    global _loaded
    with _loading:
        if _loaded is None:
            _loaded = _load(library_path())
        return _loaded


def forget_library() -> None:
    """The next call of library() looks for the file again. Handles that live on keep the old one."""
    global _loaded
    with _loading:
        _loaded = None


def _load(path: Path) -> ctypes.CDLL:
    if not path.is_file():
        raise PatinaError(f"Patina's library is missing: there is no {path}. Install the add-on's zip for this "
                          "platform, or let the environment variable PATINA_LIBRARY name the file")
    try:
        lib = ctypes.CDLL(str(path))
        for name, arguments in _CALLS.items():
            call = getattr(lib, name)
            call.argtypes = arguments
            call.restype = _RESULTS.get(name, c_int)
    except (OSError, AttributeError) as error:
        raise PatinaError(f"Patina's library {path} cannot be loaded: {error}") from None
    version = lib.patina_version().decode()
    if tuple(int(part) for part in version.split(".")[:2]) != VERSION:
        wanted = ".".join(str(part) for part in VERSION)
        raise PatinaError(f"Patina's library {path} is version {version}, the add-on needs {wanted}: "
                          "restart Blender after an update")
    return lib


def _message(handle: c_void_p | None) -> str:
    buffer = ctypes.create_string_buffer(2048)
    library().patina_message(handle, buffer, len(buffer))
    return buffer.value.decode("utf-8", "replace")


def _check(code: int, *handles: c_void_p | None) -> None:
    """Raises for a negative code with the first message found at the handles, else at the thread."""
    if code >= 0:
        return
    text = next(filter(None, map(_message, (*handles, None))), f"the library failed with code {code}")
    raise (PatinaCancelled if code == CANCELLED else PatinaError)(text, code)


def log_lines() -> list[tuple[int, str]]:
    """Takes the unread log lines: (level, text), level 0 error, 1 warning, 2 information."""
    lines = []
    buffer, level = ctypes.create_string_buffer(1024), c_int()
    while library().patina_log_next(buffer, len(buffer), byref(level)):
        lines.append((level.value, buffer.value.decode("utf-8", "replace")))
    return lines


# ---- handles -------------------------------------------------------------------------------------------------


def _destroy(destroy: Callable[[c_void_p], None], handle: c_void_p, _keep: Any) -> None:
    destroy(handle)


class _Handle:
    """Owns a native handle until close(), the end of a `with`, or the last reference. `keep` lives as long."""

    _kind = ""

    def __init__(self, *arguments: Any, blame: tuple[c_void_p, ...] = (), create: str = "", keep: Any = None) -> None:
        lib = library()
        handle = c_void_p()
        _check(getattr(lib, create or f"patina_{self._kind}_create")(*arguments, byref(handle)), *blame)
        self._handle = handle
        self._finalizer = weakref.finalize(self, _destroy, getattr(lib, f"patina_{self._kind}_destroy"), handle, keep)

    def close(self) -> None:
        self._finalizer()

    def __enter__(self):
        return self

    def __exit__(self, *_: Any) -> None:
        self.close()

    def _call(self, name: str, *arguments: Any) -> None:
        if not self._finalizer.alive:
            raise PatinaError(f"this {self._kind} is closed")
        _check(getattr(library(), f"patina_{self._kind}_{name}")(self._handle, *arguments), self._handle)


class Progress(_Handle):
    """Of a long call that has no frame; value() and cancel() may be called while it runs."""

    _kind = "progress"

    def cancel(self) -> None:
        library().patina_progress_cancel(self._handle)

    def value(self) -> float:
        return library().patina_progress_value(self._handle)


class Task(_Handle):
    """A call that runs on a native thread; what it uses stays alive until it ends. close() waits for it."""

    _kind = "task"

    def __init__(self, call: str, *arguments: Any, keep: tuple,
                 finish: Callable[[Task], Any] = lambda task: None) -> None:
        super().__init__(*arguments, create=f"patina_task_{call}", keep=keep)
        self._finish = finish

    def done(self) -> bool:
        return not self._finalizer.alive or bool(library().patina_task_done(self._handle))

    def result(self) -> Any:
        """Waits; raises what the call would have raised, else gives its result. Once: then the task is closed."""
        try:
            self._call("wait")
            return self._finish(self)
        finally:
            self.close()


def _handle_of(progress: Progress | None) -> c_void_p | None:
    return progress._handle if progress else None


class Device(_Handle):
    _kind = "device"

    def __init__(self, name: str = "auto", threads: int = 0) -> None:
        super().__init__(byref(_DeviceDesc(name=name.encode(), threads=threads)))
        info = _DeviceInfo()
        self._call("get_info", byref(info))
        self.name = info.name.decode()
        self.description = info.description.decode("utf-8", "replace")
        self.hardware = bool(info.hardware)


def _view(array: np.ndarray | None, count: int) -> _Array:
    """The library's view of a (count, components) array, which must stay alive during the call."""
    if array is None:
        return _Array()
    if array.ndim != 2 or len(array) != count or not array.flags.c_contiguous:
        raise PatinaError(f"an array of shape {array.shape} cannot hold {count} points")
    return _Array(data=array.ctypes.data, type=_TYPES[array.dtype.name], components=array.shape[1])


def _describe(positions: np.ndarray, normals: np.ndarray | None, colors: np.ndarray | None,
              opacities: np.ndarray | None, radii: np.ndarray | None = None, scalars: np.ndarray | None = None,
              classes: np.ndarray | None = None, threads: int = 0, origin: tuple[float, ...] = (0.0,) * 3) -> _CloudDesc:
    count = len(positions)
    return _CloudDesc(count=count, position=_view(positions, count), normal=_view(normals, count),
                      color=_view(colors, count), opacity=_view(opacities, count), radius=_view(radii, count),
                      scalar=_view(scalars, count), classes=_view(classes, count), threads=threads, origin=origin)


def ramp(name: str) -> np.ndarray:
    """(MOST_RAMP, 3) float32, linear: a ramp of the library's."""
    colors = np.empty((MOST_RAMP, 3), np.float32)
    _check(library().patina_ramp(name.encode(), colors.ctypes.data))
    return colors


def start_fingerprint(*arrays: np.ndarray | None) -> Task:
    """A task that gives two numbers: of places, normals, opacities, radii and classes, and of colours and scalars. arrays:
    positions, normals, colors, opacities, radii, scalars, classes."""
    values = (c_uint64 * 2)()
    return Task("fingerprint", byref(_describe(*arrays)), values, keep=(arrays, values), finish=lambda task: tuple(values))


def start_grid_normals(positions: np.ndarray, columns: np.ndarray, rows: np.ndarray, station: Sequence[float]) -> Task:
    """A task that gives (n, 3) normals of a scan's points, towards its scanner, out of its grid; 0 0 0 where there is none."""
    positions = np.ascontiguousarray(positions, np.float32)
    columns, rows = (np.ascontiguousarray(values, np.uint32) for values in (columns, rows))
    normals = np.empty((len(positions), 3), np.float32)
    grid = _GridDesc(count=len(positions), position=positions.ctypes.data, column=columns.ctypes.data, row=rows.ctypes.data,
                     station=tuple(station))
    return Task("grid_normals", byref(grid), None, normals.ctypes.data,
                keep=(positions, columns, rows, normals), finish=lambda task: normals)


class Cloud(_Handle):
    """Points: positions (n, 3); normals (n, 3) or None; colors (n, 3|4), integers sRGB, floats linear, or None;
    opacities (n, 1), floats 0 to 1, or None; origin is added to the positions, in float64; radii of discs (n, 1), floats,
    or None; scalars (n, 1), any numbers, or None; classes (n, 1) uint8 or None."""

    _kind = "cloud"

    def __init__(self, positions: np.ndarray, normals: np.ndarray | None = None, colors: np.ndarray | None = None,
                 progress: Progress | None = None, threads: int = 0, opacities: np.ndarray | None = None,
                 origin: tuple[float, ...] = (0.0,) * 3, radii: np.ndarray | None = None,
                 scalars: np.ndarray | None = None, classes: np.ndarray | None = None) -> None:
        super().__init__(byref(_describe(positions, normals, colors, opacities, radii, scalars, classes, threads, origin)),
                         _handle_of(progress))
        self._learn()

    @classmethod
    def start(cls, positions: np.ndarray, normals: np.ndarray | None, colors: np.ndarray | None,
              opacities: np.ndarray | None, progress: Progress | None = None, radii: np.ndarray | None = None,
              scalars: np.ndarray | None = None, classes: np.ndarray | None = None,
              origin: tuple[float, ...] = (0.0,) * 3) -> Task:
        """A task that gives the cloud."""
        def take(task: Task) -> Cloud:
            cloud = cls.__new__(cls)
            _Handle.__init__(cloud, task._handle, blame=(task._handle,), create="patina_task_take_cloud")
            cloud._learn()
            return cloud

        arrays = (positions, normals, colors, opacities, radii, scalars, classes)
        return Task("build", byref(_describe(*arrays, origin=origin)), _handle_of(progress), keep=(arrays, progress),
                    finish=take)

    @classmethod
    def open(cls, path: Path) -> Cloud:
        """A saved cloud, mapped. PatinaError when it is not one of this version."""
        cloud = cls.__new__(cls)
        _Handle.__init__(cloud, os.fsencode(path), create="patina_cloud_open")
        cloud._learn()
        return cloud

    def start_save(self, path: Path) -> Task:
        """A task that writes the cloud."""
        return Task("save", self._handle, os.fsencode(path), keep=(self,))

    def _learn(self) -> None:
        info = _CloudInfo()
        self._call("get_info", byref(info))
        self.count, self.drawn, self.bytes = info.count, info.drawn, info.bytes
        self.footprint = max(info.bytes, 23 * info.count)  # with what of a mapped file may be in memory
        self.invalid_positions = info.invalid_positions
        self.has_normals = bool(info.has_normals)
        self.has_scalars = bool(info.has_scalars)
        self.has_shapes = bool(info.has_shapes)  # analysed
        self.normals_oriented = bool(info.normals_oriented)
        self.kinds = tuple(info.kinds)  # points of each of KINDS
        self.seen_through = info.seen_through  # points that a station saw through
        self.layer_distance = info.layer_distance  # what d_min = 0 stands for at the median spacing, object units
        self.box = (tuple(info.box_min), tuple(info.box_max))

    def start_colors(self, colors: np.ndarray | None) -> Task:
        """Other colours for the same points; no picture of them may be drawn meanwhile."""
        return Task("set_colors", self._handle, byref(_view(colors, self.count)), keep=(self, colors))

    def _describe_analysis(self, neighbours: int, stations: np.ndarray | None, station: np.ndarray | None,
                           keep_normals: bool, threads: int, free_space: bool, grid: tuple[np.ndarray, np.ndarray] | None
                           ) -> _AnalysisDesc:
        count = 0 if stations is None else len(stations)
        row, column = grid or (None, None)
        return _AnalysisDesc(neighbours=neighbours, threads=threads, keep_normals=keep_normals, station_count=count,
                             stations=stations.ctypes.data if count else None, station=_view(station, self.count),
                             free_space=free_space, row=_view(row, self.count), column=_view(column, self.count))

    def analyse(self, neighbours: int = 0, stations: np.ndarray | None = None, station: np.ndarray | None = None,
                keep_normals: bool = True, progress: Progress | None = None, threads: int = 0, free_space: bool = False,
                grid: tuple[np.ndarray, np.ndarray] | None = None) -> None:
        """Gives points normals, spacings and footprints of their own; as start_colors. stations: (n, 3) places of the
        scanner that normals face, station: (count, 1) uint8 or uint16, which of them saw the point. free_space: marks points
        that another station saw through; grid: row and column of each point, (count, 1) uint16, uint32 or int32."""
        stations = None if stations is None else np.ascontiguousarray(stations, np.float64)
        self._call("analyse", byref(self._describe_analysis(neighbours, stations, station, keep_normals, threads, free_space,
                                                            grid)), _handle_of(progress))
        self._learn()

    def start_analysis(self, neighbours: int = 0, stations: np.ndarray | None = None, station: np.ndarray | None = None,
                       keep_normals: bool = True, progress: Progress | None = None, free_space: bool = False,
                       grid: tuple[np.ndarray, np.ndarray] | None = None, threads: int = 0) -> Task:
        """analyse, beside pictures: its result() changes the cloud, and no picture of it may be drawn then."""
        def apply(task: Task) -> None:
            task._call("apply")
            self._learn()

        stations = None if stations is None else np.ascontiguousarray(stations, np.float64)
        return Task("analyse", self._handle,
                    byref(self._describe_analysis(neighbours, stations, station, keep_normals, threads, free_space, grid)),
                    _handle_of(progress), keep=(self, stations, station, grid, progress), finish=apply)

    def neighbourhoods(self, *names: str, neighbours: int = 16, progress: Progress | None = None,
                       threads: int = 0) -> dict[str, np.ndarray]:
        """Arrays by name: those of NEIGHBOURHOODS that are named, else all that need no walk to neighbours."""
        arrays = {}
        for name in names or list(NEIGHBOURHOODS)[:8]:
            kind, width = NEIGHBOURHOODS[name]
            arrays[name] = np.empty((self.count, neighbours if width < 0 else width) if width else self.count, kind)
        self._call("neighbourhoods", byref(_Neighbourhoods(neighbours=neighbours, threads=threads,
                                                           **{name: a.ctypes.data for name, a in arrays.items()})),
                   _handle_of(progress))
        return arrays

    def set_scalars(self, scalars: np.ndarray | None) -> None:
        """Other scalars for the same points; as start_colors."""
        self._call("set_scalars", byref(_view(scalars, self.count)))
        self.has_scalars = scalars is not None

    def dense_box(self) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Of the points without strays."""
        lower, upper = (c_double * 3)(), (c_double * 3)()
        self._call("dense_box", lower, upper)
        return tuple(lower), tuple(upper)

    def scalar_range(self, share: float) -> tuple[float, float]:
        """The scalars that this share of the points lies below and above."""
        found = (c_float * 2)()
        self._call("scalar_range", share, found)
        return tuple(found)


class Mesh(_Handle):
    """Triangles, three corners each: positions (3 n, 3), normals (3 n, 3) or None, linear colors (3 n, 3|4) or None, all
    float32."""

    _kind = "mesh"

    def __init__(self, positions: np.ndarray, normals: np.ndarray | None, colors: np.ndarray | None) -> None:
        corners = len(positions)
        super().__init__(byref(_MeshDesc(vertex_count=corners, position=_view(positions, corners),
                                         normal=_view(normals, corners), color=_view(colors, corners),
                                         triangle_count=corners // 3)))
        self.count = corners // 3


class File(_Handle):
    """An opened point file. Arrays are float32, 8-bit colours uint8 RGBA (sRGB), other colours float32 (linear)."""

    _kind = "file"

    def __init__(self, path: str, progress: Progress | None = None) -> None:
        super().__init__(os.fsencode(path), _handle_of(progress), create="patina_file_open")
        self._learn()

    @classmethod
    def start(cls, path: str, progress: Progress | None = None) -> Task:
        """A task that gives the file."""
        def take(task: Task) -> File:
            file = cls.__new__(cls)
            _Handle.__init__(file, task._handle, blame=(task._handle,), create="patina_task_take_file")
            file._learn()
            return file

        return Task("open_file", os.fsencode(path), _handle_of(progress), keep=(progress,), finish=take)

    def _learn(self) -> None:
        info = _FileInfo()
        self._call("get_info", byref(info))
        self.format = info.format.decode()
        self.count = info.count
        self.origin = tuple(info.origin)
        self.invalid_positions = info.invalid_positions
        self.attributes = [self._attribute(index) for index in range(info.attributes)]
        self._info = info

    def _attribute(self, index: int) -> str:
        attribute = _FileAttribute()
        self._call("get_attribute", index, byref(attribute))
        return attribute.name.decode("utf-8", "replace")

    def _column(self, call: str, shape: tuple[int, ...], *index: int, dtype: type = np.float32) -> np.ndarray:
        column = np.empty(shape, dtype)
        self._call(call, *index, column.ctypes.data, column.nbytes)
        return column

    def positions(self) -> np.ndarray:
        return self._column("read_positions", (self.count, 3))

    def normals(self) -> np.ndarray | None:
        return self._column("read_normals", (self.count, 3)) if self._info.has_normals else None

    def colors(self) -> np.ndarray | None:
        if not self._info.color_type:
            return None
        if self._info.color_type == _TYPES["uint8"]:
            return self._column("read_colors_u8", (self.count, 4), dtype=np.uint8)
        return self._column("read_colors_f32", (self.count, 4))

    def attribute(self, index: int) -> np.ndarray:
        return self._column("read_attribute", (self.count,), index)

    def stations(self) -> np.ndarray:
        """(n, 3) float64, where the scanner stood, in the file's coordinates: attribute "scan" tells which for a point."""
        count = self._info.stations
        return self._column("read_stations", (count, 3), dtype=np.float64) if count else np.empty((0, 3))


class Scene(_Handle):
    """Clouds, lights, a camera and settings; keyword arguments are the fields of the header's descriptors."""

    _kind = "scene"

    def __init__(self) -> None:
        super().__init__()
        self._clouds: list[Cloud | Mesh] = []  # the native scene points to them

    def add_cloud(self, cloud: Cloud, ramp: bytes = b"", **style: Any) -> None:
        """ramp: linear RGB, float32, two colours or more; empty: black to white."""
        fields = _CloudStyle(**style)
        if ramp:
            colors = np.frombuffer(ramp, np.float32)  # the library copies it
            fields.ramp, fields.ramp_count = colors.ctypes.data, len(colors) // 3
        self._call("add_cloud", cloud._handle, byref(fields))
        self._clouds.append(cloud)

    def add_mesh(self, mesh: Mesh, **style: Any) -> None:
        self._call("add_mesh", mesh._handle, byref(_MeshStyle(**style)))
        self._clouds.append(mesh)

    def add_clip(self, **clip: Any) -> None:
        self._call("add_clip", byref(_Clip(**clip)))

    def add_light(self, **light: Any) -> None:
        self._call("add_light", byref(_LightDesc(**light)))

    def set_camera(self, **camera: Any) -> None:
        self._call("set_camera", byref(_Camera(**camera)))

    def set_settings(self, **settings: Any) -> None:
        self._call("set_settings", byref(_Settings(**settings)))

    def set_effects(self, **effects: Any) -> None:
        self._call("set_effects", byref(_Effects(**effects)))

    def set_lines(self, **lines: Any) -> None:
        self._call("set_lines", byref(_Lines(**lines)))


class Frame(_Handle):
    """Renders scenes on a device and keeps the planes; closes before its device."""

    _kind = "frame"

    def __init__(self, device: Device) -> None:
        super().__init__(device._handle, blame=(device._handle,))
        self._device = device

    def render(self, scene: Scene) -> None:
        if not self._finalizer.alive:
            raise PatinaError("this frame is closed")
        _check(library().patina_frame_render(self._handle, scene._handle), self._handle, scene._handle,
               self._device._handle)

    def start(self, scene: Scene, planes: Sequence[str], height: int, width: int,
              spare: Sequence[np.ndarray] = ()) -> Task:
        """A task that renders, and gives these planes of the picture as read() would. Its size: of the scene's region.
        spare: what start() gave for another picture of these planes and is no longer needed; where it fits it is written
        again, for fresh memory costs more than what is written to it."""
        shapes = [(height, width, PLANES[plane][1]) for plane in planes]
        fits = [values.shape for values in spare] == shapes
        pixels = list(spare) if fits else [np.empty(shape, np.float32) for shape in shapes]
        reads = (_Read * len(pixels))(*(_Read(PLANES[plane][0], values.ctypes.data, values.nbytes)
                                        for plane, values in zip(planes, pixels, strict=True)))
        return Task("render", self._handle, scene._handle, reads, len(reads), keep=(self, self._device, scene, reads, pixels),
                    finish=lambda task: pixels)

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

    def stats(self) -> dict[str, Any]:
        stats = _FrameStats()
        self._call("get_stats", byref(stats))
        values = {name: getattr(stats, name) for name, _ in _FrameStats._fields_[1:]}
        values["expected"] = {name: getattr(stats.expected, name) for name, _ in _ExpectedError._fields_}
        return values

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
        self._panorama = _Panorama(**fields)
        x0, y0, x1, y1 = self._panorama.region
        self._size = (y1 - y0, x1 - x0)

    def camera(self, face: int) -> tuple[dict[str, Any], int]:
        """The fields of a face's camera, and the pixels of its side."""
        camera, side = _Camera(), c_uint32()
        _check(library().patina_panorama_camera(byref(self._panorama), face, byref(camera), byref(side)))
        values = {name: getattr(camera, name) for name, _ in _Camera._fields_[1:]}
        return values | {"world_from_camera": tuple(camera.world_from_camera)}, side.value

    def join(self, plane: str, faces: list[np.ndarray]) -> np.ndarray:
        """The region's plane from those of the six faces, (height, width, channels)."""
        name, _ = split_plane(plane)
        pixels = np.empty((*self._size, faces[0].shape[2]), faces[0].dtype)
        pointers = (c_void_p * 6)(*(face.ctypes.data for face in faces))
        if name == "KEYS":
            _check(library().patina_panorama_join_keys(byref(self._panorama), pointers, pixels.ctypes.data, pixels.nbytes))
        else:
            _check(library().patina_panorama_join(byref(self._panorama), PLANES[name][0], pointers, pixels.ctypes.data,
                                                  pixels.nbytes))
        return pixels
