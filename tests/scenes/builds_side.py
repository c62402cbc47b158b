# SPDX-License-Identifier: GPL-3.0-or-later
"""One of two builds, in a process of its own, with the binding of its own tree: structures may differ between the two.

    builds_side.py LIBRARY ADDON DEVICE [THREADS]

Reads a line of JSON from standard input for each thing to do and answers with one: {"draw": case} draws a scene (builds_cases.py)
and gives {plane: sum of its bytes}; {"save": path} writes the planes drawn last as .npz. {"time": case, "turn": degrees} draws it with
what a former one left, the camera turned, and gives {"ms": .., "work": ..}, the latter of all threads. What cannot be done is {"error": sentence}, what this side's
header has no name for {"unknown": name}.
"""

from __future__ import annotations

import hashlib
import json
import os
import sys
import tempfile
import time
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import numpy as np

if __name__ == "__main__":
    os.environ["PATINA_LIBRARY"] = sys.argv[1]
    sys.path[:0] = [sys.argv[2], str(Path(__file__).resolve().parents[1])]

from builds_shapes import CLOUDS, meshes, texture  # noqa: E402
from truth.camera import orbit, parallel  # noqa: E402

import native  # noqa: E402
from native import points  # noqa: E402

Planes = dict[str, np.ndarray]
STATS = ("width", "height", "points", "points_scattered", "triangles", "chunks", "chunks_culled", "layers", "spacing_px", "shadow_maps", "shadow_width",
         "shadow_height", "shadow_pending", "shadow_samples", "shadow_error", "chunks_clipped", "chunks_cut", "pixel_samples", "pixel_pending",
         "pixel_error")


class Unknown(Exception):
    """The header of this side has no such field or constant."""


def constant(value: Any) -> Any:
    """"SURFACE.SPLATS" → its number."""
    if not isinstance(value, str):
        return value
    kind, _, name = value.partition(".")
    try:
        return getattr(native.abi, kind)[name]
    except (AttributeError, KeyError):
        raise Unknown(value) from None


def fields(kind: type, given: dict[str, Any]) -> dict[str, Any]:
    known = {name for name, *_ in kind._fields_}
    for name in given:
        if name not in known:
            raise Unknown(f"{kind.__name__}.{name}")
    return {name: constant(value) for name, value in given.items()}


class Side:
    def __init__(self, device: str, threads: int) -> None:
        self.device = native.Device(device, threads)
        self.clouds: dict[tuple[str, bool], native.Cloud] = {}
        self.kept: tuple[str, native.Frame, native.Scene] | None = None

    def cloud(self, name: str, mapped: bool) -> native.Cloud:
        if (name, mapped) not in self.clouds:
            recipe = dict(CLOUDS[name]())
            analysis = recipe.pop("analysis", None)
            cloud = native.Cloud(**recipe)
            if analysis is not None:
                cloud.analyse(**analysis)
            if mapped:
                with tempfile.TemporaryDirectory() as folder:
                    path = Path(folder) / "cloud"
                    cloud.start_save(path).result()
                    cloud = native.Cloud.open(path)
            self.clouds[name, mapped] = cloud
        return self.clouds[name, mapped]

    def camera(self, case: dict[str, Any], turn: float = 30.0) -> dict[str, Any]:
        width, height = case["size"]
        how: dict[str, Any] = {"kind": "perspective", "distance": 3.6, "elevation": 40.0, "shift": (0.0, 0.0), "near": 0.1, "far": 100.0} | case.get("camera", {})
        camera = orbit(turn, how["elevation"], how["distance"], aspect=width / height)
        if how["kind"] == "parallel":
            return parallel(camera, how["distance"]).fields()
        found = camera.fields() | {"near_clip": how["near"], "far_clip": how["far"]}
        for sides, shift in ((("left", "right"), how["shift"][0]), (("bottom", "top"), how["shift"][1])):
            for side in sides:
                found[side] += shift
        return found

    def scene(self, case: dict[str, Any], turn: float = 30.0, **settings: Any) -> native.Scene:
        scene = native.Scene()
        for each in case["clouds"]:
            style = dict(each)
            cloud = self.cloud(style.pop("of"), bool(style.pop("mapped", 0)))
            more: dict[str, Any] = {"ramp": np.array(style.pop("ramp", ()), np.float32).tobytes()}
            if style.pop("mask", 0):
                number = np.arange(cloud.count)
                more["mask"] = points.Mask(cloud, np.packbits(number % 5 == 0, bitorder="little"), np.packbits(number % 3 == 0, bitorder="little"))
            if "field" in style and not hasattr(points, "Field"):
                raise Unknown("points.Field")
            if "field" in style:
                more["field"] = points.Field(cloud, (np.arange(cloud.count) % style.pop("field") / 100.0).astype(np.float32))
            if "grade" in style:
                more["grade"] = points.Grade(cloud, (np.arange(cloud.count) % 3).astype(np.uint16), style.pop("grade"))
            scene.add_cloud(cloud, **more, **fields(native.abi.CloudStyle, style))
        for each in case.get("meshes", ()):
            style = dict(each)
            mesh, image = native.Mesh(**meshes(style.pop("of"))), style.pop("texture", None)
            scene.add_mesh(mesh, native.Texture(*texture(image)) if image else None, **fields(native.abi.MeshStyle, style))
        for light in case["lights"]:
            scene.add_light(**fields(native.abi.LightDesc, light))
        for clip in case.get("clips", ()):
            scene.add_clip(**fields(native.abi.Clip, clip))
        if "effects" in case:
            scene.set_effects(**fields(native.abi.Effects, case["effects"]))
        if "lines" in case:
            scene.set_lines(**fields(native.abi.Lines, case["lines"]))
        width, height = case["size"]
        given = {"width": width, "height": height, "world_color": [0.05, 0.06, 0.08]} | case.get("settings", {}) | settings
        scene.set_settings(**fields(native.abi.Settings, given))
        scene.set_camera(**self.camera(case, turn))
        return scene

    def draw(self, case: dict[str, Any]) -> Planes:
        with ExitStack() as held:
            frame, scene = held.enter_context(native.Frame(self.device)), held.enter_context(self.scene(case))
            return WAYS[case.get("do", "render")](self, case, frame, scene)

    def time(self, case: dict[str, Any], turn: float) -> dict[str, float]:
        """Milliseconds of a picture, in the frame that the last one of that name was drawn in."""
        if self.kept is None or self.kept[0] != case["name"]:
            self.kept = (case["name"], native.Frame(self.device), self.scene(case))
        _, frame, _ = self.kept
        scene = self.scene(case, turn)
        start, busy = time.perf_counter(), time.process_time()
        frame.render(scene)
        spent = {"ms": 1e3 * (time.perf_counter() - start), "work": 1e3 * (time.process_time() - busy)}
        self.kept = (case["name"], frame, scene)
        return spent


def seen(case: dict[str, Any], frame: native.Frame, before: str = "") -> Planes:
    """All that a frame can tell of its picture."""
    stats, planes = frame.stats(), {}
    wanted = constant(case.get("settings", {}).get("passes", 0))
    for name, (number, _) in native.PLANES.items():
        if not wanted or number == 0 or wanted >> number & 1:
            planes[f"{before}{name}"] = frame.read(name)
    planes[f"{before}KEYS"] = frame.read_keys()
    layered = case.get("settings", {}).get("layer_passes", 0)
    for layer in range(1, case.get("settings", {}).get("layers", 8) + 1) if layered else ():
        for name, (number, _) in native.PLANES.items():
            if layered >> number & 1:
                planes[f"{before}{name} {layer}"] = frame.read(f"{name} {layer}")
    planes[f"{before}stats"] = np.array([stats[name] for name in STATS], np.float64)
    return planes


def _render(side: Side, case: dict[str, Any], frame: native.Frame, scene: native.Scene) -> Planes:
    frame.render(scene)
    return seen(case, frame)


def _again(side: Side, case: dict[str, Any], frame: native.Frame, scene: native.Scene) -> Planes:
    planes: Planes = {}
    for step in range(5):
        frame.render(scene)
        planes |= seen(case, frame, f"{step}: ")
    return planes


def _refine(side: Side, case: dict[str, Any], frame: native.Frame, scene: native.Scene) -> Planes:
    frame.render(scene)
    planes = seen(case, frame, "first: ")
    while frame.stats()["pixel_pending"]:
        frame.refine(scene, 1000.0)
    return planes | seen(case, frame, "last: ")


def _crop(side: Side, case: dict[str, Any], frame: native.Frame, scene: native.Scene) -> Planes:
    frame.render(scene)
    planes = seen(case, frame, "whole: ")
    with side.scene(case, region=[31, 20, 117, 89]) as part:
        frame.render(part)
    return planes | seen(case, frame, "part: ")


def _panorama(side: Side, case: dict[str, Any], frame: native.Frame, scene: native.Scene) -> Planes:
    width, height = case["size"]
    given = {"width": width, "height": height, "region": [0, 0, width, height], "world_from_camera": side.camera(case)["world_from_camera"],
             "near_clip": 0.05, "far_clip": 50.0} | case.get("panorama", {})
    panorama, faces = native.Panorama(**fields(native.abi.Panorama, given)), []
    for face in range(native.Panorama.FACES):
        camera, pixels = panorama.camera(face)
        with side.scene(case, width=pixels, height=pixels) as part:
            part.set_camera(**camera)
            frame.render(part)
        faces.append({name: frame.read(name) for name in ("COMBINED", "DEPTH", "NORMAL")} | {"KEYS": frame.read_keys()})
    return {name: panorama.join(name, [face[name] for face in faces]) for name in faces[0]}


def _shadows(side: Side, case: dict[str, Any], frame: native.Frame, scene: native.Scene) -> Planes:
    return {f"shadow {instance} {light}": frame.shadows(instance, light, cloud.count) for instance, cloud in enumerate(scene.clouds)
            for light in range(sum(bool(light.get("shadows")) for light in case["lights"]))}


def _bake(side: Side, case: dict[str, Any], frame: native.Frame, scene: native.Scene) -> Planes:
    frame.bake_shadows(scene)
    return _shadows(side, case, frame, scene) | _render(side, case, frame, scene)


def _shadow_file(side: Side, case: dict[str, Any], frame: native.Frame, scene: native.Scene) -> Planes:
    frame.bake_shadows(scene)
    with tempfile.TemporaryDirectory() as folder, native.Frame(side.device) as other:
        path = str(Path(folder) / "shadows")
        frame.save_shadows(path)
        other.load_shadows(scene, path)
        return _render(side, case, other, scene) | _shadows(side, case, other, scene)


def _pick(side: Side, case: dict[str, Any], frame: native.Frame, scene: native.Scene) -> Planes:
    planes = _render(side, case, frame, scene)
    width, height = case["size"]
    outline = np.array([[0.2, 0.2], [0.8, 0.3], [0.6, 0.9]]) * (width, height)
    for instance in range(len(scene.clouds)):
        planes[f"picked {instance}"] = points.pick(scene, instance, outline, frame)
        planes[f"picked through {instance}"] = points.pick(scene, instance, outline)
    pixels = planes["COMBINED"].copy()
    points.highlight(frame, scene, pixels, (1.0, 0.5, 0.0), 0.5)
    return planes | {"highlit": pixels}


def _neighbourhoods(side: Side, case: dict[str, Any], frame: native.Frame, scene: native.Scene) -> Planes:
    cloud = scene.clouds[0]
    return cloud.neighbourhoods() | cloud.neighbourhoods("numbers", "distances", "soft_radius", "uncertainty", neighbours=7)


def _file(side: Side, case: dict[str, Any], frame: native.Frame, scene: native.Scene) -> Planes:
    """Columns of the corpus' files that are good, and a picture of one that was written as text."""
    planes: Planes = {}
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "points.xyz"
        recipe = CLOUDS["torus"]()
        np.savetxt(path, np.concatenate([recipe["positions"], recipe["colors"]], axis=1), fmt="%.4f %.4f %.4f %d %d %d")
        for each in [path, *sorted((Path(__file__).resolve().parents[1] / "fuzz/corpus").glob("*/*"))]:
            try:
                file = native.File(str(each))
            except native.PatinaError as error:
                planes[f"{each.name} error"] = np.frombuffer(str(error).replace(folder, "").encode(), np.uint8)
                continue
            with file:
                for what in ("positions", "normals", "colors", "stations"):
                    values = getattr(file, what)()
                    if values is not None:
                        planes[f"{each.name} {what}"] = values
                for index, name in enumerate(file.attributes):
                    planes[f"{each.name} {name}"] = file.attribute(index)
    return planes | _render(side, case, frame, scene)


def _life(side: Side, case: dict[str, Any], frame: native.Frame, scene: native.Scene) -> Planes:
    """One frame: a picture, a turned one, one of another size, a region with other settings, and the first again."""
    planes: Planes = {}
    small = {**case, "size": [97, 61]}
    for step, part in enumerate((scene, side.scene(case, 50.0), side.scene(small), side.scene(case, region=[20, 20, 90, 100], surface=constant("SURFACE.SPLATS")),
                                 side.scene(case, shadow_lazy=1), scene)):
        frame.render(part)
        planes |= seen(case, frame, f"{step}: ")
    return planes


WAYS: dict[str, Callable[[Side, dict[str, Any], native.Frame, native.Scene], Planes]] = {
    "render": _render, "again": _again, "refine": _refine, "crop": _crop, "panorama": _panorama, "bake": _bake, "shadow file": _shadow_file,
    "pick": _pick, "neighbourhoods": _neighbourhoods, "file": _file, "life": _life,
}


def answer(side: Side, asked: dict[str, Any], drawn: Planes) -> dict[str, Any]:
    if "draw" in asked:
        drawn.clear()
        drawn.update(side.draw(asked["draw"]))
        return {name: hashlib.sha256(f"{values.dtype} {values.shape}".encode() + values.tobytes()).hexdigest()[:16] for name, values in drawn.items()}
    if "time" in asked:
        return side.time(asked["time"], asked["turn"])
    np.savez(asked["save"], **{name.replace("/", "_"): values for name, values in drawn.items()})
    return {}


def main() -> None:
    answers = os.fdopen(os.dup(1), "w", encoding="utf-8")  # what a driver prints goes elsewhere
    os.dup2(2, 1)
    drawn: Planes = {}
    try:
        side = Side(sys.argv[3], int(sys.argv[4]) if len(sys.argv) > 4 else 0)
        first = {"device": f"{side.device.name}: {side.device.description}"}
    except native.PatinaError as error:
        side, first = None, {"error": str(error)}
    print(json.dumps(first), file=answers, flush=True)
    for line in sys.stdin if side else ():
        try:
            told = answer(side, json.loads(line), drawn)
        except Unknown as error:
            told = {"unknown": str(error)}
        except native.PatinaError as error:
            told = {"error": str(error)}
        print(json.dumps(told), file=answers, flush=True)


if __name__ == "__main__":
    main()
