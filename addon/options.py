# SPDX-License-Identifier: GPL-3.0-or-later
"""What a command line sets for one run:

    blender -b scene.blend -E PATINA -a -- --patina-device cpu --patina-threads 4 --patina-quality paper --patina-samples 8 \
        --patina-noise 0.01 --patina-strict

--patina-strict: a frame that lacks what it was to show (a file that is missing or cannot be read, any points at all) fails, where
it else is rendered without and warns. Words of other add-ons behind the `--` are left alone.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence

from .native import PatinaError

DEVICES = {"auto": 'AUTO', "cpu": 'CPU', "cpu-scalar": 'CPU_SCALAR', "gl-egl": 'GL', "gl-wgl": 'GL', "gl-osmesa": 'GL_SOFTWARE'}
QUALITIES = {"refined": 'REFINED', "paper": 'PAPER'}
SWITCHES = {"strict"}  # without a value
_PREFIX = "--patina-"


def read(arguments: Sequence[str] | None = None) -> dict[str, str | int | float]:
    """Scene properties by name that the command line overrides. PatinaError for what it misspells."""
    words = list(sys.argv if arguments is None else arguments)
    words = words[words.index("--") + 1:] if "--" in words else []
    found: dict[str, str | int | float] = {}
    for index, word in enumerate(words):
        if word.startswith(_PREFIX):
            name, sign, value = word[len(_PREFIX):].partition("=")
            if not sign and name not in SWITCHES:
                value = words[index + 1] if index + 1 < len(words) else ""
            found[name] = _value(name, value)
    return found


def _value(name: str, value: str) -> str | int | float:
    if name in SWITCHES:
        if value:
            raise PatinaError(f"{_PREFIX}{name} '{value}': it does not take a value", -1)
        return 1
    choices = {"device": DEVICES, "quality": QUALITIES}.get(name)
    if choices:
        if value not in choices:
            raise PatinaError(f"{_PREFIX}{name} '{value}': one of {', '.join(choices)} was expected", -1)
        return choices[value]
    if name == "noise":
        try:
            noise = float(value)
        except ValueError:
            noise = -1.0
        if not 0.0 <= noise <= 1.0:
            raise PatinaError(f"{_PREFIX}{name} '{value}': a number from 0 to 1 was expected", -1)
        return noise
    if name in {"threads", "samples"}:
        if not value.isdigit() or int(value) > 1024:
            raise PatinaError(f"{_PREFIX}{name} '{value}': a number up to 1024 was expected", -1)
        return int(value)
    raise PatinaError(f"there is no option {_PREFIX}{name}: only device, threads, quality, samples, noise and strict", -1)
