# SPDX-License-Identifier: GPL-3.0-or-later
"""Good arguments for every function of patina.h, made from its headers and addon/native/abi.py: what test_interface.py calls with."""

import ctypes
import os
import random
import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "addon/native"))
import abi  # noqa: E402

POINTS, ROOM, SIDE, TEXELS = 64, 64 * 64, 16, 32  # arrays are wider than their count, so that another type or stride reads what is there
CODES = set(abi.ERROR.values())
DESTROYS = {"progress", "device", "cloud", "mesh", "texture", "mask", "grade", "field", "scans", "scene", "frame", "file", "task", "builder",
            "rows", "drawing"}


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
        # By default the light's map has 4096 x 4096 texels, since the mesh is sharp: 70 ms of a processor a picture, in place of 0.2
        return abi.Settings(width=SIDE, height=SIDE, passes=0xFF, shadow_resolution=TEXELS)

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

    def _distance_desc(self) -> abi.DistanceDesc:
        return abi.DistanceDesc(count=POINTS, other_count=POINTS, position=self.array("position"), normal=self.array("normal"),
                                other=self.array("position"), normal_scale=.5, cylinder=.5, depth=1, threads=1)

    def _ground_desc(self) -> abi.GroundDesc:
        return abi.GroundDesc(count=POINTS, position=self.array("position"), cell=.1, threads=1)

    def _pages_desc(self) -> abi.PagesDesc:
        page = abi.Page((0, 0, 0), (1, 1, 1), .1, POINTS, 0xFFFFFFFF)  # the last: PATINA_NO_PAGE
        self.kept.append(page)
        return abi.PagesDesc(pages=ctypes.addressof(page), page_count=1, color_type=abi.TYPE["UINT8"], has_normals=1, has_scalars=1,
                             has_classes=1)

    def _drawing_desc(self) -> abi.DrawingDesc:
        return abi.DrawingDesc(origin=(.5, .5, .5), right=(1, 0, 0), up=(0, 1, 0), extent=(2, 2), front=1, back=1, scale=10)

    def _contour_desc(self) -> abi.ContourDesc:
        return abi.ContourDesc(interval=.1, cell=.1, threads=1)

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

    def new_drawing(self) -> ctypes.c_void_p:
        return self.make("patina_drawing_create", ctypes.byref(self._drawing_desc()))

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
        if function == "patina_drawing_write":
            return self.path("new") + b".svg"
        return self.path("new")

    def _void(self, function: str, name: str) -> object:
        if function == "patina_message":
            return self.handle("scene")
        if name == "faces":
            faces = (ctypes.c_void_p * 6)(*[ctypes.addressof(self.out)] * 6)
            self.kept.append(faces)
            return faces
        if name == "clouds":
            clouds = (ctypes.c_void_p * 1)(self.handle("cloud"))
            self.kept.append(clouds)
            return clouds
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
                              "normals", "box_min", "box_max", "pages", "level", "distance", "interval", "height", "ground")
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
