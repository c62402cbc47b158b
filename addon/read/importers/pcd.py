# SPDX-License-Identifier: GPL-3.0-or-later
"""PCD, the Point Cloud Library's format: ascii, binary and binary_compressed (LZF)."""

from __future__ import annotations

import contextlib
from pathlib import Path

import numpy as np

from ... import jobs, native
from .reading import Filter, PointFile, Progress, grid_normals, origin_of, regular, scanners_of, told

_KINDS = {("F", 4): "<f4", ("F", 8): "<f8", ("U", 1): "u1", ("U", 2): "<u2", ("U", 4): "<u4", ("U", 8): "<u8",
          ("I", 1): "i1", ("I", 2): "<i2", ("I", 4): "<i4", ("I", 8): "<i8"}


TEXT_PIECE = 1 << 19  # bytes that take some 30 ms
MOST_FIELDS = 1024
COPIES = 1 << 16  # of a compressed file, the same


def _fail(path: Path, what: str) -> native.PatinaError:
    return native.PatinaError(f"{path.name}: {told(what)[:500]}", -4)  # what the file says is no more than text


def _header(path: Path, head: bytes) -> tuple[dict[str, list[str]], int]:
    """The header's words by key, and where the data begin."""
    words: dict[str, list[str]] = {}
    at = 0
    while at < len(head) and "DATA" not in words:
        end = head.find(b"\n", at)
        if end < 0:
            break
        line = head[at:end].decode("utf-8", "replace").split("#")[0].split()
        if line:
            words[line[0]] = line[1:]
        at = end + 1
    if "DATA" not in words or not words.get("FIELDS"):
        raise _fail(path, "not a PCD file: its header has no FIELDS or no DATA")
    return words, at


def _columns(path: Path, words: dict[str, list[str]]) -> np.dtype:
    fields = words["FIELDS"]
    if len(fields) > MOST_FIELDS:
        raise _fail(path, f"it has {len(fields):,} fields; at most {MOST_FIELDS:,} are read")
    counts = words.get("COUNT", ["1"] * len(fields))
    for name, count in zip(fields, counts, strict=False):
        if not count.isascii() or not count.isdigit() or not 0 < len(count) < 9 or not int(count):
            raise _fail(path, f"COUNT of field '{name[:40]}' is {count[:40]}; at least 1 is needed")
    try:
        kinds = [_KINDS[kind, int(size)] for kind, size in zip(words["TYPE"], words["SIZE"], strict=True)]
        return np.dtype([(f"{name}.{i}" if name in fields[:i] or name == "_" else name, kind, (int(count),))
                         for i, (name, kind, count) in enumerate(zip(fields, kinds, counts, strict=True))])
    except (KeyError, ValueError) as error:
        raise _fail(path, f"FIELDS, SIZE, TYPE and COUNT do not fit together: {str(error)[:200]}") from None


def _count(path: Path, words: dict[str, list[str]]) -> int:
    try:
        numbers = {name: int(words[name][0]) for name in ("POINTS", "WIDTH", "HEIGHT") if name in words}
        count = numbers["POINTS"] if "POINTS" in numbers else numbers["WIDTH"] * numbers["HEIGHT"]
    except (KeyError, IndexError, ValueError):
        raise _fail(path, "says not how many points it holds") from None
    for name, number in numbers.items():
        if number < 0:
            raise _fail(path, f"{name} is {words[name][0][:40]}; it must not be below 0")
        if number >> 63:
            raise _fail(path, f"{name} is {words[name][0][:40]}…; no file holds so many points")
    return count


def _faults(path: Path, words: dict[str, list[str]], count: int, held: int) -> list[str]:
    """Warnings where the header contradicts itself, or the data. held: points that the data hold."""
    found = []
    if held > count:
        found.append(f"{path.name}: announces {count:,} points; its data hold {held:,}, of which the others are left out")
    with contextlib.suppress(KeyError, IndexError, ValueError):
        width, height = int(words["WIDTH"][0]), int(words["HEIGHT"][0])
        if width * height != count:
            found.append(f"{path.name}: POINTS is {count:,}, where WIDTH x HEIGHT is {width:,} x {height:,}: it is read without rows and columns")
    return found


def preview(path: Path) -> list[str]:
    with open(regular(path), "rb") as file:
        words, _ = _header(path, file.read(65536))
    return [f"PCD {' '.join(words['DATA'])}", f"{_count(path, words):,} points", " ".join(words["FIELDS"])]


def read(path: Path, wanted: Filter, progress: Progress) -> PointFile:
    return jobs.finish(steps(path, wanted, progress))


def steps(path: Path, wanted: Filter, progress: Progress) -> jobs.Steps[PointFile]:
    """The same with a pause after each piece of what takes long: text, and what is compressed."""
    progress.step(0.0)
    try:
        data = regular(path).read_bytes()
    except OSError as error:
        raise native.PatinaError(f"{path.name}: cannot be read: {error.strerror}", -3) from None
    words, at = _header(path, data[:1 << 20])
    kind, count, form = _columns(path, words), _count(path, words), " ".join(words["DATA"][:1]) or "of no kind"
    if form == "ascii":
        table, held = yield from _ascii(path, data[at:], kind, count, progress)
    elif form == "binary":
        if len(data) - at < count * kind.itemsize:
            raise _fail(path, f"ends after {(len(data) - at) // kind.itemsize:,} of {count:,} points")
        rows = np.frombuffer(data, kind, count, at)
        table, held = {name: rows[name] for name in kind.names}, (len(data) - at) // kind.itemsize
    elif form == "binary_compressed":
        table, held = (yield from _compressed(path, data, at, kind, count, progress)), count
    else:
        raise _fail(path, f"DATA {form} is not ascii, binary or binary_compressed")
    station = _organise(words, table, count)
    points = _assemble(path, table, wanted)
    points.warnings += _faults(path, words, count, held)
    if station is not None:
        points.notes |= scanners_of([station], points.origin)
        if wanted.every == 1:  # a thinned grid is none
            yield from grid_normals(points, [station], progress)
    return points


def _organise(words: dict[str, list[str]], table: dict[str, np.ndarray], count: int) -> np.ndarray | None:
    """A picture of points, HEIGHT rows of WIDTH: gives each its row and column. Returns where the sensor was: at zero, unless the
    file tells of another place, which some writers have put into the points and others have not."""
    try:
        width, height = int(words["WIDTH"][0]), int(words["HEIGHT"][0])
        place = [float(word) for word in words.get("VIEWPOINT", ["0"] * 7)[:3]]
    except (KeyError, IndexError, ValueError):
        return None
    if height < 2 or width < 2 or width * height != count:
        return None
    table["row"], table["column"] = (values.astype(np.float32)[:, None] for values in np.divmod(np.arange(count), width))
    return np.zeros(3) if place == [0.0, 0.0, 0.0] else None


def _ascii(path: Path, text: bytes, kind: np.dtype, count: int, progress: Progress) \
        -> jobs.Steps[tuple[dict[str, np.ndarray], int]]:
    """The columns, and how many points the text holds."""
    width = sum(kind[name].shape[0] for name in kind.names)
    pieces, at = [np.empty(0)], 0
    while at < len(text):
        progress.step(at / len(text))
        end = text.find(b"\n", at + TEXT_PIECE)
        end = len(text) if end < 0 else end
        try:
            pieces.append(np.array(text[at:end].split(), np.float64))
        except ValueError as error:
            raise _fail(path, str(error)[:200]) from None
        at = end + 1
        yield jobs.Pause()
    words = np.concatenate(pieces)
    if len(words) < count * width:
        raise _fail(path, f"ends after {len(words) // width:,} of {count:,} points")
    rows, table, at = words[:count * width].reshape(count, width), {}, 0
    for name in kind.names:
        size = kind[name].shape[0]
        table[name] = rows[:, at:at + size].astype(kind[name].base)
        at += size
    return table, len(words) // width


def _compressed(path: Path, data: bytes, at: int, kind: np.dtype, count: int, progress: Progress) \
        -> jobs.Steps[dict[str, np.ndarray]]:
    packed, size = (int(value) for value in np.frombuffer(data, "<u4", 2, at)) if len(data) >= at + 8 else (0, 0)
    if size != count * kind.itemsize or len(data) < at + 8 + packed:
        raise _fail(path, "its compressed part is cut short or of another size than its points")
    plain = yield from _unpack(path, data[at + 8:at + 8 + packed], size, progress)
    table, at = {}, 0
    for name in kind.names:  # one column after the other
        table[name] = np.frombuffer(plain, kind[name].base, count * kind[name].shape[0], at).reshape(count, -1)
        at += table[name].nbytes
    return table


def _unpack(path: Path, packed: bytes, size: int, progress: Progress) -> jobs.Steps[bytearray]:
    """Marc Lehmann's LZF: runs of bytes, and copies of up to 264 bytes from the last 8192."""
    plain, at, end, polled = bytearray(), 0, len(packed), 0
    try:
        while at < end:
            control = packed[at]
            at += 1
            if control < 32:
                plain += packed[at:at + control + 1]
                at += control + 1
                continue
            length = control >> 5
            if length == 7:
                length += packed[at]
                at += 1
            back = ((control & 31) << 8) + packed[at] + 1
            at += 1
            start, length = len(plain) - back, length + 2
            if start < 0:
                raise _fail(path, "its compressed part is damaged")
            if back >= length:
                plain += plain[start:start + length]
            else:
                plain += (plain[start:] * (length // back + 1))[:length]
            if len(plain) > size:
                raise _fail(path, f"unpacks to more than the {size:,} bytes of its points")
            polled += 1
            if polled % COPIES == 0:
                progress.step(at / end)
                yield jobs.Pause()
    except IndexError:
        raise _fail(path, "its compressed part is cut short") from None
    if len(plain) != size:
        raise _fail(path, f"unpacks to {len(plain):,} bytes instead of {size:,}")
    return plain


def _assemble(path: Path, table: dict[str, np.ndarray], wanted: Filter) -> PointFile:
    if not all(axis in table for axis in "xyz"):
        raise _fail(path, "has no fields x, y and z")
    positions = np.concatenate([table.pop(axis)[:, :1].astype(np.float64) for axis in "xyz"], 1)
    keep = wanted.mask(0, positions) & np.isfinite(positions).all(axis=1)  # organised clouds hold rows of NaN
    positions = positions[keep]
    table = {name: values[keep] for name, values in table.items()}
    bounds = (positions.min(axis=0), positions.max(axis=0)) if len(positions) else (np.zeros(3),) * 2
    origin = origin_of(*bounds, 1e-4)
    colors = None
    for name in ("rgb", "rgba"):
        if name in table and table[name].dtype.itemsize == 4:
            words = np.ascontiguousarray(table.pop(name)[:, 0])
            words = words.view(np.uint32) if words.dtype.kind == "f" else words.astype(np.uint32)
            colors = np.stack([words >> 16 & 255, words >> 8 & 255, words & 255, np.full_like(words, 255)], 1)
            colors = colors.astype(np.uint8)
    normals = None
    if all(f"normal_{axis}" in table for axis in "xyz"):
        normals = np.concatenate([table.pop(f"normal_{axis}")[:, :1].astype(np.float32) for axis in "xyz"], 1)
    scalars = {name: values[:, 0].astype(np.float32) for name, values in table.items()
               if values.shape[1] == 1 and not name.startswith("_")}
    return PointFile(path.stem, (positions - origin).astype(np.float32), normals, colors, scalars, origin, 0)
