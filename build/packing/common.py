# SPDX-License-Identifier: GPL-3.0-or-later
"""What all packages share: platforms, the compiled library, and the writing of zips and wheels."""
import base64
import hashlib
import importlib.machinery
import importlib.util
import io
import shutil
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
OUT = ROOT / "build/out/packages"
LARGEST = 12_000_000  # bytes of a zip; a reason to look for what has become large

# As Blender calls a platform: preset, where the library lies, and what pip calls it, the last as our own wheel is called. linux-x64 is
# the release build on every way.
PLATFORMS = {
    "linux-x64": ("release", "libpatina.so", ("manylinux2014_x86_64", "manylinux_2_28_x86_64")),
    "linux-arm64": ("linux-arm64", "libpatina.so", ("manylinux2014_aarch64", "manylinux_2_28_aarch64")),
    "windows-x64": ("windows-x64", "patina.dll", ("win_amd64",)),
    "windows-arm64": ("windows-arm64", "patina.dll", ("win_arm64",)),
    "macos-x64": ("macos-x64", "libpatina.dylib", ("macosx_10_9_x86_64", "macosx_10_12_x86_64", "macosx_11_0_x86_64")),
    "macos-arm64": ("macos-arm64", "libpatina.dylib", ("macosx_11_0_arm64",)),
}

_loader = importlib.machinery.SourceFileLoader("notices", str(ROOT / "build/notices"))
NOTICES = importlib.util.module_from_spec(importlib.util.spec_from_loader("notices", _loader))
_loader.exec_module(NOTICES)


def say(text):
    print(f"package: {text}", flush=True)


def compiled(platform, folder):
    """The stripped library."""
    preset, name, _ = PLATFORMS[platform]
    built, library = ROOT / "build/out" / preset / name, folder / name
    if platform == "linux-x64":
        subprocess.run([ROOT / "build/compile", "release"], check=True)
        subprocess.run(["strip", "--strip-unneeded", "-o", library, built], check=True)
    else:
        subprocess.run([ROOT / "build/compile", preset, "patina_shared"], check=True)
        if name.endswith(".dylib"):  # linked without what could be stripped; another hand in it would break its signature
            shutil.copyfile(built, library)
        else:
            subprocess.run(["llvm-strip", "--strip-unneeded", "-o", library, built], check=True)
    return library


def wheel(stem, tag, files, folder):
    """PEP 427. files: {name: bytes}, without RECORD and WHEEL."""
    info = f"{stem}.dist-info"
    files = files | {f"{info}/WHEEL": f"Wheel-Version: 1.0\nGenerator: build/package\nRoot-Is-Purelib: false\nTag: {tag}\n".encode()}
    rows = [f"{name},sha256={base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b'=').decode()},{len(data)}"
            for name, data in sorted(files.items())]
    files[f"{info}/RECORD"] = "\n".join([*rows, f"{info}/RECORD,,", ""]).encode()
    path = folder / f"{stem}-{tag}.whl"
    zipped(path, "", files)
    return path


def zipped(path, prefix, files):
    """path: or a file of bytes. The same input gives the same bytes."""
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as archive:
        for name, source in sorted(files.items()):
            entry = zipfile.ZipInfo(prefix + name, (2020, 1, 1, 0, 0, 0))
            entry.compress_type, entry.external_attr = zipfile.ZIP_DEFLATED, 0o644 << 16
            if isinstance(source, Path) and source.stat().st_mode & 0o100:
                entry.external_attr = 0o755 << 16
            archive.writestr(entry, source if isinstance(source, bytes) else source.read_bytes())


def tarred(prefix, files, links=None, program=lambda name: False):
    """The bytes of a tar file. files: path, text or bytes of each. links: target of each. program: whether a name, or a path that is
    executable, may be run. The same input gives the same bytes."""
    out = io.BytesIO()
    links = links or {}
    with tarfile.open(fileobj=out, mode="w", format=tarfile.USTAR_FORMAT) as archive:
        for name in sorted(files | links):
            entry = tarfile.TarInfo(f"{prefix}/{name}")
            entry.mtime, entry.uname, entry.gname = 1577836800, "root", "root"
            if name in links:
                entry.type, entry.linkname, entry.mode = tarfile.SYMTYPE, links[name], 0o777
                archive.addfile(entry)
                continue
            source = files[name]
            data = source.encode() if isinstance(source, str) else source.read_bytes() if isinstance(source, Path) else source
            runs = program(name) or isinstance(source, Path) and source.stat().st_mode & 0o100
            entry.size, entry.mode = len(data), 0o755 if runs else 0o644
            archive.addfile(entry, io.BytesIO(data))
    return out.getvalue()


def pack(path, prefix, files):
    """Writes a zip, with the notices of what is in it."""
    package = NOTICES.Package({name: source if isinstance(source, bytes) else source.read_bytes() for name, source in files.items()})
    if package.faults:
        sys.exit("\n".join(f"package: {fault}" for fault in package.faults))
    files = files | {"NOTICE.txt": NOTICES.notices(package).encode()}
    zipped(path, prefix, files)
    size = path.stat().st_size
    print(f"{path.relative_to(ROOT)}: {len(files)} files, {size / 1e6:.2f} MB")
    if size > LARGEST:
        sys.exit(f"package: {path.name} is larger than {LARGEST / 1e6:.0f} MB")
