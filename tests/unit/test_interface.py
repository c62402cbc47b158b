# SPDX-License-Identifier: GPL-3.0-or-later
"""Every function of patina.h with every argument wrong. The cases are made from the headers and addon/native/abi.py: each pointer NULL; each
number NaN, infinite, 0, -1 and the largest; each field of a descriptor likewise; struct_size too small and too large; and valid calls in
random orders. A call returns a code of patina.h and comes back, and the same call with good arguments works afterwards.

What is not tried is what patina.h asks of its caller and no library can check: counts above what an array has, addresses of nothing, and
handles after their end.

    test_interface.py LIBRARY [FUNCTION...]

Each function is tried in a process of its own, so that a crash is one failure, which names the case.
"""

import ctypes
import os
import random
import re
import shutil
import signal
import sys
import tempfile
import threading
import time
from pathlib import Path

sys.dont_write_bytecode = True
ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "addon/native"), str(ROOT / "tests")]
import abi  # noqa: E402
from names import chosen  # noqa: E402

POINTS, ROOM, SIDE = 64, 64 * 64, 16  # arrays are wider than their count, so that another type or stride reads what is there
SECONDS = 300  # that a function may take with all of its cases
DRAWN = 0.25   # seconds, after which a picture is cancelled
ORDERS = 150
FLOATS = (float("nan"), float("inf"), float("-inf"), 0.0, -1.0, 3.4e38, 1e308, -1e308, 5e-324)
COUNTS = {"count", "page_count", "vertex_count", "triangle_count", "ramp_count", "station_count", "direction_count", "corners", "room",
          "stride", "width", "height"}  # what arrays of the caller go by
CODES = set(abi.ERROR.values())
DESTROYS = {"progress", "device", "cloud", "mesh", "texture", "mask", "grade", "field", "scans", "scene", "frame", "file", "task", "builder",
            "rows"}


def declarations() -> dict[str, list[tuple[str, str]]]:
    """function → types and names of its parameters."""
    found = {}
    for header in sorted((ROOT / "native/include/patina").glob("*.h")):
        text = re.sub(r"//[^\n]*", "", header.read_text(encoding="utf-8"))
        for name, inside in re.findall(r"^PATINA_API [^;(#]*?\b(patina_\w+)\(([^;]*?)\);", text, re.M):
            parameters = []
            for each in inside.replace("\n", " ").split(","):
                words = each.strip()
                if words != "void":
                    own = re.search(r"(\w+)((?:\[\w*\])*)$", words)
                    parameters.append((words[:own.start()].strip() + ("*" if own.group(2) else ""), own.group(1)))
            found[name] = parameters
    return found


def camel(name: str) -> str:
    return "".join(part.capitalize() for part in name.removeprefix("patina_").split("_"))


class Stage:
    """Good arguments, made when they are first asked for."""

    def __init__(self, library: ctypes.CDLL, folder: Path) -> None:
        self.library, self.folder, self.handles, self.kept, self.numbers = library, folder, {}, [], 0
        random.seed(7)
        self.floats = (ctypes.c_double * ROOM)(*(random.random() for _ in range(ROOM)))
        self.singles = (ctypes.c_float * ROOM)(*(random.random() for _ in range(ROOM)))
        self.bytes = (ctypes.c_uint8 * (8 * ROOM))(*(random.randrange(256) for _ in range(8 * ROOM)))
        self.zeros = (ctypes.c_uint32 * (2 * ROOM))()
        self.indices = (ctypes.c_uint32 * ROOM)(*(i % POINTS for i in range(ROOM)))
        self.out = (ctypes.c_uint8 * (1 << 20))()

    def call(self, name: str, *arguments: object) -> int:
        return getattr(self.library, name)(*arguments)

    def make(self, name: str, *arguments: object) -> ctypes.c_void_p:
        out = ctypes.c_void_p()
        code = self.call(name, *arguments, ctypes.byref(out))
        if code:
            text = ctypes.create_string_buffer(512)
            self.library.patina_message(None, text, 512)
            raise RuntimeError(f"{name}: {code} {text.value.decode()}")
        return out

    def array(self, what: str) -> abi.Array:
        data, kind, components = {"position": (self.floats, "FLOAT64", 3), "normal": (self.singles, "FLOAT32", 3),
                                  "color": (self.bytes, "UINT8", 3), "opacity": (self.singles, "FLOAT32", 1),
                                  "scalar": (self.singles, "FLOAT32", 1), "classes": (self.bytes, "UINT8", 1),
                                  "radius": (self.singles, "FLOAT32", 1), "uv": (self.singles, "FLOAT32", 2),
                                  "pixels": (self.bytes, "UINT8", 4), "tint": (self.singles, "FLOAT32", 3)}[what]
        return abi.Array(ctypes.addressof(data), abi.TYPE[kind], components, 0)

    def descriptor(self, kind: str) -> ctypes.Structure:
        build = getattr(self, f"_{kind.removeprefix('patina_')}", None)
        return build() if build else getattr(abi, camel(kind))()

    def _cloud_desc(self) -> abi.CloudDesc:
        names = ("position", "normal", "color", "opacity", "scalar", "classes", "radius")
        return abi.CloudDesc(count=POINTS, threads=1, **{name: self.array(name) for name in names})

    def _array(self) -> abi.Array:
        return self.array("color")

    def _device_desc(self) -> abi.DeviceDesc:
        return abi.DeviceDesc(name=b"cpu", threads=1)

    def _settings(self) -> abi.Settings:
        return abi.Settings(width=SIDE, height=SIDE, passes=0xFF)

    def _camera(self) -> abi.Camera:
        return abi.Camera(world_from_camera=(1, 0, 0, .5, 0, 1, 0, .5, 0, 0, 1, 4, 0, 0, 0, 1), left=-.3, right=.3, bottom=-.3, top=.3,
                          near_clip=.1, far_clip=10)

    def _light_desc(self) -> abi.LightDesc:
        return abi.LightDesc(type=1, power=1, direction=(0, 0, -1), shadows=1)

    def _clip(self) -> abi.Clip:
        return abi.Clip(world_from_clip=(1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1))

    def _mesh_desc(self) -> abi.MeshDesc:
        return abi.MeshDesc(vertex_count=POINTS, position=self.array("position"), normal=self.array("normal"),
                            color=self.array("tint"), triangle_count=20, indices=ctypes.addressof(self.indices), uv=self.array("uv"))

    def _texture_desc(self) -> abi.TextureDesc:
        return abi.TextureDesc(width=8, height=8, pixels=self.array("pixels"))

    def _panorama(self) -> abi.Panorama:
        return abi.Panorama(width=32, height=16, world_from_camera=self._camera().world_from_camera, near_clip=.1, far_clip=10)

    def _grid_desc(self) -> abi.GridDesc:
        return abi.GridDesc(count=POINTS, position=ctypes.addressof(self.singles), column=ctypes.addressof(self.indices),
                            row=ctypes.addressof(self.zeros))

    def _pages_desc(self) -> abi.PagesDesc:
        page = abi.Page((0, 0, 0), (1, 1, 1), .1, POINTS, abi.NO_PAGE) if hasattr(abi, "NO_PAGE") else \
            abi.Page((0, 0, 0), (1, 1, 1), .1, POINTS, 0xFFFFFFFF)
        self.kept.append(page)
        return abi.PagesDesc(pages=ctypes.addressof(page), page_count=1, color_type=abi.TYPE["UINT8"], has_normals=1, has_scalars=1,
                             has_classes=1)

    def _part(self) -> abi.Part:
        return abi.Part(part=1, of=2)

    def _scan_grade(self) -> abi.ScanGrade:
        return abi.ScanGrade(1, 1, 1, 0)

    def _scan(self) -> abi.Scan:
        return abi.Scan((0, 0, 1), .1)

    def _pick(self) -> abi.Pick:
        return abi.Pick(polygon=ctypes.addressof(self.floats), corners=3, threads=1)

    def _read(self) -> abi.Read:
        return abi.Read(0, ctypes.addressof(self.out), SIDE * SIDE * 16)

    def _neighbourhoods(self) -> abi.Neighbourhoods:
        return abi.Neighbourhoods(normal=ctypes.addressof(self.out), neighbours=8, threads=1, numbers=ctypes.addressof(self.out))

    def path(self, kind: str) -> bytes:
        """Of a file that is there: "ply", "cloud", "keys", "shadows"; "new" is not, "folder" is one."""
        if kind == "folder":
            return os.fsencode(self.folder)
        if kind == "new":
            self.numbers += 1
            return os.fsencode(self.folder / f"{self.numbers % 8}.out")
        file = os.fsencode(self.folder / f"good.{kind}")
        if not os.path.exists(file):
            if kind == "ply":
                desc = self._cloud_desc()
                self.call("patina_write_ply", file, ctypes.byref(desc))
            elif kind == "cloud":
                self.call("patina_cloud_save", self.handle("cloud"), file)
            elif kind == "keys":
                self.call("patina_frame_scatter", self.handle("frame"), self.plain_scene(), ctypes.byref(self._part()), file)
            else:
                self.call("patina_frame_bake_shadows", self.handle("frame"), self.handle("scene"))
                self.call("patina_frame_save_shadows", self.handle("frame"), file)
            assert os.path.exists(file), kind
        return file

    def handle(self, kind: str, name: str = "") -> ctypes.c_void_p:
        key = "pages" if kind == "cloud" and name == "pages" else kind
        if key not in self.handles:
            self.handles[key] = getattr(self, f"new_{key}")()
        return self.handles[key]

    def new_progress(self) -> ctypes.c_void_p:
        return self.make("patina_progress_create")

    def new_device(self) -> ctypes.c_void_p:
        return self.make("patina_device_create", ctypes.byref(self._device_desc()))

    def new_cloud(self) -> ctypes.c_void_p:
        return self.make("patina_cloud_create", ctypes.byref(self._cloud_desc()), None)

    def new_pages(self) -> ctypes.c_void_p:
        return self.make("patina_cloud_pages_begin", ctypes.byref(self._pages_desc()))

    def new_mesh(self) -> ctypes.c_void_p:
        return self.make("patina_mesh_create", ctypes.byref(self._mesh_desc()))

    def new_texture(self) -> ctypes.c_void_p:
        return self.make("patina_texture_create", ctypes.byref(self._texture_desc()))

    def new_mask(self) -> ctypes.c_void_p:
        return self.make("patina_mask_create", self.handle("cloud"), self.bytes, self.bytes, POINTS // 8)

    def new_grade(self) -> ctypes.c_void_p:
        return self.make("patina_grade_create", self.handle("cloud"), None, ctypes.byref(self._scan_grade()), 1)

    def new_scans(self) -> ctypes.c_void_p:
        return self.make("patina_scans_create", self.handle("cloud"), None, ctypes.byref(self._scan()), 1)

    def new_field(self) -> ctypes.c_void_p:
        desc = abi.FieldDesc(source=abi.FIELD_SOURCE["LUMINANCE"])
        return self.make("patina_field_create", self.handle("cloud"), ctypes.byref(desc), None)

    def new_scene(self) -> ctypes.c_void_p:
        scene = self.make("patina_scene_create")
        self.set_scene(scene)
        return scene

    def set_scene(self, scene: ctypes.c_void_p) -> None:
        style = abi.CloudStyle(lighting=2)
        for name, argument in (("clear", None), ("add_cloud", style), ("add_mesh", abi.MeshStyle()), ("add_light", self._light_desc()),
                               ("set_camera", self._camera()), ("set_settings", self._settings()), ("set_effects", abi.Effects())):
            more = [self.handle("cloud")] if name == "add_cloud" else [self.handle("mesh")] if name == "add_mesh" else []
            code = self.call(f"patina_scene_{name}", scene, *more, *([ctypes.byref(argument)] if argument else []))
            assert not code, (name, code)
        self.call("patina_scene_set_lines", scene, None)

    def plain_scene(self) -> ctypes.c_void_p:
        """One that may be divided among machines."""
        scene = self.make("patina_scene_create")
        desc = abi.CloudDesc(count=POINTS, threads=1, position=self.array("position"))
        cloud = self.make("patina_cloud_create", ctypes.byref(desc), None)
        for name, *arguments in (("add_cloud", cloud, None), ("set_camera", ctypes.byref(self._camera())),
                                 ("set_settings", ctypes.byref(self._settings()))):
            assert not self.call(f"patina_scene_{name}", scene, *arguments), name
        return scene

    def new_frame(self) -> ctypes.c_void_p:
        frame = self.make("patina_frame_create", self.handle("device"))
        assert not self.call("patina_frame_render", frame, self.handle("scene"))
        return frame

    def new_file(self) -> ctypes.c_void_p:
        return self.make("patina_file_open", self.path("ply"), None)

    def new_rows(self) -> ctypes.c_void_p:
        return self.make("patina_rows_open", self.path("ply"), None)

    def new_builder(self) -> ctypes.c_void_p:
        return self.make("patina_builder_begin", self.path("new"), None)

    def new_task(self) -> ctypes.c_void_p:
        return self.make("patina_task_build", ctypes.byref(self._cloud_desc()), None)

    def good(self, function: str, kind: str, name: str, result: str = "") -> object:
        """A good argument for a parameter."""
        plain = kind.replace("const ", "").replace("const", "").replace(" ", "")
        stars, plain = plain.count("*"), plain.replace("*", "")
        if plain == "char" and stars == 1:
            return self._text(function, kind, name)
        if plain == "void" or stars == 2 and "out" not in name:
            return self._void(function, name)
        if stars == 2:
            return ctypes.byref(ctypes.c_void_p())
        if plain.removeprefix("patina_") in DESTROYS and stars == 1:
            own = plain.removeprefix("patina_")
            return self.handle(own, "pages" if "page" in function or "wanted" in function else "")
        if hasattr(abi, camel(plain)) and plain.startswith("patina_"):
            made = self.descriptor(plain)
            self.kept = [*self.kept[-50:], made]
            return ctypes.byref(made)
        return self._numbers(function, plain, stars, name)

    def _text(self, function: str, kind: str, name: str) -> object:
        if "const" not in kind:
            return ctypes.cast(self.out, ctypes.c_char_p)
        if name == "scalar":
            return None
        if function == "patina_ramp":
            return b"viridis"
        if name in ("from",) or function in ("patina_cloud_open", "patina_cloud_open_at", "patina_cloud_verify", "patina_task_verify"):
            return self.path("cloud")
        if "keys" in function:
            return self.path("keys")
        if "load_shadows" in function:
            return self.path("shadows")
        if "dump_planes" in function:
            return self.path("folder")
        if function in ("patina_file_open", "patina_rows_open", "patina_cloud_load", "patina_task_open_file"):
            return self.path("ply")
        return self.path("new")

    def _void(self, function: str, name: str) -> object:
        if function == "patina_message":
            return self.handle("scene")
        if name == "faces":
            faces = (ctypes.c_void_p * 6)(*[ctypes.addressof(self.out)] * 6)
            self.kept.append(faces)
            return faces
        if name == "paths":
            paths = (ctypes.c_void_p * 2)()
            self.kept += [paths, ctypes.c_char_p(self.path("keys"))]
            paths[0] = paths[1] = ctypes.cast(self.kept[-1], ctypes.c_void_p).value
            return paths
        return ctypes.cast(self.bytes, ctypes.c_void_p)

    def _numbers(self, function: str, plain: str, stars: int, name: str) -> object:
        if stars:
            source = {"double": self.floats, "uint16_t": self.zeros, "uint8_t": self.bytes}.get(plain, self.singles)
            writes = name in ("xyz", "rgba", "values", "pixels", "keys", "numbers", "bits", "count", "round", "size", "range", "colors",
                              "normals", "box_min", "box_max", "pages", "level")
            return ctypes.cast(self.out if writes or "read" in function else source, ctypes.c_void_p)
        sizes = {"patina_mask_create": POINTS // 8, "patina_scene_pick": POINTS // 8, "patina_frame_read": SIDE * SIDE * 16,
                 "patina_frame_read_layer": SIDE * SIDE * 16, "patina_frame_read_keys": SIDE * SIDE * 8,
                 "patina_frame_read_numbers": SIDE * SIDE * 8, "patina_frame_read_shadows": POINTS * 4,
                 "patina_frame_highlight": SIDE * SIDE * 16, "patina_panorama_join": 32 * 16 * 16,
                 "patina_panorama_join_keys": 32 * 16 * 8}
        if plain in ("float", "double"):
            return 0.25
        return {"size": sizes.get(function, len(self.out)), "count": 1, "most": 10, "room": 4, "level": 1, "layer": 1,
                "threads": 1}.get(name, 0)


def wrong_numbers(plain: str) -> tuple:
    if plain in ("float", "double"):
        return FLOATS
    bits = {"uint32_t": 32, "uint64_t": 64, "size_t": 64, "int": 32}[plain]
    return (0, 1, (1 << bits - 1) - 1, (1 << bits - 1) if plain != "int" else -1, (1 << bits) - 1 if plain != "int" else -1000)


def wrong_descriptors(good: ctypes.Structure) -> list[tuple[str, object]]:
    """Names of what is wrong, and such descriptors."""
    cases, size = [], ctypes.sizeof(good)
    has_size = good._fields_[0][0] == "struct_size"

    def changed(name: str) -> tuple[ctypes.Structure, object]:
        copy = type(good).from_buffer_copy(bytes(good))
        return copy, getattr(copy, name)

    for told in (0, 1, 8, 9, 12, 16, size - 8, size - 1) if has_size else ():
        copy, _ = changed("struct_size")
        copy.struct_size = told
        cases.append((f"struct_size {told} of {size}", copy))
    for told, tail in ((size + 64, 0), (size + 64, 1), (1 << 30, None), ((1 << 64) - 1, None)) if has_size else ():
        if tail is None:
            continue  # memory behind a descriptor belongs to whoever says that it is part of it
        room = (ctypes.c_uint8 * (size + 64))(*bytes(good), *[tail] * 64)
        ctypes.c_size_t.from_buffer(room).value = told
        cases.append((f"struct_size {told}, {'zeros' if not tail else 'something'} behind", room))
    for name, kind in good._fields_[1 if has_size else 0:]:
        if kind is abi.Array:
            for field, values in (("data", (None,)), ("type", (0, 1, 2, 9, 0xFFFFFFFF)), ("components", (0, 1, 5, 0xFFFFFFFF)),
                                  ("stride", (0, 1, 3))):
                for value in values:
                    copy, array = changed(name)
                    setattr(array, field, value)
                    cases.append((f"{name}.{field} = {value}", copy))
        elif issubclass(kind, ctypes.Array):
            item = kind._type_
            values = FLOATS if item in (ctypes.c_float, ctypes.c_double) else () if item is ctypes.c_char else wrong_numbers("uint32_t")
            for value in values:
                for which in (range(kind._length_), (0,)):
                    copy, array = changed(name)
                    for i in which:
                        array[i] = value
                    cases.append((f"{name}[{'all' if len(which) > 1 else 0}] = {value}", copy))
        elif kind in (ctypes.c_float, ctypes.c_double):
            for value in FLOATS:
                copy, _ = changed(name)
                setattr(copy, name, value)
                cases.append((f"{name} = {value}", copy))
        elif kind in (ctypes.c_uint32, ctypes.c_uint64, ctypes.c_size_t):
            bits = 8 * ctypes.sizeof(kind)
            values = (0, 1) if name in COUNTS else (0, 1, 2, 7, (1 << bits - 1) - 1, (1 << bits) - 1)
            values += ((1 << 63), (1 << 64) - 1) if name == "count" and bits == 64 else ()
            for value in values:
                copy, _ = changed(name)
                setattr(copy, name, value)
                cases.append((f"{name} = {value}", copy))
        elif kind in (ctypes.c_void_p, ctypes.c_char_p):
            copy, _ = changed(name)
            setattr(copy, name, None)
            cases.append((f"{name} = NULL", copy))
    return cases


def cases_of(stage: Stage, function: str, parameters: list[tuple[str, str]]) -> list[tuple[str, int, object]]:
    """What is wrong, of which parameter, and the argument."""
    cases = []
    for i, (kind, name) in enumerate(parameters):
        plain = kind.replace("const", "").replace(" ", "")
        if "*" in plain:
            cases.append((f"{name} = NULL", i, None))
            own = plain.replace("*", "")
            if own == "char" and "const" in kind and plain.count("*") == 1:
                cases += [(f"{name} = {text[:40]!r}", i, text) for text in
                          (b"", b"/nowhere/file", stage.path("folder"), b"/dev/null", b"x" * 5000, b"\xff\xfe", stage.path("ply"))]
            if own.startswith("patina_") and hasattr(abi, camel(own)) and own.removeprefix("patina_") not in DESTROYS:
                cases += [(f"{name}: {what}", i, ctypes.byref(made)) for what, made in wrong_descriptors(stage.descriptor(own))]
        else:
            values = (0, 1) if name in COUNTS or name == "size" and "message" not in function and "read" not in function else \
                wrong_numbers(plain)
            if name == "size":
                values = tuple(value for value in values if value < len(stage.out)) + (3,)
            cases += [(f"{name} = {value}", i, value) for value in values]
    return cases


def draw(stage: Stage) -> None:
    """The scene, such as it is by now: any code, and it comes back."""
    frame, scene = stage.handle("frame"), stage.handle("scene")
    timer = threading.Timer(DRAWN, lambda: stage.call("patina_frame_cancel", frame))
    timer.start()
    code = stage.call("patina_frame_render", frame, scene)
    timer.cancel()
    assert code in CODES, code


def finish(stage: Stage, function: str, arguments: list, parameters: list) -> None:
    """What the call gave is used once, and destroyed."""
    if parameters and parameters[-1][1] == "out" and "patina_task" in parameters[-1][0] and isinstance(arguments[-1], type(ctypes.byref(ctypes.c_int()))):
        task = arguments[-1]._obj
        if task.value:
            assert stage.call("patina_task_wait", task) in CODES
            if "analyse" in function:
                assert stage.call("patina_task_apply", task) in CODES
            stage.library.patina_task_destroy(task)
        return
    if parameters and parameters[-1][1] == "out" and arguments[-1] is not None:
        made, kind = arguments[-1]._obj, parameters[-1][0].replace("const", "").replace("*", "").strip()
        if made.value:
            getattr(stage.library, f"{kind}_destroy")(made)
            made.value = None


def try_call(stage: Stage, function: str, parameters: list, place: int = -1, argument: object = None) -> object:
    arguments = [argument if i == place else stage.good(function, kind, name) for i, (kind, name) in enumerate(parameters)]
    drawn = [i for i, (kind, _) in enumerate(parameters) if "patina_frame *" in kind or "patina_frame*" in kind]
    timer = None
    if drawn and arguments[drawn[0]] and function != "patina_frame_destroy":
        frame = arguments[drawn[0]]
        timer = threading.Timer(DRAWN, lambda: stage.call("patina_frame_cancel", frame))
        timer.start()
    result = getattr(stage.library, function)(*arguments)
    if timer:
        timer.cancel()
    finish(stage, function, arguments, parameters)
    return result


def renew(stage: Stage, function: str) -> None:
    """The handles that a function uses up or changes, as new."""
    for kind in ("builder", "rows", "task", "pages"):
        if kind in stage.handles:
            handle = stage.handles.pop(kind)
            getattr(stage.library, f"patina_{'cloud' if kind == 'pages' else kind}_destroy")(handle)
    if "scene" in stage.handles:
        stage.set_scene(stage.handles["scene"])


def try_function(stage: Stage, function: str, parameters: list, tell: object) -> int:
    codes = abi.RESULTS.get(function, ctypes.c_int) is ctypes.c_int and function not in ("patina_task_done",)
    tried = 0
    if function.endswith("_destroy"):
        tell("NULL")
        getattr(stage.library, function)(None)
        return 1
    tell("good arguments")
    first = try_call(stage, function, parameters)
    assert not codes or first in CODES, first
    renew(stage, function)
    for what, place, argument in cases_of(stage, function, parameters):
        tell(what)
        result = try_call(stage, function, parameters, place, argument)
        assert not codes or result in CODES, f"returned {result}"
        if "scene_set" in function or "scene_add" in function:
            draw(stage)
        renew(stage, function)
        tried += 1
    tell("good arguments once more")
    again = try_call(stage, function, parameters)
    assert not codes or again == first or first in (abi.ERROR["ERROR_CANCELLED"],), f"returned {again}, and {first} at first"
    return tried


def try_orders(stage: Stage, all_of_them: dict, tell: object) -> int:
    """Good calls in any order: of what was never drawn, of what is over, twice."""
    random.seed(49)
    usable = [name for name in all_of_them if not name.endswith("_destroy") and name not in ("patina_progress_cancel", "patina_frame_cancel")]
    for _ in range(ORDERS):
        way = []
        for kind in ("frame", "builder", "rows", "task"):
            if kind in stage.handles:
                getattr(stage.library, f"patina_{kind}_destroy")(stage.handles.pop(kind))
        stage.handles["frame"] = stage.make("patina_frame_create", stage.handle("device"))  # nothing was drawn in it
        for name in random.choices(usable, k=12):
            way.append(name.removeprefix("patina_"))
            tell(", ".join(way))
            result = try_call(stage, name, all_of_them[name])
            assert abi.RESULTS.get(name, ctypes.c_int) is not ctypes.c_int or name == "patina_task_done" or result in CODES, result
        if "scene" in stage.handles:
            stage.set_scene(stage.handles["scene"])
    return ORDERS


def try_alone(library: str, function: str, all_of_them: dict) -> tuple[bool, str]:
    """In a process of its own: whether all went well, and how many cases, or what went wrong in which."""
    here, there = os.pipe()
    child = os.fork()
    if not child:
        os.close(here)
        signal.alarm(SECONDS)
        folder = Path(tempfile.mkdtemp())
        last = [""]

        def tell(what: str) -> None:
            last[0] = what
            os.write(there, b"\0" + what.encode(errors="replace")[:600])

        status = 1
        try:
            os.chdir(folder)
            loaded = ctypes.CDLL(library)
            for name, types in abi.CALLS.items():
                getattr(loaded, name).restype = abi.RESULTS.get(name, ctypes.c_int)
                getattr(loaded, name).argtypes = [ctypes.c_void_p if kind not in SIMPLE else kind for kind in types]
            stage = Stage(loaded, folder)
            count = try_orders(stage, all_of_them, tell) if function == "orders" else \
                try_function(stage, function, all_of_them[function], tell)
            os.write(there, b"\0" + str(count).encode())
            status = 0
        except BaseException as error:  # noqa: BLE001 - the process ends with it
            os.write(there, b"\0" + f"{last[0]}: {type(error).__name__}: {error}".encode()[:600])
        shutil.rmtree(folder, ignore_errors=True)
        os._exit(status)
    os.close(there)
    told = b""
    while part := os.read(here, 1 << 16):
        told = (told + part)[-4000:]
    os.close(here)
    _, status = os.waitpid(child, 0)
    what = told.rsplit(b"\0", 1)[-1].decode(errors="replace")
    if os.WIFSIGNALED(status):
        end = signal.Signals(os.WTERMSIG(status)).name
        return False, f"{what}: {'took too long' if end == 'SIGALRM' else end}"
    return os.WEXITSTATUS(status) == 0, what


SIMPLE = {ctypes.c_int, ctypes.c_uint32, ctypes.c_uint64, ctypes.c_size_t, ctypes.c_float, ctypes.c_double, ctypes.c_char_p}


def main() -> int:
    library, wanted = str(Path(sys.argv[1]).resolve()), sys.argv[2:]
    all_of_them = declarations()
    missing = set(abi.CALLS) ^ set(all_of_them)
    assert not missing, f"declarations that were not understood: {missing}"
    passed = failed = cases = 0
    start = time.monotonic()
    for function in chosen([*all_of_them, "orders"], wanted):
        good, told = try_alone(library, function, all_of_them)
        passed, failed = passed + good, failed + (not good)
        cases += int(told) if good else 0
        if not good:
            print(f"FAILED {function} ({told})", flush=True)
    print(f"{cases} cases of {len(all_of_them)} functions, {time.monotonic() - start:.0f} s")
    print(f"{passed} passed, {failed} failed, 0 skipped")
    return int(failed > 0)


sys.exit(main())
