# SPDX-License-Identifier: GPL-3.0-or-later
"""Single points of clouds: masks, grades of scans, fields, picking. Bits are (count + 7) // 8 bytes, point i is bit i % 8 of byte i // 8."""

from __future__ import annotations

from collections.abc import Sequence
from ctypes import byref, c_double, c_float
from typing import Any

import numpy as np

from . import abi
from .clouds import Cloud
from .frames import Frame, Scene
from .handles import Handle, Progress, handle_of
from .loader import PatinaError, check, library


class Mask(Handle):
    """Which points of a cloud are hidden and which selected; None: none. Of this cloud alone, and never another one."""

    _kind = "mask"

    def __init__(self, cloud: Cloud, hidden: np.ndarray | None, selected: np.ndarray | None) -> None:
        planes = [None if plane is None else np.ascontiguousarray(plane, np.uint8) for plane in (hidden, selected)]
        super().__init__(cloud._handle, *(None if plane is None else plane.ctypes.data for plane in planes),
                         (cloud.count + 7) // 8)


def _address(cloud: Cloud, scans: np.ndarray | None) -> int | None:
    """Of the scan of each point. PatinaError unless it is a uint16 for each."""
    if scans is None:
        return None
    if scans.dtype != np.uint16 or len(scans) != cloud.count or not scans.flags.c_contiguous:
        raise PatinaError("scans are a uint16 for each point")
    return scans.ctypes.data


class Grade(Handle):
    """A cloud's own colors, changed by scan. scans: (count,) uint16, or None: all are of the first. grades: gain, gamma, saturation
    and temperature of each. balance: (grades, 3) gains of red, green and blue before these, or None. keep_colors: points that were
    measured without a color are black. PatinaError for a cloud without colors."""

    _kind = "grade"

    def __init__(self, cloud: Cloud, scans: np.ndarray | None, grades: Sequence[Sequence[float]],
                 balance: np.ndarray | None = None, keep_colors: bool = False) -> None:
        address = _address(cloud, scans)
        values = (abi.ScanGrade * len(grades))(*(abi.ScanGrade(*grade) for grade in grades))
        balance = np.ones((len(grades), 3), np.float32) if balance is None else np.ascontiguousarray(balance, np.float32)
        if balance.shape != (len(grades), 3):
            raise PatinaError("balance has three gains for each scan")
        super().__init__(cloud._handle, address, values, balance.ctypes.data, len(grades), int(keep_colors),
                         blame=(cloud._handle,), create="patina_grade_create_balanced")


def gains(cloud: Cloud, scans: np.ndarray, count: int, progress: Progress | None = None) -> np.ndarray:
    """(count, 3) float32: what multiplies red, green and blue of each scan so that their light agrees where scans overlap. scans:
    (cloud.count,) uint16. PatinaError for a cloud without colors."""
    found = np.ones((count, 3), np.float32)
    check(library().patina_cloud_balance(cloud._handle, _address(cloud, scans), count, handle_of(progress), found.ctypes.data), cloud._handle)
    return found


class ScanSet(Handle):
    """The scans that a cloud was made of, for range images. of: (count,) uint16, or None: all are of the first; scans: the direction in
    which each scanner looked, and the interval of its samples, 0 where that is not known."""

    _kind = "scans"

    def __init__(self, cloud: Cloud, of: np.ndarray | None, scans: Sequence[tuple[Sequence[float], float]]) -> None:
        address = _address(cloud, of)
        values = (abi.Scan * len(scans))(*(abi.Scan((c_double * 3)(*direction), interval) for direction, interval in scans))
        super().__init__(cloud._handle, address, values, len(scans), blame=(cloud._handle,))


class Field(Handle):
    """A number of 0 to 1 for each point of a cloud, (count,) float32: points with more than a style's soft_threshold are soft."""

    _kind = "field"

    def __init__(self, cloud: Cloud, values: np.ndarray | None = None, progress: Progress | None = None, **desc: Any) -> None:
        """values: any (count,) numbers, or None: desc's source, as patina_field_desc has it."""
        if values is not None:
            numbers = np.ascontiguousarray(values, np.float32).reshape(-1)
            desc |= {"values": numbers.ctypes.data, "count": len(numbers)}
        super().__init__(cloud._handle, byref(abi.FieldDesc(**desc)), handle_of(progress))
        info = abi.FieldInfo()
        self._call("get_info", byref(info))
        self.range = tuple(info.range)  # numbers that became 0 and 1
        self.histogram = np.array(info.histogram, np.uint64)  # (256,) drawn points


def pick(scene: Scene, instance: int, polygon: np.ndarray | None, frame: Frame | None = None, classes: Sequence[int] = (0,) * 8,
         progress: Progress | None = None) -> np.ndarray:
    """The bits of a scene's cloud that lie in an outline, (n, 2) pixels from the bottom left, or everywhere (None), and are drawn.
    frame: the scene was rendered in it last, and only what it shows is picked. classes: eight words, all 0: any."""
    corners = None if polygon is None else np.ascontiguousarray(polygon, np.float64)
    desc = abi.Pick(instance=instance, polygon=None if corners is None else corners.ctypes.data,
                    corners=0 if corners is None else len(corners), classes=tuple(classes))
    bits = np.zeros((scene.clouds[instance].count + 7) // 8, np.uint8)
    check(library().patina_scene_pick(scene._handle, frame._handle if frame else None, byref(desc), handle_of(progress),
                                      bits.ctypes.data, bits.nbytes), scene._handle, *([frame._handle] if frame else []))
    return bits


def pick_nearest(scene: Scene, instance: int, polygon: np.ndarray, place: Sequence[float], frame: Frame | None = None
                 ) -> tuple[int, np.ndarray, float] | None:
    """Of the points that pick() would find in the outline, the one that is drawn nearest to a place, in pixels from the bottom left: its
    number, its position in the object's space, (3,) float64, and how many pixels it is away. None: there is none."""
    corners = np.ascontiguousarray(polygon, np.float64)
    desc = abi.Pick(instance=instance, polygon=corners.ctypes.data, corners=len(corners))
    found = abi.Picked()
    check(library().patina_scene_pick_nearest(scene._handle, frame._handle if frame else None, byref(desc), (c_double * 2)(*place),
                                              None, byref(found)), scene._handle, *([frame._handle] if frame else []))
    return (found.number, np.array(found.position), found.distance) if found.found else None


def highlight(frame: Frame, scene: Scene, pixels: np.ndarray, color: Sequence[float], strength: float) -> None:
    """Mixes a linear color into those of a COMBINED plane's pixels, (height, width, 4) float32, that show selected points of the scene,
    which the frame rendered last."""
    values = (c_float * 3)(*color)
    check(library().patina_frame_highlight(frame._handle, scene._handle, values, strength, pixels.ctypes.data, pixels.nbytes),
          frame._handle)
