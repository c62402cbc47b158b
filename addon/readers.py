# SPDX-License-Identifier: GPL-3.0-or-later
"""The packages that read LAZ and E57, which are no part of the zip for Blender 3.4 to 4.1: what lacks, and how they come here.

They lie in a folder of their own, one a Python, at the end of where Python looks: nobody else's packages change. Blender's
Python takes nothing from the user's, and on many systems pip must not touch the system's. Nothing here knows Blender. What only
installing needs is imported by it, for Blender's start waits for this module.
"""

from __future__ import annotations

import contextlib
import importlib
import importlib.util
import sys
from collections.abc import Iterable, Iterator
from pathlib import Path, PurePosixPath

PACKAGES = {"laspy": "LAZ, COPC", "lazrs": "LAZ, COPC", "pye57": "E57", "pyquaternion": "E57"}  # by what they read

TAG = f"cp{sys.version_info[0]}{sys.version_info[1]}"


class ReadersError(Exception):
    """The text is for the artist."""


def missing() -> list[str]:
    """Packages that Python does not find."""
    found = []
    for name in PACKAGES:
        with contextlib.suppress(ImportError, ValueError):
            if importlib.util.find_spec(name):
                continue
        found.append(name)
    return found


def lacks(*names: str) -> bool:
    return any(name in names for name in missing())


def load(*names: str) -> None:
    """Imports packages, which then can be imported as ever. ImportError when one is missing.

    Python's multiprocessing, which laspy wants, keeps the script that runs under a second name; Blender 3.4 frees that script
    when it ends and crashes when it quits, for it looks at all names then."""
    known = "__mp_main__" in sys.modules
    try:
        for name in names:
            importlib.import_module(name)
    finally:
        if not known:
            sys.modules.pop("__mp_main__", None)


def wanted() -> list[str]:
    """Names with versions, as pip takes them."""
    return (Path(__file__).parent / "readers.txt").read_text("utf-8").split()


def look_in(folder: Path) -> None:
    """From now on packages are looked for in the folder, after all other places."""
    if folder.is_dir() and str(folder) not in sys.path:
        sys.path.append(str(folder))
    importlib.invalidate_caches()


def look_no_more_in(folder: Path) -> None:
    with contextlib.suppress(ValueError):
        sys.path.remove(str(folder))


def install(wheels: Iterable[Path], folder: Path) -> Iterator[str]:
    """Unpacks wheels into the folder, in place of what is there of theirs; says before each what it does. ReadersError, and the
    folder is as it was, when one is none, is for another Python or system, or cannot be written."""
    import tempfile
    wheels = sorted(wheels)
    for wheel in wheels:
        _check(wheel)
    folder.parent.mkdir(parents=True, exist_ok=True)
    try:
        with tempfile.TemporaryDirectory(dir=folder.parent, prefix=".readers-") as place:
            for wheel in wheels:
                yield f"Unpacking {wheel.name}"
                _unpack(wheel, Path(place))
            folder.mkdir(exist_ok=True)
            for item in Path(place).iterdir():
                _replace(item, folder / item.name)
    except OSError as error:
        raise ReadersError(f"{folder}: {error.strerror or error}") from None
    look_in(folder)


def _check(wheel: Path) -> None:
    """Its name says which Python and system it is for (PEP 427)."""
    parts = wheel.stem.split("-")
    if wheel.suffix != ".whl" or len(parts) not in {5, 6}:
        raise ReadersError(f"{wheel.name} is no wheel: the files end in .whl, as PyPI gives them")
    python, abi, system = parts[-3:]
    fits = "abi3" in abi or "none" in abi and "py3" in python or TAG in python.split(".")
    if not fits:
        raise ReadersError(f"{wheel.name} is for another Python than this Blender's: one with {TAG} in its name is needed")
    if system != "any" and not any(_runs_here(one) for one in system.split(".")):
        raise ReadersError(f"{wheel.name} is for another system or processor")


def _runs_here(system: str) -> bool:
    import platform
    machine = platform.machine()
    name = {"linux": "linux", "darwin": "macosx", "win32": "win"}.get(sys.platform, sys.platform)
    return name in system and (system.endswith((machine, machine.lower(), "universal2")))


def _unpack(wheel: Path, folder: Path) -> None:
    import zipfile
    try:
        with zipfile.ZipFile(wheel) as archive:
            for entry in archive.infolist():
                place = PurePosixPath(entry.filename)
                if place.is_absolute() or ".." in place.parts or "\\" in entry.filename:
                    raise ReadersError(f"{wheel.name} is damaged: it holds '{entry.filename}'")
            archive.extractall(folder)
    except (zipfile.BadZipFile, EOFError, NotImplementedError, ValueError) as error:
        raise ReadersError(f"{wheel.name} is damaged: {error}") from None


def _replace(item: Path, place: Path) -> None:
    import shutil
    if place.is_dir() and not place.is_symlink():
        shutil.rmtree(place)
    else:
        place.unlink(missing_ok=True)
    shutil.move(str(item), str(place))


def download(folder: Path, command: list[str] | None = None) -> Iterator[str]:
    """Fetches the wheels into the folder with pip, which installs nothing; says again and again what it does. ReadersError when
    there is no pip, or no way to PyPI. Closing it ends pip."""
    import subprocess
    import tempfile
    if command is None:
        if importlib.util.find_spec("pip") is None:
            raise ReadersError(f"this Blender's Python has no pip. {by_hand()}")
        command = [sys.executable, "-m", "pip"]
    words = [*command, "download", "--disable-pip-version-check", "--progress-bar", "off", "--no-input", "--no-deps",
             "--only-binary=:all:", "-d", str(folder), *wanted()]
    text = tempfile.TemporaryFile()  # noqa: SIM115  a pipe that nobody reads would stop it
    try:
        pip = subprocess.Popen(words, stdin=subprocess.DEVNULL, stdout=text, stderr=subprocess.STDOUT)
    except OSError as error:
        raise ReadersError(f"pip does not start: {error.strerror}. {by_hand()}") from None
    try:
        while pip.poll() is None:
            done = len(list(folder.glob("*.whl")))
            yield f"Fetching the readers of LAZ and E57, {done} of {len(wanted())}"
        if pip.returncode:
            text.seek(0)
            last = [line for line in text.read().decode("utf-8", "replace").splitlines() if line.strip()][-1:]
            raise ReadersError(f"pip: {''.join(last)[:200]}. {by_hand()}")
    finally:
        if pip.poll() is None:
            pip.terminate()
            pip.wait()
        text.close()


def by_hand() -> str:
    return (f"From PyPI fetch the wheels (.whl) of {', '.join(wanted())} for {TAG} and this system, with any computer, and choose "
            "them with Install from Files")
