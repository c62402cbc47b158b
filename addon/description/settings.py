# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings, lines and effects of an image, and the device that draws it."""

from __future__ import annotations

from dataclasses import dataclass, make_dataclass, replace
from typing import Any

from ..native.abi import EFFECTS, OWN_EFFECTS
from .view import Focus

_FIELDS = [field for effect in EFFECTS for field in effect["fields"]]
_TYPES = {"NUMBER": float, "COLOR": tuple[float, float, float], "AXIS": tuple[float, float, float]}


@dataclass(frozen=True)
class DeviceChoice:
    name: str
    threads: int
    mapped: int = 0  # bytes that a picture holds of linked clouds at a time; 0: a third of what is free


@dataclass(frozen=True)
class Settings:
    """patina_settings."""

    width: int
    height: int
    region: tuple[int, int, int, int]
    quality: int
    fill: int
    fill_iterations: int
    smooth: int
    antialias: int
    film_transparent: int
    world_color: tuple[float, float, float]
    layers: int
    shadow_samples: int
    shadow_resolution: int
    shadow_lazy: int
    surface: int = 0
    error_target: float = 0.0
    shadow_error: float = 0.0
    strata: int = 0  # of 6 that are drawn; 0: all
    shadow_progressive: int = 0
    own_background: int = 0
    background: tuple[float, float, float] = (0.0, 0.0, 0.0)
    shadow_uncut: int = 0
    pixel_samples: int = 1  # of a picture at rest; 0: by the noise alone
    depth: int = 0
    world_directed: int = 0  # 1: world_light, not world_color, lights
    world_light: tuple[float, ...] = (0.0,) * 27
    pixel_progressive: int = 0  # the first sample, which is bettered by and by
    pixel_noise: float = 0.0
    average: int = 0
    detail: float = 0.0  # pixels between points below which finer levels of clouds are left out; 0: all is drawn


@dataclass(frozen=True)
class Lines:
    """patina_lines."""

    width: float
    world: int
    offset: float
    source: int
    color: tuple[float, float, float]
    far_color: tuple[float, float, float]
    range: tuple[float, float]
    transparency: float
    soft: float
    surface: int
    paper: tuple[float, float, float]
    exact: int = 1


def off(effect: dict[str, Any]) -> dict[str, Any]:
    """The fields of one effect of the library's table that switch it off."""
    return {field["name"]: (field.get("zero") or 0.0,) * 3 if field["kind"] == "COLOR" else 0
            for field in effect["fields"] if field["when"] == "STRENGTH"}


class _Effects:
    def through(self, focus: Focus | None) -> Effects:
        """With the depth of field of a view."""
        return replace(self, focus_aperture=focus.aperture if focus else 0.0,
                       focus_distance=focus.distance if focus else 0.0)

    def shrunk(self, factor: int) -> Effects:
        """For a picture of larger pixels, as far as lengths in pixels may become less."""
        return replace(self, **{field["name"]: max(getattr(self, field["name"]) / factor, field["least"])
                                for field in _FIELDS if field.get("unit") == "PIXELS"})

    def focus_alone(self) -> Effects:
        """All others off."""
        return replace(self, **{name: value for effect in OWN_EFFECTS for name, value in off(effect).items()})


# patina_effects; what is switched off has no strength.
Effects = make_dataclass("Effects", [("exact", int, 1)] + [(field["name"], _TYPES.get(field["kind"], int)) for field in _FIELDS],
                         bases=(_Effects,), frozen=True, kw_only=True)
