# SPDX-License-Identifier: GPL-3.0-or-later
"""The scenes by which compare_builds.py holds one build against another: every option, kind of light, effect and way to ask for
pixels once, small. They are plain data:

    name, size, camera (keywords of CAMERAS' kinds), clouds [{of: name in builds_shapes, ...style}], meshes, lights, clips,
    settings, effects, lines: fields of the header's descriptors; do: how pictures are asked for, see builds_side.py.

Text like "SURFACE.SPLATS" stands for the header's constant, so that a scene outlives its number.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "build"))
import effects as table  # noqa: E402

Case = dict[str, Any]

SUN = {"type": "LIGHT_TYPE.SUN", "power": 3.0, "direction": [0.4, 0.5, -1.0]}
POINT = {"type": "LIGHT_TYPE.POINT", "power": 120.0, "position": [0.8, -1.4, 1.6], "color": [1.0, 0.8, 0.6]}
SPOT = {"type": "LIGHT_TYPE.SPOT", "power": 300.0, "position": [-1.0, -1.5, 2.0], "direction": [0.5, 0.7, -1.0], "cone": 0.9, "blend": 0.3}
AREA = {"type": "LIGHT_TYPE.AREA", "power": 60.0, "position": [0.5, -0.5, 2.0], "direction": [-0.2, 0.3, -1.0], "size": [1.0, 0.4]}
LIT = {"lighting": "LIGHTING.LIT"}
GLASS = {**LIT, "transparency": 0.5}
RAMP = [0.1, 0.0, 0.4, 0.9, 0.3, 0.1, 1.0, 1.0, 0.6]
FLOOR = {"of": "ground", **LIT}
TORUS = {"of": "torus", **LIT}
GLASS_TORUS = {**TORUS, "transparency": 0.5}


def _moved(x: float, y: float, z: float, scale: tuple[float, float, float] = (1, 1, 1)) -> list[float]:
    return [scale[0], 0, 0, x, 0, scale[1], 0, y, 0, 0, scale[2], z, 0, 0, 0, 1]


class _List:
    def __init__(self) -> None:
        self.cases: list[Case] = []

    def add(self, name: str, *clouds: str | dict[str, Any], light: dict[str, Any] | None = SUN, **more: Any) -> None:
        """A lit torus in perspective, but for what is said otherwise; light: beside `lights`, None: no further one."""
        listed = [{"of": cloud, **LIT} if isinstance(cloud, str) else cloud for cloud in clouds or (TORUS,)]
        case = {"name": name, "size": [160, 120], "clouds": listed, "lights": ([light] if light else []) + more.pop("lights", [])}
        self.cases.append(case | more)


def _clouds(to: _List) -> None:
    to.add("plain", light=None)
    to.add("own colors unlit", {"of": "torus"})
    to.add("lit")
    to.add("larger", size=[320, 240])
    for name in ("sparse", "dense", "analysed", "bare", "bare analysed", "wide analysed", "attributes", "opaque attributes",
                 "attributes analysed", "rows", "rows analysed", "holes", "holes analysed", "one", "none"):
        to.add(f"cloud {name}", name)
    to.add("cloud linear, far away", {"of": "linear", "world_from_object": _moved(-431_250.0, -5_391_125.0, -212.0)})
    to.add("cloud with an origin, mirrored", {"of": "moved", **LIT, "world_from_object": _moved(431_250.0, -5_391_125.0, -212.0, (-1, 1, 1))})
    to.add("clouds overlap", TORUS, {"of": "sparse", **GLASS, "world_from_object": _moved(0.2, 0.1, 0.2, (1.5, 0.7, 1))}, FLOOR)
    to.add("cloud flattened", {"of": "bare", **LIT, "world_from_object": _moved(0, 0, 0, (1, 1, 0))})
    to.add("cloud saved and opened", {**TORUS, "mapped": 1})
    to.add("cloud culled", {**TORUS, "cull_back": 1})
    to.add("cloud from a file", do="file")


def _surfaces(to: _List) -> None:
    for name, settings in {
        "paper": {"quality": "QUALITY.PAPER"}, "paper fill": {"quality": "QUALITY.PAPER", "fill": "FILL.PAPER"},
        "paper fill, three times": {"fill": "FILL.PAPER", "fill_iterations": 3},
        "not filled": {"fill": "FILL.OFF"}, "discs": {"surface": "SURFACE.SPLATS"}, "filled": {"surface": "SURFACE.FILL"},
        "averaged": {"average": 1}, "depth of the surface": {"depth": "DEPTH.SURFACE"}, "error target": {"error_target": 0.05},
        "error target, coarse": {"error_target": 0.3}, "strata 1": {"strata": 1}, "strata 4": {"strata": 4},
        "gaussian": {"smooth": "SMOOTH.GAUSSIAN"}, "box": {"smooth": "SMOOTH.BOX"}, "not smoothed": {"smooth": "SMOOTH.OFF"},
        "antialias background": {"antialias": "ANTIALIAS.BACKGROUND"}, "antialias off": {"antialias": "ANTIALIAS.OFF"},
        "as scanned": {"smooth": "SMOOTH.OFF", "antialias": "ANTIALIAS.OFF", "fill": "FILL.OFF"},
        "passes of color alone": {"passes": 1}, "passes of color, depth and normal": {"passes": 7},
    }.items():
        to.add(f"surface {name}", settings=settings)
    for cloud in ("sparse", "analysed", "wide analysed", "attributes"):
        to.add(f"discs of {cloud}", {"of": cloud, **LIT}, settings={"surface": "SURFACE.SPLATS"})
    to.add("discs of one radius, gaps", {"of": "wide analysed", **LIT, "radius": 0.2, "largest_gap": 0.1}, settings={"surface": "SURFACE.SPLATS"})
    to.add("filled once", "sparse", settings={"fill_iterations": 1})
    to.add("filled, analysed", "wide analysed", settings={"surface": "SURFACE.FILL"})
    to.add("averaged, dense and linear", "dense", {"of": "linear", "world_from_object": _moved(-431_250.0, -5_391_125.0, -212.0)},
           settings={"average": 1, "surface": "SURFACE.FILL"})
    to.add("bare, paper", "bare", settings={"quality": "QUALITY.PAPER", "fill": "FILL.PAPER"})
    to.add("bare, depth of the surface", "bare", settings={"depth": "DEPTH.SURFACE"})


def _views(to: _List) -> None:
    to.add("orthographic", camera={"kind": "parallel"})
    to.add("orthographic, averaged discs", {"of": "wide analysed", **LIT}, camera={"kind": "parallel"}, settings={"average": 1})
    to.add("among the points", camera={"distance": 1.2, "elevation": 10})
    to.add("from above", camera={"elevation": 90})
    to.add("shifted window", camera={"shift": [0.3, -0.2]})
    to.add("near and far cut", camera={"near": 3.2, "far": 3.8})
    to.add("region", settings={"region": [40, 30, 111, 87]})
    to.add("region at a border, discs", settings={"region": [0, 60, 160, 120], "surface": "SURFACE.SPLATS"}, camera={"distance": 2.0})
    to.add("odd size", size=[131, 67])
    to.add("one pixel", size=[1, 1])
    to.add("border and whole", do="crop", light=None, lights=[{**SUN, "shadows": 1}], effects={"edl_strength": 1.0, "focus_aperture": 0.05, "focus_distance": 3.4})
    for name, film in (("film transparent", {"film_transparent": 1}), ("film of the world", {"world_color": [0.2, 0.3, 0.5]}),
                       ("film of its own", {"own_background": 1, "background": [0.6, 0.1, 0.0], "world_color": [0.3, 0.3, 0.3]})):
        to.add(name, settings=film)
        to.add(f"{name}, glass", {**TORUS, "transparency": 0.6}, settings=film)
    to.add("world by direction", settings={"world_directed": 1, "world_color": [0.1] * 3, "world_light": [0.2 + 0.05 * (i % 7) for i in range(27)]})
    to.add("panorama", do="panorama", size=[128, 64])
    to.add("panorama, part, soft shadows", FLOOR, TORUS, do="panorama", size=[160, 80], light={**SUN, "angle": 0.1, "shadows": 1},
           settings={"shadow_samples": 4, "film_transparent": 1}, panorama={"region": [10, 20, 130, 71], "latitude": [-0.9, 0.8], "longitude": [-2.0, 2.5]})


def _lights(to: _List) -> None:
    for name, light, soft in (("sun", SUN, {"angle": 0.2}), ("point", POINT, {"radius": 0.2}), ("spot", SPOT, {"radius": 0.2}), ("area", AREA, {}),
                              ("round area", {**AREA, "shape": "AREA_SHAPE.ELLIPSE", "side": [1, 1, 0]}, {})):
        to.add(f"light {name}", FLOOR, TORUS, light=light)
        to.add(f"shadow {name}, hard", FLOOR, TORUS, light={**light, "shadows": 1})
        to.add(f"shadow {name}, soft", FLOOR, TORUS, light={**light, **soft, "shadows": 1}, settings={"shadow_samples": 6})
        to.add(f"shadow {name}, lazy", FLOOR, TORUS, light={**light, **soft, "shadows": 1}, settings={"shadow_samples": 3, "shadow_lazy": 1})
    casting = {**SUN, "angle": 0.3, "shadows": 1}
    to.add("shadow by error", FLOOR, TORUS, light=casting, settings={"shadow_error": 0.05, "shadow_samples": 32})
    to.add("shadow progressive", FLOOR, TORUS, light=casting, settings={"shadow_progressive": 1, "shadow_samples": 8}, do="again")
    to.add("shadow of few texels", FLOOR, TORUS, light=casting, settings={"shadow_resolution": 64})
    to.add("shadow of discs", {"of": "wide analysed", **LIT}, FLOOR, light=casting, settings={"surface": "SURFACE.SPLATS"})
    to.add("shadow of discs that show", TORUS, FLOOR, light=casting, settings={"surface": "SURFACE.SPLATS", "shadow_lazy": 1})
    to.add("shadow of discs of glass", GLASS_TORUS, FLOOR, light=casting, settings={"surface": "SURFACE.SPLATS"})
    to.add("shadow of glass", {**TORUS, "transparency": 0.5}, FLOOR, light=casting)
    to.add("shadow of opacities", "attributes", FLOOR, light=casting, settings={"shadow_samples": 4})
    to.add("shadow not cast", {**TORUS, "shadow_off": "SHADOW_OFF.NO_CAST"}, FLOOR, light=casting)
    to.add("shadow not received", TORUS, {**FLOOR, "shadow_off": "SHADOW_OFF.NO_RECEIVE"}, light=casting)
    to.add("shadow not of itself", {**TORUS, "shadow_off": "SHADOW_OFF.NO_SELF"}, FLOOR, light=casting)
    to.add("shadow baked", FLOOR, TORUS, light=casting, lights=[{**POINT, "radius": 0.1, "shadows": 1}], settings={"shadow_samples": 5}, do="bake")
    to.add("shadow saved and loaded", FLOOR, TORUS, light=casting, settings={"shadow_samples": 5}, do="shadow file")
    to.add("shadow of five lights", FLOOR, TORUS, light=casting, lights=[{**light, "shadows": 1} for light in (POINT, SPOT, AREA)] + [POINT])
    to.add("paper's lighting", {**TORUS, "ambient": 0.3, "diffuse": 0.7, "specular": 0.6, "shininess": 12}, lights=[POINT])


def _layers(to: _List) -> None:
    to.add("layers", {**TORUS, "transparency": 0.5})
    to.add("layers, bare", {"of": "bare", **GLASS})
    to.add("layers of discs", {"of": "analysed", **GLASS}, settings={"surface": "SURFACE.SPLATS"})
    to.add("layers, two", {**TORUS, "transparency": 0.7}, settings={"layers": 2})
    to.add("layers, sixteen, d_min", {"of": "dense", **GLASS, "d_min": 0.02, "transparency": 0.9}, settings={"layers": 16})
    to.add("layers' passes", {**TORUS, "transparency": 0.5}, settings={"layers": 3, "layer_passes": 7})
    to.add("layers behind opaque ones", settings={"layers": 4, "layer_passes": 7})
    to.add("layers, paper", {**TORUS, "transparency": 0.5}, settings={"quality": "QUALITY.PAPER", "fill": "FILL.PAPER"})
    to.add("layers, shadows and effects", {**TORUS, "transparency": 0.5}, FLOOR, light={**SUN, "shadows": 1, "angle": 0.1},
           effects={"edl_strength": 1.0, "obscurance_strength": 1.0, "fog_density": 0.5, "fog_start": 3.0, "fog_end": 5.0}, lines={"width": 2.0},
           settings={"shadow_samples": 3})
    to.add("layers with nothing to see", {**TORUS, "transparency": 1.0})


def _colors(to: _List) -> None:
    for name, style in {
        "fixed": {"color_source": "COLOR_SOURCE.FIXED", "color": [0.7, 0.2, 0.1]}, "scalar": {"color_source": "COLOR_SOURCE.SCALAR", "ramp": RAMP},
        "scalar range": {"color_source": "COLOR_SOURCE.SCALAR", "ramp": RAMP, "ramp_range": [-4.0, 2.0]},
        "height": {"color_source": "COLOR_SOURCE.HEIGHT", "ramp": RAMP}, "object's height": {"color_source": "COLOR_SOURCE.OBJECT_HEIGHT"},
        "distance": {"color_source": "COLOR_SOURCE.DISTANCE", "ramp": RAMP}, "exposure": {"exposure": 1.5, "contrast": 1.4},
        "classes hidden": {"hidden_classes": [4] + [0] * 7},
    }.items():
        to.add(f"color {name}", {"of": "opaque attributes", **LIT, **style})
    for cloud in ("analysed", "scan"):  # with a kind that hides points, and without
        to.add(f"color trust, {cloud}", {"of": cloud, "color_source": "COLOR_SOURCE.TRUST", "ramp": RAMP, "least_trust": -1.0})
    to.add("color trust, none known", {"of": "opaque attributes", "color_source": "COLOR_SOURCE.TRUST", "ramp": RAMP})
    to.add("color trust, discs", {"of": "scan", "color_source": "COLOR_SOURCE.TRUST", "least_trust": -1.0}, settings={"surface": "SURFACE.SPLATS"})
    to.add("color grade", {**TORUS, "grade": [[1.5, 1.2, 0.5, 1.0], [0.7, 0.8, 1.5, -2.0]]})
    to.add("mask", {**TORUS, "mask": 1})
    to.add("mask, shadow, selected", {**TORUS, "mask": 1}, FLOOR, light={**SUN, "shadows": 1}, do="pick")
    for name, clip in {"box": {"world_from_clip": _moved(0.5, 0, 0, (0.8, 0.8, 0.8))}, "cut": {"world_from_clip": _moved(0.5, 0, 0, (0.6, 0.6, 0.6)), "cut": 1},
                       "plane": {"shape": "CLIP_SHAPE.PLANE"}}.items():
        to.add(f"clip {name}", clips=[clip | {"tint": [1.0, 0.2, 0.1], "tint_strength": 0.8, "tint_width": 0.1}])
    clip = {"world_from_clip": _moved(0.5, 0, 0, (0.6, 0.6, 0.9)), "cut": 1}
    to.add("clips, shadows uncut", TORUS, FLOOR, clips=[clip, {"shape": "CLIP_SHAPE.PLANE", "world_from_clip": _moved(0, 0, 0.2)}],
           light={**SUN, "shadows": 1}, settings={"shadow_uncut": 1})
    to.add("clips, one cloud whole", {**TORUS, "clip_off": 1}, FLOOR, clips=[clip], light={**SUN, "shadows": 1})


def _scans(to: _List) -> None:
    camera = {"distance": 4.5, "elevation": 25}
    for name, style in {"": {}, ", kinds hidden": {"hidden_kinds": 1 << 4 | 1 << 5}, ", certain": {"least_trust": 0.5},
                        ", by class": {"hidden_classes": [8] + [0] * 7}}.items():
        to.add(f"scan{name}", {"of": "scan", **style}, camera=camera)
    for name, style in {"": {}, ", gaps": {"largest_gap": 0.05}}.items():
        to.add(f"scan of discs{name}", {"of": "scan", **style}, camera=camera, settings={"surface": "SURFACE.SPLATS"})
    for mode in ("OFF", "SHOW", "USE"):
        to.add(f"scan, free space {mode.lower()}", {"of": "scan seen through", "free_space": f"FREE_SPACE.{mode}"}, camera=camera)
    to.add("grid, free space", {"of": "grid", "free_space": "FREE_SPACE.USE"}, camera={**camera, "distance": 3.0})
    to.add("scan, filled, free space", {"of": "scan seen through", "free_space": "FREE_SPACE.USE"}, camera=camera, settings={"surface": "SURFACE.FILL"})
    to.add("scan, discs, free space, shadow", {"of": "scan seen through", **LIT, "free_space": "FREE_SPACE.USE"}, camera=camera,
           settings={"surface": "SURFACE.SPLATS"}, light={**SUN, "shadows": 1})
    to.add("what points know", "scan seen through", do="neighbourhoods")


def _effects(to: _List) -> None:
    effects = {
        "eye-dome": {"edl_strength": 1.0}, "eye-dome, wide": {"edl_strength": 3.0, "edl_radius": 5.0}, "obscurance": {"obscurance_strength": 1.0},
        "obscurance, wide": {"obscurance_strength": 2.0, "obscurance_radius": 0.4}, "toon": {"toon_bands": 3}, "toon, soft": {"toon_bands": 5, "toon_softness": 0.5},
        "hatching": {"hatch_levels": 1}, "hatching, crossed": {"hatch_levels": 3, "hatch_spacing": 4.0, "hatch_opacity": 0.7, "hatch_ground": 0.5, "hatch_color": [0.2, 0, 0.3]},
        "fog": {"fog_density": 0.8, "fog_start": 3.0, "fog_end": 5.0}, "fog of a color": {"fog_density": 1.0, "fog_end": 4.0, "fog_fixed": 1, "fog_color": [0.5, 0.6, 0.7]},
        "focus": {"focus_aperture": 0.1, "focus_distance": 3.2}, "paper": {"paper_color": [0.9, 0.8, 0.6], "paper_grain": 0.5}, "grain": {"paper_grain": 1.0},
    }
    for name, effect in effects.items():
        to.add(f"effect {name}", effects=effect)
    for effect in table.own():
        begins = {field["name"]: list(field["start"]) if field["kind"] == "COLOR" else field["start"] for field in effect["fields"] if "start" in field}
        to.add(f"effect {effect['name']} as it begins", effects=begins)
        to.add(f"effect {effect['name']}, layers, orthographic", GLASS_TORUS, FLOOR, effects=begins, camera={"kind": "parallel"})
    together = {"edl_strength": 1.0, "obscurance_strength": 1.0, "toon_bands": 4, "hatch_levels": 2, "fog_density": 0.6, "fog_start": 3.0,
                "fog_end": 5.0, "focus_aperture": 0.05, "focus_distance": 3.4, "paper_grain": 0.3}
    to.add("effects together", effects=together)
    to.add("effects together, color alone", effects=together, settings={"passes": 1})
    to.add("effects together, depth beside it", effects=together, settings={"passes": 2})
    to.add("effects together, film, shadows, lines", TORUS, FLOOR, effects=together, settings={"film_transparent": 1}, light={**SUN, "shadows": 1}, lines={"width": 3.0})
    to.add("effects together, orthographic discs", {"of": "wide analysed", **LIT}, effects=together, camera={"kind": "parallel"})
    for name, lines in {
        "fixed": {"width": 2.0}, "wide": {"width": 9.0, "soft": 0.5, "color": [0.3, 0, 0]}, "of the world": {"width": 0.05, "world": 1},
        "of the points": {"width": 4.0, "source": "LINE_SOURCE.POINT"}, "by depth": {"width": 4.0, "source": "LINE_SOURCE.DEPTH", "far_color": [1, 1, 1]},
        "by depth from to": {"width": 4.0, "source": "LINE_SOURCE.DEPTH", "far_color": [1, 1, 1], "range": [3.0, 4.0], "transparency": 0.4},
        "on paper": {"width": 3.0, "surface": "LINE_SURFACE.PAPER", "paper": [0.9, 0.9, 0.8]}, "alone": {"width": 3.0, "surface": "LINE_SURFACE.NONE"},
        "creases": {"width": 2.0, "offset": 0.01},
    }.items():
        to.add(f"lines {name}", TORUS, FLOOR, lines=lines)
    to.add("lines, bare, film", "bare", lines={"width": 3.0}, settings={"film_transparent": 1})
    to.add("lines of discs", {"of": "wide analysed", **LIT}, lines={"width": 3.0})


def _samples(to: _List) -> None:
    to.add("samples", settings={"pixel_samples": 8})
    to.add("samples, no antialias", settings={"pixel_samples": 5, "antialias": "ANTIALIAS.OFF"})
    to.add("samples of discs, film", {"of": "wide analysed", **LIT}, settings={"pixel_samples": 6, "film_transparent": 1})
    to.add("samples by noise", settings={"pixel_samples": 32, "pixel_noise": 0.02})
    to.add("samples, step by step", FLOOR, TORUS, light={**SUN, "shadows": 1, "angle": 0.2}, do="refine",
           settings={"pixel_samples": 9, "pixel_progressive": 1, "shadow_progressive": 1, "shadow_samples": 4})
    to.add("samples, effects, lines", effects={"edl_strength": 1.0, "paper_grain": 0.4, "focus_aperture": 0.05, "focus_distance": 3.4},
           lines={"width": 2.0}, settings={"pixel_samples": 4})
    to.add("samples of layers", {**TORUS, "transparency": 0.5}, settings={"pixel_samples": 4})
    to.add("one frame, several pictures", FLOOR, TORUS, light={**SUN, "shadows": 1}, do="life")


def _meshes(to: _List) -> None:
    ball = {"of": "ball"}
    casting = {**SUN, "shadows": 1, "angle": 0.1}
    to.add("mesh", meshes=[ball])
    to.add("mesh, flat, alone", "none", meshes=[{"of": "flat ball", "color": [0.3, 0.6, 0.2]}])
    to.add("mesh, unlit", meshes=[{**ball, "unlit": 1}])
    to.add("mesh, shadows", TORUS, FLOOR, meshes=[{**ball, "world_from_object": _moved(0.9, -0.6, 0.3)}], light=casting, settings={"shadow_samples": 4})
    to.add("mesh, shadows by error", TORUS, meshes=[{**ball, "world_from_object": _moved(0.9, -0.6, 0.3)}], light=casting, settings={"shadow_error": 0.1})
    to.add("mesh, shadows off", TORUS, meshes=[{**ball, "world_from_object": _moved(0.9, -0.6, 0.3), "shadow_off": 3}], light=casting)
    to.add("mesh, discs, lines", {"of": "wide analysed", **LIT}, meshes=[ball], lines={"width": 3.0}, effects={"edl_strength": 1.0, "obscurance_strength": 1.0})
    to.add("mesh, glass before it", {**TORUS, "transparency": 0.5}, meshes=[ball])
    to.add("mesh, clip, orthographic", clips=[{"shape": "CLIP_SHAPE.PLANE"}], meshes=[ball], camera={"kind": "parallel"})
    for kind in ("byte repeat", "byte raw near extend", "float clip"):
        to.add(f"texture {kind}", meshes=[{"of": "quad", "texture": kind}])
    for alpha in ("CLIP", "BLEND"):
        to.add(f"texture, alpha {alpha.lower()}", TORUS, FLOOR, light=casting, meshes=[{"of": "quad", "texture": "byte extend", "alpha": f"ALPHA.{alpha}"}])
    to.add("texture on a ball, alpha, far", meshes=[{**ball, "texture": "float repeat", "alpha": "ALPHA.CLIP", "alpha_least": 0.3}], camera={"distance": 9.0})
    to.add("texture, samples, blend", "none", meshes=[{"of": "quad", "texture": "byte repeat", "alpha": "ALPHA.BLEND"}, ball], settings={"pixel_samples": 4})


def _soft(to: _List) -> None:
    soft = {"of": "torus", "soft": "SOFT.ALL", "soft_opacity": 0.4}
    for model in ("BASE", "CONCENTRIC", "EXPRESS"):
        to.add(f"soft {model.lower()}", {**soft, "soft_model": f"SOFT_MODEL.{model}"})
        to.add(f"soft {model.lower()}, around a floor, lit", {**soft, **LIT, "soft_model": f"SOFT_MODEL.{model}", "soft_radius": 0.06}, FLOOR)
    to.add("soft shells, modulated", {**soft, "soft_model": "SOFT_MODEL.CONCENTRIC", "soft_shells": 4, "soft_modulation": 0.7})
    to.add("soft, orthographic, own radii", {"of": "attributes", **LIT, "soft": "SOFT.ALL"}, TORUS, camera={"kind": "parallel"})
    to.add("soft, among the points", soft, camera={"distance": 1.2, "elevation": 10})
    to.add("soft, ramp, clip, mask", {**soft, "mask": 1, "color_source": "COLOR_SOURCE.HEIGHT", "ramp": RAMP}, clips=[{"shape": "CLIP_SHAPE.PLANE"}])
    to.add("soft before glass", soft, {**GLASS_TORUS, "world_from_object": _moved(0.8, 0.4, 0.2)})
    by = {**soft, **LIT, "soft": "SOFT.FIELD", "field": 100, "soft_threshold": 0.6}
    to.add("soft by field, modulated, shadows", {**by, "soft_modulation": 0.2}, FLOOR, light={**SUN, "shadows": 1})
    to.add("soft by field, mask, one radius, glass", {**by, "mask": 1, "soft_radius": 0.05, "soft_model": "SOFT_MODEL.EXPRESS"}, {**GLASS_TORUS, "world_from_object": _moved(0.8, 0.4, 0.2)})
    to.add("soft, region", soft, TORUS, settings={"region": [40, 30, 111, 87]})
    to.add("soft, samples, film, lines", {**soft, "world_from_object": _moved(0.5, -0.5, 0.2)}, TORUS, lines={"width": 3.0},
           settings={"pixel_samples": 4, "film_transparent": 1})


def _ranges(to: _List) -> None:
    all_of = {"settings": {"surface": "SURFACE.RANGES"}}
    one = {"surface": "SURFACE.RANGES"}
    to.add("ranges", **all_of)
    to.add("ranges, wide cells, gamma", {**TORUS, "range_pixel": 6.5, "range_gamma": 0.05}, **all_of)
    to.add("ranges, glass, clip, mask", {**GLASS_TORUS, **one, "mask": 1}, FLOOR, clips=[{"shape": "CLIP_SHAPE.PLANE"}])
    to.add("ranges beside discs, ramp, shadows, lines", {**TORUS, **one, "color_source": "COLOR_SOURCE.HEIGHT", "ramp": RAMP},
           {"of": "wide analysed", **LIT}, FLOOR, light={**SUN, "shadows": 1}, lines={"width": 3.0})
    to.add("ranges, orthographic, own opacities", {"of": "attributes", **LIT}, camera={"kind": "parallel"}, **all_of)
    to.add("ranges, few points", "one", "none", "sparse", **all_of)
    to.add("ranges, region, effects", light={**SUN, "shadows": 1}, effects={"edl_strength": 1.0, "obscurance_strength": 1.0},
           settings={"surface": "SURFACE.RANGES", "region": [40, 30, 111, 87]})
    to.add("ranges, samples, film", settings={"surface": "SURFACE.RANGES", "pixel_samples": 6, "film_transparent": 1})
    to.add("ranges, two passes", {**TORUS, **one, "range_sharpness": 0.7},
           {**GLASS_TORUS, **one, "range_sharpness": 0.8, "world_from_object": _moved(0.8, 0.4, 0.2)})
    to.add("ranges among meshes", meshes=[{"of": "ball"}], **all_of)


def cases() -> list[Case]:
    to = _List()
    for fill in (_clouds, _surfaces, _views, _lights, _layers, _colors, _scans, _effects, _samples, _meshes, _soft, _ranges):
        fill(to)
    return to.cases
