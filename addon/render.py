# SPDX-License-Identifier: GPL-3.0-or-later
"""Described scene in, planes out. Final render and viewport share this; nothing here knows Blender."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterable
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from . import jobs, native
from .sync import DeviceChoice, SceneDescription


@dataclass(frozen=True)
class Picture:
    planes: dict[str, np.ndarray]  # (height, width, channels) by plane name, row 0 at the bottom
    stats: dict[str, Any]
    device: str
    notice: str = ""  # what the artist should know about how it came to be


# The device outlives frames: starting threads or a GL context costs more than many a picture.
_device: tuple[DeviceChoice, native.Device] | None = None
_device_lock = threading.Lock()


def device_for(choice: DeviceChoice) -> native.Device:
    global _device
    with _device_lock:
        if _device is None or _device[0] != choice:
            _device = (choice, native.Device(choice.name, choice.threads))
        return _device[1]


def forget_device() -> None:
    """Lets go of the device; frames that still use it keep it alive."""
    global _device
    with _device_lock:
        _device = None


def draw(description: SceneDescription, planes: Iterable[str], poll: Callable[[float], bool]) -> Picture:
    """Renders on a worker thread; poll(progress) is called on this one and returns True to cancel.
    Where the GPU fails in the middle of it (lost context, memory, a broken driver) the CPU draws the picture."""
    wanted = list(planes)
    device = _open(description.device, poll)
    try:
        return _draw_on(device, description, wanted, poll)
    except native.PatinaCancelled:
        raise
    except native.PatinaError as error:
        if not device.name.startswith("gl"):
            raise
        reason = str(error)  # the error itself would keep the whole picture alive
    forget_device()
    picture = _draw_on(_open(replace(description.device, name="cpu"), poll), description, wanted, poll)
    return replace(picture, notice=f"{device.name} failed, the CPU drew this picture: {reason}")


def _open(choice: DeviceChoice, poll: Callable[[float], bool]) -> native.Device:
    return jobs.run(lambda: device_for(choice), lambda: None, lambda: poll(0.0))


def _draw_on(device: native.Device, description: SceneDescription, wanted: list[str],
             poll: Callable[[float], bool]) -> Picture:
    # The frame is made and closed on this thread, so that poll never meets a dead handle.
    with native.Scene() as scene, native.Frame(device) as frame:
        _describe(scene, description, wanted)

        def work() -> Picture:
            frame.render(scene)
            return Picture({name: frame.read(name) for name in wanted}, frame.stats(), device.name)

        return jobs.run(work, frame.cancel, lambda: poll(frame.progress()))


def _bits(planes: Iterable[str]) -> int:
    return sum(1 << native.PLANES[name][0] for name in set(planes))


def _describe(scene: native.Scene, description: SceneDescription, wanted: list[str]) -> None:
    planes = {native.split_plane(plane) for plane in ["COMBINED", *wanted]}
    settings = asdict(description.settings)
    settings["passes"] = _bits(name for name, layer in planes if not layer)
    settings["layer_passes"] = _bits(name for name, layer in planes if layer)
    settings["layers"] = max(settings["layers"], *(layer for _, layer in planes))  # a pass wants its layer peeled
    scene.set_settings(**settings)
    scene.set_camera(**asdict(description.camera))
    for light in description.lights:
        scene.add_light(**asdict(light))
    for item in description.clouds:
        scene.add_cloud(item.cloud, **asdict(item.style))
