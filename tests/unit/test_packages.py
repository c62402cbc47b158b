# SPDX-License-Identifier: GPL-3.0-or-later
"""What `build/package --all` packed: each platform's library where the add-on looks for it, of its machine, and on what it may rely. Of
macOS, which cannot be run here, the load commands: the oldest system and the signature that Apple's processors ask for. Extensions pass
the validator of Blender's own extension add-on, and the sources that they bring are whole.

    test_packages.py [FOLDER]        (default build/out/packages/all)
"""
import base64
import hashlib
import io
import re
import struct
import subprocess
import sys
import tarfile
import tempfile
import zipfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
FOLDER = Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "build/out/packages/all"
NAMES = {"windows": "patina.dll", "macos": "libpatina.dylib", "linux": "libpatina.so"}
DECLARED = {name for header in (ROOT / "native/include/patina").glob("*.h")
            for name in re.findall(r"^PATINA_API [^;(]*?(patina_\w+)\(", header.read_text(encoding="utf-8"), re.M)}


def text_at(data, at):
    return data[at:data.index(b"\0", at)].decode()


def read_elf(data):
    """(machine, names that it exports, libraries that it needs) of a 64-bit ELF, little-endian."""
    machine, = struct.unpack_from("<H", data, 18)
    sections, size, count = struct.unpack_from("<Q", data, 40)[0], *struct.unpack_from("<HH", data, 58)
    tables = [struct.unpack_from("<IIQQQQIIQQ", data, sections + i * size) for i in range(count)]
    exported, needed = set(), set()
    for _, kind, _, _, offset, length, link, _, _, each in tables:
        names = tables[link][4] if kind in (6, 11) else 0
        for at in range(offset, offset + length, each) if kind in (6, 11) else ():
            if kind == 11:  # dynamic symbols
                name, info, _, section = struct.unpack_from("<IBBH", data, at)
                if section and info >> 4:
                    exported.add(text_at(data, names + name))
            elif struct.unpack_from("<Q", data, at)[0] == 1:  # DT_NEEDED
                needed.add(text_at(data, names + struct.unpack_from("<Q", data, at + 8)[0]))
    for _, kind, _, _, offset, _, link, count, _, _ in tables:
        for _ in range(count if kind == 0x6FFFFFFE else 0):  # SHT_GNU_verneed
            _, versions, _, first, after = struct.unpack_from("<HHIII", data, offset)
            at = offset + first
            for _ in range(versions):
                _, _, _, name, behind = struct.unpack_from("<IHHII", data, at)
                needed.add(text_at(data, tables[link][4] + name))
                at += behind
            offset += after
    return {62: "x64", 183: "arm64"}.get(machine), exported, needed


def read_pe(data):
    """The same of a DLL."""
    at, = struct.unpack_from("<I", data, 60)
    assert data[at:at + 4] == b"PE\0\0"
    machine, count = struct.unpack_from("<HH", data, at + 4)
    optional, = struct.unpack_from("<H", data, at + 20)
    tables = [struct.unpack_from("<8s4I", data, at + 24 + optional + 40 * i) for i in range(count)]

    def place(address):
        return next(address - start + raw for _, size, start, length, raw in tables if start <= address < start + max(size, length))

    exports, _, imports = struct.unpack_from("<3I", data, at + 24 + 112)
    names_count, _, names = struct.unpack_from("<3I", data, place(exports) + 24)
    exported = {text_at(data, place(struct.unpack_from("<I", data, place(names) + 4 * i)[0])) for i in range(names_count)}
    needed, entry = set(), place(imports)
    while any(data[entry:entry + 20]):
        needed.add(text_at(data, place(struct.unpack_from("<I", data, entry + 12)[0])).lower())
        entry += 20
    return {0x8664: "x64", 0xAA64: "arm64"}.get(machine), exported, needed


def read_macho(data):
    """The same of a dylib, its oldest system and whether it is signed among what it needs."""
    magic, machine, _, kind, count = struct.unpack_from("<5I", data)
    assert magic == 0xFEEDFACF and kind == 6, (magic, kind)
    at, exported, needed = 32, set(), set()
    for _ in range(count):
        command, size = struct.unpack_from("<2I", data, at)
        if command & 0x7FFFFFFF == 0xC:  # LC_LOAD_DYLIB
            needed.add(text_at(data, at + struct.unpack_from("<I", data, at + 8)[0]))
        elif command == 0x32:  # LC_BUILD_VERSION
            platform, oldest = struct.unpack_from("<2I", data, at + 8)
            assert platform == 1, platform
            needed.add(f"macOS {oldest >> 16}.{oldest >> 8 & 255}")
        elif command == 0x1D:  # LC_CODE_SIGNATURE
            offset, length = struct.unpack_from("<2I", data, at + 8)
            assert data[offset:offset + 4] == b"\xfa\xde\x0c\xc0" and offset + length <= len(data)
            needed.add("a signature")
        elif command == 2:  # LC_SYMTAB
            symbols, symbol_count, names, _ = struct.unpack_from("<4I", data, at + 8)
            for i in range(symbol_count):
                name, kind, section = struct.unpack_from("<IBB", data, symbols + 16 * i)
                if kind & 1 and section and not kind & 0x10:  # defined, seen from outside
                    exported.add(text_at(data, names + name)[1:])
        at += size
    return {0x01000007: "x64", 0x0100000C: "arm64"}.get(machine), exported, needed


LINKERS = {"__dso_handle", "_mh_dylib_header"}  # every dylib's own, which the linker makes
READERS = {"windows": read_pe, "macos": read_macho, "linux": read_elf}
GLIBC = (2, 28)
MAY = {"windows": re.compile(r"(kernel32|shell32|advapi32|ntdll)\.dll|api-ms-win-.*\.dll|ucrtbase\.dll"),
       "linux": re.compile(r"(libc|libm|libpthread|libdl)\.so\.\d+|ld-linux.*|GLIBC_.*"),
       "macos": re.compile(r"/usr/lib/libSystem\.B\.dylib|macOS 11\.0|a signature")}


def library_of_wheel(path, data, name):
    """Its bytes, out of a wheel that says of itself what it is, and of its files what they are."""
    tag = path.removesuffix(".whl").split("-", 2)[2]
    with zipfile.ZipFile(io.BytesIO(data)) as wheel:
        info = next(entry for entry in wheel.namelist() if entry.endswith("/WHEEL")).removesuffix("/WHEEL")
        assert f"Tag: {tag}\n" in wheel.read(f"{info}/WHEEL").decode() and tag.startswith("py3-none-"), tag
        rows = [line.split(",") for line in wheel.read(f"{info}/RECORD").decode().splitlines()]
        assert {row[0] for row in rows} == set(wheel.namelist())
        for entry, digest, size in rows[:-1]:
            found = wheel.read(entry)
            assert digest == "sha256=" + base64.urlsafe_b64encode(hashlib.sha256(found).digest()).rstrip(b"=").decode(), entry
            assert int(size) == len(found), entry
        assert f'"{name}"' in wheel.read("patina_library/__init__.py").decode()
        return wheel.read(f"patina_library/{name}")


def validators():
    """{Blender: its own validator of extensions}, of the Blenders that are here as modules."""
    found = (ROOT / "build/out").glob("bpy*/lib/python3*/site-packages/bpy/*/scripts/addons_core/bl_pkg/cli/blender_ext.py")
    return {path.parents[4].name: path for path in sorted(found)}


def validate(path):
    for blender, validator in validators().items():
        done = subprocess.run([sys.executable, validator, "validate", path], capture_output=True, text=True, check=False)
        said = done.stdout + done.stderr
        assert done.returncode == 0 and "error" not in said.lower(), f"Blender {blender}: {said}"


def check_sources(data, library):
    """The library's sources are whole: CMake finds each of them, no kernel lacks its twin, and they have the library's version."""
    with tempfile.TemporaryDirectory() as scratch, tarfile.open(fileobj=io.BytesIO(data)) as archive:
        archive.extractall(scratch)
        root = next(Path(scratch).iterdir())
        for command in (["build/check_twins", "--quiet"], ["cmake", "--preset", "release", "-S", "build"],
                        ["ninja", "-C", "build/out/release", "-n", "libpatina.so"], ["build/stamp", "version.c"]):
            done = subprocess.run(command, cwd=root, capture_output=True, text=True, check=False)
            assert done.returncode == 0, f"{command}: {(done.stdout + done.stderr)[-500:]}"
        version = re.search(r'"(.*\+.*)"', (root / "version.c").read_text(encoding="utf-8")).group(1)
        assert version.encode() + b"\0" in library, f"the sources are {version}; the library is not"


def check_notices(path):
    """No file of unknown origin, and notices of all others."""
    done = subprocess.run([ROOT / "build/notices", "--check", path], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr


def check(platform, path):
    check_notices(path)
    system, processor = platform.split("-")
    legacy = path.stem.endswith("-legacy")
    with zipfile.ZipFile(path) as archive:
        prefix = "patina/" if legacy else ""
        libraries = [name for name in archive.namelist() if name.startswith((f"{prefix}lib/", f"{prefix}wheels/patina_library-"))]
        assert len(libraries) == 1, libraries
        data = archive.read(libraries[0])
        if legacy:
            assert libraries == [f"{prefix}lib/{NAMES[system]}"], libraries
        else:
            data = library_of_wheel(libraries[0], data, NAMES[system])
            told = archive.read("docs/WHEELS.md").decode()
            manifest = archive.read("blender_manifest.toml").decode()
            assert f'platforms = ["{platform}"]' in manifest, manifest
            listed = set(re.findall(r'"\./(wheels/[^"]+)"', manifest))
            assert listed == {name for name in archive.namelist() if name.startswith("wheels/")}, listed
            assert all(f"## {name.removeprefix('wheels/')}\n" in told for name in listed) and "not said" not in told, told
            if platform == "linux-x64":
                check_sources(archive.read("docs/sources.tar.xz"), data)
            assert all("-py3-none-" in name for name in listed), f"bound to one Python, others could not enable it: {listed}"
        packed = [name for name in archive.namelist() if "lazrs" in name and (name.endswith(".whl") or ".dist-info/METADATA" in name)]
        assert packed or platform == "windows-arm64", "no lazrs"  # of which PyPI has no wheel
        machine, exported, needed = READERS[system](data)
    assert machine == processor, machine
    assert not DECLARED - exported, f"does not export {sorted(DECLARED - exported)}"
    own = exported - LINKERS if system == "macos" else exported
    assert not [name for name in own if not name.startswith("patina_")], sorted(own - DECLARED)
    assert not [name for name in needed if not MAY[system].fullmatch(name)], needed
    newest = max((tuple(map(int, name.removeprefix("GLIBC_").split("."))) for name in needed if name.startswith("GLIBC_")), default=())
    assert newest <= GLIBC, newest
    assert path.stat().st_size < 12e6, f"{path.stat().st_size / 1e6:.2f} MB"
    if not legacy:
        validate(path)
    if system == "macos":
        assert "macOS 11.0" in needed and (processor == "x64" or "a signature" in needed), needed  # Intel's Macs take what is not signed
    needs = sorted(name for name in needed if not name.startswith("GLIBC_"))
    return f"{path.stat().st_size / 1e6:.2f} MB, needs {', '.join(needs)}" + (f", glibc {newest[0]}.{newest[1]}" if newest else "")


def main():
    passed = failed = skipped = 0
    print(f"validators of Blender {', '.join(validators()) or '–'}")
    if not validators():
        skipped = 1
        print("skip validator: build/out/bpy42, bpy45, bpy50, bpy51 and bpy53 are not there, which bring it")
    for path in sorted(FOLDER.glob("patina-*.zip")):
        platform = re.search(r"(linux|windows|macos)-(x64|arm64)", path.stem).group()
        try:
            print(f"ok {path.name}: {check(platform, path)}")
            passed += 1
        except Exception as error:  # noqa: BLE001
            print(f"FAILED {path.name}: {type(error).__name__}: {error}")
            failed += 1
    print(f"{passed} passed, {failed + (not passed)} failed, {skipped} skipped")
    return failed or not passed


if __name__ == "__main__":
    sys.exit(main())
