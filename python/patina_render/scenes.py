# SPDX-License-Identifier: GPL-3.0-or-later
"""What an image shows: clouds, lights, a camera and the background."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from . import _native
from .clouds import Cloud

Triple = Sequence[float]
COLOR_BY = {name.lower(): number for name, number in _native.abi.COLOR_SOURCE.items()}
SURFACES = {name.lower(): number for name, number in _native.abi.SURFACE.items()}
# Without lights of the scene: two suns, in the camera's coordinates: where from, and power.
DEFAULT_LIGHTS = (((-0.8, 0.75, 0.45), 2.8), ((0.9, 0.1, 0.6), 0.6))


class Scene:
    """Clouds, lights, a camera and a background. Scenes are cheap; make one for each image or change one.

    background: linear RGB behind the points; None: transparent.
    ambient: linear RGB, light from all sides on lit clouds.
    surface: "auto" (discs or filling, as the analysis says), "fill", "splats" or "ranges".
    """

    def __init__(self, background: Triple | None = None, ambient: Triple = (0.2, 0.2, 0.2), surface: str = "auto") -> None:
        self.background, self.ambient, self.surface = background, ambient, surface
        self._clouds: list[tuple[Cloud, dict[str, Any]]] = []
        self._suns: list[dict[str, Any]] = []
        self._view: tuple[str, dict[str, Any]] = ("frame", {"azimuth": 30.0, "elevation": 40.0, "fov": 0.0})

    def add(self, cloud: Cloud, transform: ArrayLike | None = None, *, lit: bool | None = None, color: Triple = (0.8, 0.8, 0.8),
            color_by: str = "own", ramp: str = "viridis", ramp_range: tuple[float, float] | None = None, opacity: float = 1.0,
            least_trust: float | None = None, radius: float = 0.0) -> None:
        """Adds a cloud. The scene keeps a reference to it.

        transform: (4, 4), world from object, for column vectors. lit: None: clouds with colors are not lit, others are.
        color: linear RGB of points without a color. color_by: "own", "fixed" (color), "scalar", "height" (world z), "distance" (to the
        camera) or "trust". ramp: "viridis", "grey", "heat", "spectrum", "relief" or "diverging". ramp_range: values at its ends; None:
        those of the cloud. opacity: 0 to 1. least_trust: analyzed points of less trust are left out; None: automatic; 0: none is.
        radius: of the points' discs, world units; 0: automatic.
        """
        matrix = np.eye(4) if transform is None else np.asarray(transform, np.float64)
        if matrix.shape != (4, 4):
            raise ValueError(f"transform has the shape {matrix.shape}; (4, 4) is needed")
        if not 0.0 <= opacity <= 1.0:
            raise ValueError(f"opacity is {opacity}; 0 to 1 is needed")
        style = {"world_from_object": matrix.ravel().tolist(), "lighting": 0 if lit is None else 2 if lit else 1, "color": _triple("color", color),
                 "ambient": 1.0, "diffuse": 1.0, "shininess": 32, "contrast": 1.0, "exact": 1,  # as PATINA_CLOUD_STYLE_INIT
                 "color_source": _chosen("color_by", color_by, COLOR_BY), "transparency": 1.0 - opacity, "radius": radius,
                 "least_trust": 0.0 if least_trust is None else least_trust or -1.0, "ramp": _native.ramp(ramp).tobytes()}
        if ramp_range is not None:
            style["ramp_range"] = tuple(ramp_range)
        self._clouds.append((cloud, style))

    def add_sun(self, direction: Triple, power: float = 3.0, *, color: Triple = (1.0, 1.0, 1.0), angle: float = 0.0,
                shadows: bool = False) -> None:
        """Adds a sun, which replaces the two default lights of lit clouds.

        direction: (3,), in which its light travels, world. power: irradiance, W/m², as of Blender's suns. angle: degrees that its disc
        spans; 0: sharp shadows.
        """
        self._suns.append({"type": _native.abi.LIGHT_TYPE["SUN"], "direction": _triple("direction", direction), "power": power,
                           "color": _triple("color", color), "angle": math.radians(angle), "shadows": int(shadows)})

    def frame(self, azimuth: float = 30.0, elevation: float = 40.0, fov: float = 0.0) -> None:
        """A camera that frames the clouds. azimuth: degrees around z, 0: from -y. elevation: degrees above the horizon. fov: vertical field
        of view, degrees; 0: 45.8."""
        self._view = "frame", {"azimuth": azimuth, "elevation": elevation, "fov": fov}

    def look(self, eye: Triple, target: Triple, up: Triple = (0.0, 0.0, 1.0), fov: float = 45.8) -> None:
        """A perspective camera at eye that looks at target, world units. fov: vertical field of view, degrees."""
        if not 0.0 < fov < 180.0:
            raise ValueError(f"fov is {fov}; above 0 and below 180 degrees is needed")
        self._view = "look", {"matrix": _looking(eye, target, up), "half": math.tan(math.radians(fov) / 2), "orthographic": 0}

    def look_parallel(self, eye: Triple, target: Triple, height: float, up: Triple = (0.0, 0.0, 1.0)) -> None:
        """A parallel projection: as look, but the image shows `height` world units from its bottom to its top."""
        if not height > 0.0:
            raise ValueError(f"height is {height}; above 0 is needed")
        self._view = "look", {"matrix": _looking(eye, target, up), "half": height / 2, "orthographic": 1}

    def _native_scene(self, width: int, height: int, passes: Sequence[str], samples: int) -> tuple[_native.Scene, float]:
        """The library's scene for an image of this size, which the caller closes, and what to add to its depths."""
        scene = _native.Scene()
        for cloud, style in self._clouds:
            scene.add_cloud(cloud._cloud, **style)
        back = _triple("background", self.background or (0.0,) * 3)
        scene.set_settings(width=width, height=height, film_transparent=int(self.background is None), own_background=1, background=back,
                           world_color=_triple("ambient", self.ambient), surface=_chosen("surface", self.surface, SURFACES),
                           pixel_samples=samples, passes=sum(1 << _native.PLANES[name.upper()][0] for name in passes))
        camera = self._camera(scene, width / height)
        scene.set_camera(**camera)
        for sun in self._suns or _default_suns(camera):
            scene.add_light(**sun)
        return scene, camera["near_clip"] if camera["orthographic"] else 0.0  # the library's depth begins at the near plane there

    def _camera(self, scene: _native.Scene, aspect: float) -> dict[str, Any]:
        kind, values = self._view
        if kind == "frame":
            return scene.frame_camera(values["azimuth"], values["elevation"], values["fov"])
        half, matrix = values["half"], values["matrix"]
        near, far = _depths(scene.extent(), matrix)
        if not values["orthographic"]:
            near, far = max(near, 1e-4 * max(far, 1e-30)), max(far, 1e-30)
        return {"world_from_camera": tuple(matrix.ravel()), "orthographic": values["orthographic"], "left": -half * aspect, "right": half * aspect,
                "bottom": -half, "top": half, "near_clip": near, "far_clip": max(far, near * 2 if near > 0 else near + 1)}


def _chosen(name: str, value: str, choices: dict[str, int]) -> int:
    if value not in choices:
        raise ValueError(f"{name} is {value!r}; one of {', '.join(choices)} is needed")
    return choices[value]


def _triple(name: str, values: Triple) -> tuple[float, ...]:
    found = tuple(float(value) for value in values)
    if len(found) != 3 or not all(map(math.isfinite, found)):
        raise ValueError(f"{name} is {values}; three finite numbers are needed")
    return found


def _looking(eye: Triple, target: Triple, up: Triple) -> np.ndarray:
    """(4, 4) world from camera. The camera looks along its -z."""
    eye, target, up = (np.array(_triple(name, values)) for name, values in (("eye", eye), ("target", target), ("up", up)))
    back = eye - target
    side = np.cross(up, back)
    if not np.linalg.norm(back) or not np.linalg.norm(side):
        raise ValueError("eye, target and up do not span a view: eye and target are equal, or up is parallel to the view")
    back, side = back / np.linalg.norm(back), side / np.linalg.norm(side)
    matrix = np.eye(4)
    matrix[:3, 0], matrix[:3, 1], matrix[:3, 2], matrix[:3, 3] = side, np.cross(back, side), back, eye
    return matrix


def _depths(box: np.ndarray, matrix: np.ndarray) -> tuple[float, float]:
    """Least and greatest distance along the view of a box's corners, a little farther apart. An empty box: 0.1 and 1."""
    if (box[0] > box[1]).any():
        return 0.1, 1.0
    corners = np.array([[box[i, 0], box[j, 1], box[k, 2]] for i in (0, 1) for j in (0, 1) for k in (0, 1)])
    z = (matrix[:3, 3] - corners) @ matrix[:3, 2]
    room = 1e-3 * (z.max() - z.min()) + 1e-6 * abs(z).max()
    return float(z.min() - room), float(z.max() + room)


def _default_suns(camera: dict[str, Any]) -> list[dict[str, Any]]:
    turn = np.array(camera["world_from_camera"]).reshape(4, 4)[:3, :3]
    return [{"type": _native.abi.LIGHT_TYPE["SUN"], "direction": tuple(-turn @ np.array(source)), "power": power}
            for source, power in DEFAULT_LIGHTS]
