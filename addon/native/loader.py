# SPDX-License-Identifier: GPL-3.0-or-later
"""The shared library: where it is, its calls with their types, its errors as exceptions, its log.

Only the handles beside use it. Every call that fails raises `PatinaError` with the library's own sentence.
"""

from __future__ import annotations

import ctypes
import importlib
import os
import sys
import threading
from ctypes import byref, c_int, c_void_p
from pathlib import Path

import numpy as np

from . import abi

MEMORY, FILE, FORMAT, CANCELLED, TOO_MANY_POINTS, INTERNAL, TOO_LARGE = (
    abi.ERROR[f"ERROR_{name}"] for name in ("MEMORY", "FILE", "FORMAT", "CANCELLED", "TOO_MANY_POINTS", "INTERNAL", "TOO_LARGE"))

# Arrays of patina_neighbourhoods: type and width, 0: one number a point, -1: as many as neighbours.
NEIGHBOURHOODS = {"normal": (np.float32, 3), "axis": (np.float32, 3), "spacing": (np.float32, 0), "half_axes": (np.float32, 2),
                  "sigma": (np.float32, 0), "kind": (np.uint8, 0), "trust": (np.float32, 0), "seen_through": (np.uint8, 0), "numbers": (np.uint32, -1),
                  "distances": (np.float64, -1), "soft_radius": (np.float32, 0), "uncertainty": (np.float32, 0)}

TYPES = {name.lower(): value for name, value in abi.TYPE.items()}  # patina_type by numpy's name


def split_plane(plane: str) -> tuple[str, int]:
    """"DEPTH 3" is the depth of layer 3; "DEPTH" that of the picture, layer 0."""
    name, _, layer = plane.partition(" ")
    return name, int(layer or 0)


class PatinaError(Exception):
    """A call that failed: `code` from the header's list, the library's sentence as text."""

    def __init__(self, message: str, code: int = INTERNAL) -> None:
        super().__init__(message)
        self.code = code


class PatinaCancelled(PatinaError):
    """A call that was cancelled on request."""


_loaded: ctypes.CDLL | None = None
_loading = threading.Lock()


def library_path() -> Path:
    """Where the library is looked for: $PATINA_LIBRARY, else lib/ in this package, else what the extension's wheel brought."""
    override = os.environ.get("PATINA_LIBRARY")
    if override:
        return Path(override)
    name = {"win32": "patina.dll", "darwin": "libpatina.dylib"}.get(sys.platform, "libpatina.so")
    beside = Path(__file__).parents[1] / "lib" / name
    if beside.is_file():
        return beside
    try:
        return importlib.import_module("patina_library").PATH
    except ImportError:
        return beside


def library() -> ctypes.CDLL:
    """Loads the library at the first call. PatinaError if it is missing or its interface differs from abi.py."""
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
        raise PatinaError(f"Patina's library is missing: there is no {path}. Install the package of Patina for this "
                          "platform, or let the environment variable PATINA_LIBRARY name the file")
    try:
        lib = ctypes.CDLL(str(path))
        lib.patina_version.restype = ctypes.c_char_p
        version = lib.patina_version().decode("ascii")
        given = tuple(int(part) for part in version.partition("+")[0].split(".")[:2])
    except (OSError, AttributeError, ValueError) as error:
        raise PatinaError(f"Patina's library {path} cannot be loaded: {error}. {_remedy()}") from None
    needed = ".".join(str(part) for part in abi.VERSION)
    if not fits(given, abi.VERSION):
        raise PatinaError(f"Patina's library {path} has version {version}. This Patina needs version {needed}. {_remedy()}")
    difference = _declare(lib)
    if difference:
        raise PatinaError(f"Patina's library {path}, version {version}, is not of the same build as this Patina, version {needed}: "
                          f"{difference}. {_remedy()}")
    return lib


def fits(library: tuple[int, ...], needed: tuple[int, ...]) -> bool:
    """Whether a library of one (major, minor) version has the interface of another: before 1.0 the same, then a later minor one too."""
    return library[:2] == needed[:2] if needed[0] == 0 else library[0] == needed[0] and library[1] >= needed[1]


def _declare(lib: ctypes.CDLL) -> str:
    """Sets the types of all calls. Returns what the library's interface lacks of abi.py, or ""."""
    for name, arguments in abi.CALLS.items():
        call = getattr(lib, name, None)
        if call is None:
            return f"it has no function {name}"
        call.argtypes = arguments
        call.restype = abi.RESULTS.get(name, c_int)
    for name, kind in vars(abi).items():
        if not isinstance(kind, type) or not issubclass(kind, ctypes.Structure) or not getattr(kind, "_fields_", None):
            continue
        called = "patina" + "".join(f"_{letter.lower()}" if letter.isupper() else letter for letter in name)
        size, own = lib.patina_struct_size(called.encode()), ctypes.sizeof(kind)
        # A structure with struct_size may grow at its end. Others never change.
        if size < own if issubclass(kind, abi.Descriptor) else size != own:
            return f"its {called} has {size} bytes, {own} are needed"
    return ""


def _remedy() -> str:
    """What the user can do about a library that does not fit."""
    if os.environ.get("PATINA_LIBRARY"):
        return "The environment variable PATINA_LIBRARY names this file: remove the variable, or let it name the library of this Patina"
    return "Install Patina again, then restart the program that uses it"


def _message(handle: c_void_p | None) -> str:
    buffer = ctypes.create_string_buffer(2048)
    library().patina_message(handle, buffer, len(buffer))
    return buffer.value.decode("utf-8", "replace")


def check(code: int, *handles: c_void_p | None) -> None:
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
