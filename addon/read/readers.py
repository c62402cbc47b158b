# SPDX-License-Identifier: GPL-3.0-or-later
"""The packages that read LAZ and E57, and that write DXF: which are missing, and how to install them. Each is optional: the add-on works
without.

The zips contain laspy and lazrs, with lazrs compiled for each Python in BROUGHT. pye57 and ezdxf are installed on request. What is installed goes
to a folder of its own for each Python, at the end of Python's search path, so that nobody else's packages change. Blender's Python
takes nothing from the user's, and on many systems pip must not touch the system's. Nothing here knows Blender. What only installing
needs is imported there, because Blender's start waits for this module.
"""

from __future__ import annotations

import contextlib
import hashlib
import importlib
import importlib.machinery
import importlib.util
import shutil
import sys
from collections.abc import Generator, Iterable, Iterator
from pathlib import Path, PurePosixPath

from .. import whole

# Pythons that the zip's lazrs is compiled for. Blenders with extensions need Python 3.11.
BROUGHT = f"{'3.11' if __package__.startswith('bl_ext.') else '3.10'} to 3.14"
COMPILED = {"lazrs": "lazrs", "pye57": "libe57"}  # their modules that are compiled for one Python

PACKAGES = {"lazrs": "LAZ and COPC", "laspy": "EPT", "pye57": "E57", "pyquaternion": "E57",  # by what they read
            "ezdxf": "DXF", "fonttools": "DXF", "pyparsing": "DXF", "typing_extensions": "DXF"}  # or write
MODULES = {"fonttools": "fontTools"}  # of packages whose module has another name
WRITTEN = {"DXF"}  # formats that are written only

# What can be done where no wheel exists.
WITHOUT = "Convert LAZ files to LAS, and E57 files to PLY or LAS, with another program; these are read without packages"

TAG = f"cp{sys.version_info[0]}{sys.version_info[1]}"


class ReadersError(Exception):
    """The text is for the artist."""


def missing() -> list[str]:
    """Packages that this Python does not find, or finds only for other Pythons."""
    return [name for name in PACKAGES if not _there(name)]


def _there(name: str) -> bool:
    with contextlib.suppress(ImportError, ValueError):
        found = importlib.util.find_spec(MODULES.get(name, name))
        if found is None:
            return False
        if name not in COMPILED or found.submodule_search_locations is None:
            return True
        return any((Path(place) / (COMPILED[name] + suffix)).is_file()
                   for place in found.submodule_search_locations for suffix in importlib.machinery.EXTENSION_SUFFIXES)
    return False


def lacks(*names: str) -> bool:
    return any(name in names for name in missing())


def status() -> list[tuple[str, bool]]:
    """A line for each group of formats, for the preferences, and whether it can be read."""
    lines, lacking = [], missing()
    for formats in dict.fromkeys(PACKAGES.values()):
        needed = [name for name in PACKAGES if PACKAGES[name] == formats]
        absent = [name for name in needed if name in lacking]
        lines.append((f"{formats}: needs the Python package{'s' * (len(absent) > 1)} {' and '.join(absent)}" if absent else
                      f"{formats}: can be {'written' if formats in WRITTEN else 'read'}", not absent))
    return lines


def how_to(formats: str) -> str:
    """What to do where a file of these formats cannot be read."""
    absent = [name for name in missing() if PACKAGES[name] == formats] or [name for name in PACKAGES if PACKAGES[name] == formats]
    brought = (f" Patina's zip contains them for Python {BROUGHT}; this Blender has Python {_python()}." if "lazrs" in absent else "")
    return (f"{formats} files need the Python package{'s' * (len(absent) > 1)} {' and '.join(absent)}.{brought} "
            "Choose Install Readers in the add-on's preferences")


def _python() -> str:
    return f"{sys.version_info[0]}.{sys.version_info[1]}"


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
    """The missing packages with their versions, as pip takes them; all of them if none is missing."""
    every = (Path(__file__).parents[1] / "readers.txt").read_text("utf-8").split()
    lacking = missing()
    return [line for line in every if line.partition("==")[0] in lacking] or every


def look_in(folder: Path) -> None:
    """Adds the folder to Python's search path: at the end, or first where a package is found elsewhere for other Pythons only."""
    if folder.is_dir() and str(folder) not in sys.path:
        broken = any((folder / name).is_dir() and not _there(name) and importlib.util.find_spec(name) for name in COMPILED)
        sys.path.insert(0 if broken else len(sys.path), str(folder))
    importlib.invalidate_caches()


def held(folder: Path) -> tuple[int, int]:
    """How many files of installed packages a folder holds, and their bytes. 0 if there is no folder."""
    sizes = [path.stat().st_size for path in folder.rglob("*") if path.is_file()]
    return len(sizes), sum(sizes)


def remove(folder: Path) -> tuple[int, int]:
    """Deletes the installed packages of all Pythons. Returns how many files and bytes are gone. Windows keeps those in use."""
    before = held(folder)
    shutil.rmtree(folder, ignore_errors=True)
    importlib.invalidate_caches()
    after = held(folder)
    return before[0] - after[0], before[1] - after[1]


def look_no_more_in(folder: Path) -> None:
    with contextlib.suppress(ValueError):
        sys.path.remove(str(folder))


def install(wheels: Iterable[Path], folder: Path) -> Iterator[str]:
    """Unpacks wheels into the folder, in place of what is there of theirs; says before each what it does. ReadersError, and the
    folder is as it was, when one is none, is for another Python or system, or cannot be written."""
    wheels = sorted(wheels)
    sums = _sums()
    for wheel in wheels:
        _check(wheel)
        if wheel.name in sums and sums[wheel.name] != _sum_of(wheel):
            raise ReadersError(f"{wheel.name} is not the file that PyPI has under this name: its checksum differs. Fetch it again")
    folder.parent.mkdir(parents=True, exist_ok=True)
    try:
        with whole.Folder(".readers-", folder.parent) as place:
            for wheel in wheels:
                yield f"Unpacking {wheel.name}"
                _unpack(wheel, place)
            folder.mkdir(exist_ok=True)
            for item in place.iterdir():
                _replace(item, folder / item.name)
    except OSError as error:
        raise ReadersError(f"{folder}: {error.strerror or error}") from None
    look_in(folder)


def _sums() -> dict[str, str]:
    """The wheels that PyPI has of these packages: name → SHA-256 (build/reader_sums)."""
    lines = (Path(__file__).parents[1] / "readers.sha256").read_text("utf-8").splitlines()
    return {name: value for value, name in (line.split() for line in lines if not line.startswith("#"))}


def _sum_of(wheel: Path) -> str:
    try:
        return hashlib.sha256(wheel.read_bytes()).hexdigest()
    except OSError as error:
        raise ReadersError(f"{wheel}: {error.strerror or error}") from None


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
    """Fetches the wheels of the missing packages into the folder with pip, which installs nothing. Yields texts of what it does.
    ReadersError when there is no pip or no way to PyPI, or when PyPI has none of the wheels for this Python. Closing it ends pip."""
    if command is None:
        command = _pip_command()
    names, none = wanted(), []
    for index, name in enumerate(names):
        words = [*command, "download", "--disable-pip-version-check", "--progress-bar", "off", "--no-input", "--no-deps",
                 "--only-binary=:all:", "-d", str(folder), name]
        told = yield from _pip(words, f"Fetching {name}, {index} of {len(names)}")
        if "No matching distribution" in told:
            none.append(name)
        elif told:
            raise ReadersError(f"pip: {told[:200]}. {by_hand()}")
    known = _sums()
    strange = next((wheel.name for wheel in sorted(folder.glob("*.whl")) if wheel.name not in known), None)
    if strange:
        raise ReadersError(f"pip fetched {strange}, which is none of the files that this Patina was made for. {by_hand()}")
    if none:
        yield f"No wheels of {', '.join(none)}"
    if none == names:
        raise ReadersError(f"PyPI has no wheel of {', '.join(none)} for Python {_python()} on this system yet. {WITHOUT}")


def _pip_command() -> list[str]:
    """This Python's pip; else the one that Python's ensurepip or the system would install, run from its wheel."""
    if importlib.util.find_spec("pip"):
        return [sys.executable, "-m", "pip"]
    for folder in _wheels_of_pip():
        found = sorted(folder.glob("pip-*.whl"))
        if found:
            return [sys.executable, str(found[-1] / "pip")]
    raise ReadersError(f"this Blender's Python has no pip. {by_hand()}")


def _wheels_of_pip() -> list[Path]:
    known = importlib.util.find_spec("ensurepip")
    own = [Path(known.origin).parent / "_bundled"] if known and known.origin else []
    return [*own, Path("/usr/share/python-wheels")]


def _pip(words: list[str], doing: str) -> Generator[str, None, str]:
    """Runs pip and yields the text until it ends. Returns its last line if it failed, else an empty text."""
    import subprocess
    import tempfile
    with tempfile.TemporaryFile() as text:  # a pipe that nobody reads would stop it
        try:
            pip = subprocess.Popen(words, stdin=subprocess.DEVNULL, stdout=text, stderr=subprocess.STDOUT)
        except OSError as error:
            raise ReadersError(f"pip does not start: {error.strerror}. {by_hand()}") from None
        try:
            while pip.poll() is None:
                yield doing
            if not pip.returncode:
                return ""
            text.seek(0)
            lines = [line for line in text.read().decode("utf-8", "replace").splitlines() if line.strip()]
            if any("Retrying" in line for line in lines):  # its last line then says that there is no such package
                return "PyPI cannot be reached"
            return "".join(lines[-1:]) or f"it ended with {pip.returncode}"
        finally:
            if pip.poll() is None:
                pip.terminate()
                pip.wait()


def by_hand() -> str:
    return (f"From PyPI fetch the wheels (.whl) of {', '.join(wanted())} for {TAG} and this system, with any computer, and choose "
            "them with Install from Files")
