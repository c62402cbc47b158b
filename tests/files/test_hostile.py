# SPDX-License-Identifier: GPL-3.0-or-later
"""Files that lie: the add-on's readers give a message or a warning with numbers, in a second and in little memory, and the process goes on.
Needs no Blender:

    PATINA_LIBRARY=... PYTHONPATH=(laspy, lazrs, pye57) python tests/files/test_hostile.py [NAME ...]
"""

import os
import random
import resource
import struct
import tempfile
import time
from pathlib import Path

import numpy as np
from patina_modules import ROOT, imported
from runner import Skip, run_tests

SHARED = ROOT.parent / "shared/data"
las, e57, library, importers, reading, unpacking, readers, native, e57_xml = imported(
    "read.importers.las", "read.importers.e57", "read.importers.library", "read.importers", "read.importers.reading", "read.unpacking",
    "read.readers", "native", "read.unpacking.e57_xml")
SCRATCH = Path(tempfile.mkdtemp(prefix="patina-hostile-"))
READERS = {ending: imported(f"read.importers.{name}")[0] for ending, name in importers.FORMATS.items() if name != "saved"}  # which is linked


def needs(*names):
    lacking = [name for name in names if readers.lacks(name)]
    if lacking:
        raise Skip(f"{', '.join(lacking)} not installed for this Python")


def read(path):
    return READERS.get(path.suffix, library).read(path, reading.Filter(), reading.Progress())


def message(path):
    """The sentence that reading a file fails with; its name is in it."""
    start = time.perf_counter()
    try:
        points = read(path)
    except native.PatinaError as error:
        assert path.name in str(error), str(error)
        assert time.perf_counter() - start < 20, f"{path.name} took {time.perf_counter() - start:.1f} s"
        return str(error)
    raise AssertionError(f"{path.name} was read: {len(points.positions)} points, {points.warnings}")


def written(name, data):
    path = SCRATCH / name
    path.write_bytes(data if isinstance(data, bytes) else data.encode())
    return path


def peak():
    """The most memory, in MB, that a child process has taken so far."""
    return resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024


# ---- LAS and LAZ

def las_bytes(count=1000, form=0, size=20, version=2, **changed):
    """A LAS 1.2 or 1.4 of that many points in a row, in millimetres. changed: offset, scale, box, headers."""
    header = 375 if version == 4 else 227
    head = bytearray(header)
    head[:4], head[24:26] = b"LASF", bytes([1, version])
    struct.pack_into("<HIIBHI", head, 94, changed.get("header", header), changed.get("offset", header), changed.get("records", 0), form, size,
                     count if version < 4 else 0)
    struct.pack_into("<12d", head, 131, *changed.get("scale", (0.001,) * 3), 0, 0, 0, *changed.get("box", (count / 1000, 0, 0, 0, 0, 0)))
    if version == 4:
        struct.pack_into("<Q", head, 247, count)
    rows = b"".join(struct.pack("<iii", i, 0, 0) + bytes(size - 12) for i in range(changed.get("rows", count)))
    return bytes(head) + rows


def laz_bytes(count=1000, form=6, size=30, **changed):
    """The same, packed. changed: alter(bytearray of the points part, place of the chunk table in it), alter_vlr(bytearray)."""
    needs("lazrs")
    import io

    import lazrs
    version = 4 if form > 5 else 2
    plain = las_bytes(count, form, size, version)
    header = 375 if version == 4 else 227
    vlr = lazrs.LazVlr.new_for_compression(form, 0)
    raw = bytearray(vlr.record_data())
    if "chunk" in changed:
        struct.pack_into("<I", raw, 12, changed["chunk"])
        vlr = lazrs.LazVlr(bytes(raw))
    out = io.BytesIO()
    packer = lazrs.LasZipCompressor(out, vlr)
    packer.compress_many(plain[header:])
    packer.done()
    packed = bytearray(out.getvalue())
    table = struct.unpack_from("<q", packed)[0]
    if "alter_vlr" in changed:
        changed["alter_vlr"](raw)
    start = header + 54 + len(raw)
    struct.pack_into("<q", packed, 0, table + start)
    if "alter" in changed:
        changed["alter"](packed, table)
    head = bytearray(plain[:header])
    struct.pack_into("<IIB", head, 96, start, 1, 0x80 | form)
    if "points" in changed:
        struct.pack_into("<Q" if version == 4 else "<I", head, 247 if version == 4 else 107, changed["points"])
    return bytes(head) + b"\0\0laszip encoded\0\0" + struct.pack("<HH", 22204, len(raw)) + bytes(32) + bytes(raw) + bytes(packed)


def test_laz_is_read():
    """Unpacked in a process of its own: the same points, of both kinds of chunks, and of several chunks."""
    for form, size in ((0, 20), (1, 28), (6, 30), (7, 36)):
        points = read(written("good.laz", laz_bytes(3000, form, size, chunk=700)))
        assert np.allclose(points.positions[:, 0], np.arange(3000) / 1000) and not points.warnings, (form, points.positions[:3])


def test_laz_chunk_table():
    """lazrs would allocate 64 GiB and abort the process."""
    for count in (0xFFFFFFFF, 0x7FFFFFFF, 1 << 20, 5000):
        told = message(written("chunks.laz", laz_bytes(alter=lambda raw, table, count=count: struct.pack_into("<I", raw, table + 4, count))))
        assert f"{count:,} chunks" in told, told
    for place in (-5, 1 << 40, 3):
        told = message(written("table.laz", laz_bytes(alter=lambda raw, _, place=place: struct.pack_into("<q", raw, 0, place))))
        assert f"{place:,}" in told, told
    assert peak() < 200, peak()


def test_laz_layers():
    """Each layer's size is at most the chunk's: lazrs would take 4 GB for 888 bytes."""
    for form, size, layer, value in ((6, 30, 0, 0xFFFFFFFF), (6, 30, 8, 0x40000000), (7, 36, 9, 20_000), (8, 38, 10, 0xFFFFFFFF)):
        told = message(written("layers.laz", laz_bytes(form=form, size=size, alter=lambda raw, _, at=8 + size + 4 + 4 * layer, value=value:
                                                       struct.pack_into("<I", raw, at, value))))
        assert "announces layers of" in told, told
    assert peak() < 200, peak()


def test_laz_records():
    """A LASzip record that is short, of other items or of other points; more points than chunks hold."""
    for alter, part in ((lambda raw: raw.__delitem__(slice(20, None)), "bytes long"),
                        (lambda raw: struct.pack_into("<H", raw, 32, 60000), "60,000 items"),
                        (lambda raw: struct.pack_into("<H", raw, 36, 1000), "points of 1,000 bytes"),
                        (lambda raw: struct.pack_into("<H", raw, 34, 77), "unknown kind")):
        told = message(written("record.laz", laz_bytes(alter_vlr=alter)))
        assert part in told, told
    for points in (60_000, 1 << 40):
        told = message(written("points.laz", laz_bytes(points=points)))
        assert f"{points:,} points" in told, told
    for chunk in (0xFFFFFFFF, 0, 1):
        told = message(written("chunk.laz", laz_bytes(alter_vlr=lambda raw, chunk=chunk: struct.pack_into("<I", raw, 12, chunk))))
        assert "cannot be unpacked" in told, told


def test_laz_mutations():
    """Whatever lazrs does with a mutated file, there is a message or points, and the next file is read."""
    random.seed(5)
    for form, size in ((1, 28), (7, 36)):
        good = laz_bytes(2000, form, size)
        start = struct.unpack_from("<I", good, 96)[0]
        for _ in range(15):
            data = bytearray(good)
            for _ in range(random.randint(1, 4)):
                data[random.randrange(start - 60, len(data))] = random.choice((0, 255, random.randrange(256)))
            try:
                read(written("mutated.laz", bytes(data)))
            except native.PatinaError as error:
                assert "mutated.laz" in str(error)
        assert len(read(written("good.laz", good)).positions) == 2000


def test_decoder_that_dies_or_hangs():
    """A library that aborts, takes all memory or never answers ends its own process; the message says so."""
    needs("lazrs")
    good = written("good.laz", laz_bytes())
    main = Path(unpacking.__file__).parent / "main.py"
    kept, no_answer, command = main.read_text(), unpacking.NO_ANSWER, unpacking.programs.command
    try:
        for body, part in (("os.abort()", "ended unexpectedly (signal 6)"), ("os.kill(os.getpid(), 11)", "(signal 11)"), ("os._exit(3)", "(status 3)"),
                           ("b'x' * (4 << 30)", "needs more than"), ("__import__('time').sleep(60)", "no progress in 1 seconds")):
            script = SCRATCH / "main.py"
            script.write_text(kept.replace("        work(path, order, channel)", f"        {body}")
                              .replace("Path(__file__).resolve().parent", f"Path({str(main.parent)!r})"))
            unpacking.programs.command = lambda _, script=script: command(script)
            unpacking.NO_ANSWER = 1.0 if "sleep" in body else 20.0
            told = message(good)
            assert part in told, told
    finally:
        unpacking.NO_ANSWER, unpacking.programs.command = no_answer, command
    assert len(read(good).positions) == 1000


def test_unpacking_is_cancelled():
    """Within 0.2 s, whatever the process does; nothing of it is left. The best of three, for other programs run too."""
    needs("lazrs")
    good = written("good.laz", laz_bytes())
    command, script = unpacking.programs.command, SCRATCH / "sleeps.py"
    script.write_text("import time\ntime.sleep(60)\n")
    unpacking.programs.command = lambda _: command(script)
    before = set(Path(tempfile.gettempdir()).glob("patina-unpack-*"))
    took = []
    try:
        for _ in range(3):
            progress = reading.Progress()
            steps = las.steps(good, reading.Filter(), progress)
            next(steps)
            progress.cancel()
            start = time.perf_counter()
            try:
                while True:
                    next(steps)
            except native.PatinaCancelled:
                took.append(time.perf_counter() - start)
    finally:
        unpacking.programs.command = command
    assert min(took) < 0.2, took
    assert not set(Path(tempfile.gettempdir()).glob("patina-unpack-*")) - before


def test_las_heads():
    """Points within the header, scales that are none: messages. Other numbers of points, records within the points and a wrong box: warnings."""
    for offset in (0, 100, 226):
        told = message(written("offset.las", las_bytes(offset=offset)))
        assert f"begin at byte {offset}, its header takes 227 bytes" in told, told
    assert "at least 227" in message(written("header.las", las_bytes(header=100)))
    assert "ends after 0 of 1,000 points" in message(written("offset.las", las_bytes(offset=1 << 31)))
    for scale in ((0, 1, 1), (float("nan"), 1, 1), (1, float("inf"), 1)):
        assert "its scale and offset are 0 or no numbers" in message(written("scale.las", las_bytes(scale=scale)))
    points = read(written("few.las", las_bytes(10, rows=1000)))
    assert len(points.positions) == 10 and points.warnings == ["few.las: announces 10 points; 990 more records follow, which are left out"]
    points = read(written("none.las", las_bytes(0, rows=1000)))
    assert not len(points.positions) and "1,000 more records follow" in points.warnings[0], points.warnings
    points = read(written("records.las", las_bytes(records=3)))
    assert "its record 0 of 3 ends at byte" in points.warnings[0], points.warnings
    for box in ((1e12, 1e12, 0, 0, 0, 0), (-5, 5, 0, 0, 0, 0), (float("nan"),) * 6):
        points = read(written("box.las", las_bytes(box=box)))
        assert np.allclose(points.positions[:, 0] + points.origin[0], np.arange(1000) / 1000, atol=1e-6), (box, points.positions[:3], points.origin)
        assert "its box" in points.warnings[0], points.warnings
    for place in (1 << 40, (1 << 62) - 1, (1 << 64) - 1):  # records behind the points: no file system seeks that far
        data = bytearray(las_bytes(10, 6, 30, 4))
        struct.pack_into("<QI", data, 235, place, 3)
        assert len(read(written("behind.las", bytes(data))).positions) == 10
    assert read(written("good.las", las_bytes())).warnings == []


# ---- texts and PCD

PTX = "0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n"


def test_ptx_and_pts():
    """As the command line, by the same reader: tests/unit/test_text.c. Thousands of scans take no quadratic time, and one warning."""
    for size in ("-1\n5", "4294967296\n1", "1000000000\n1000000000", "1e30\n1", "nan\ninf"):
        assert "line 1: scan 0 announces a grid" in message(written("head.ptx", f"{size}\n{PTX}1 2 3 0.5\n"))
    points = read(written("few.pts", "1000000000\n1 2 3 4 5 6 7\n"))
    assert len(points.positions) == 1 and "announces 1000000000 points, the file holds 1" in points.warnings[0], points.warnings
    many = written("many.ptx", "".join(f"1\n1\n{i} 0 0\n{PTX[6:-8]}{i} 0 0 1\n1 2 3 0.5\n" for i in range(40_000)))
    began = time.process_time()
    points = read(many)
    assert len(points.positions) == 40_000 and time.process_time() - began < 4, time.process_time() - began
    assert [text.partition(": ")[2] for text in points.warnings] == ["40000 scans have one point each: scans 0, 1, 2, 3, 4, ..."], points.warnings[:3]


def pcd_text(data="ascii", body="1 2 3\n" * 12, **changed):
    head = {"FIELDS": "x y z", "SIZE": "4 4 4", "TYPE": "F F F", "COUNT": "1 1 1", "WIDTH": "12", "HEIGHT": "1", "POINTS": "12"} | changed
    return "VERSION .7\n" + "".join(f"{key} {value}\n" for key, value in head.items() if value is not None) + f"DATA {data}\n" + body


def test_pcd():
    assert len(read(written("good.pcd", pcd_text())).positions) == 12
    for changed, part in (({"COUNT": "0 1 1"}, "COUNT of field 'x' is 0"), ({"COUNT": "-1 1 1"}, "COUNT of field 'x' is -1"),
                          ({"COUNT": "1e9 1 1"}, "COUNT of field 'x'"), ({"COUNT": "99999999 1 1"}, "ends after 0 of 12 points"),
                          ({"POINTS": "-5"}, "POINTS is -5"), ({"POINTS": None, "WIDTH": "-3", "HEIGHT": "-4"}, "WIDTH is -3"),
                          ({"POINTS": "9" * 5000}, "says not how many"), ({"POINTS": "1000000000"}, "of 1,000,000,000 points"),
                          ({"FIELDS": " ".join(["x"] * 100_000)}, "100,000 fields"), ({"SIZE": "4 4 16"}, "do not fit together")):
        told = message(written("bad.pcd", pcd_text(**changed)))
        assert part in told, told
    points = read(written("few.pcd", pcd_text(POINTS="5", WIDTH="5")))
    assert len(points.positions) == 5 and "announces 5 points; its data hold 12" in points.warnings[0], points.warnings
    points = read(written("grid.pcd", pcd_text(WIDTH="5", HEIGHT="7")))
    assert "WIDTH x HEIGHT is 5 x 7" in points.warnings[0], points.warnings
    packed = pcd_text("binary_compressed", "").encode() + struct.pack("<II", 64, 144) + b"\x00a" + b"\xe0\xff\x00" * 20 + bytes(2)
    assert "more than the 144 bytes" in message(written("bomb.pcd", packed))


def test_shared_files():
    """Those that failed first."""
    folder = SHARED / "formats/hostile"
    if not folder.is_dir():
        raise Skip("there is no ../shared/data/formats/hostile")
    for path in sorted(folder.glob("*.*")):
        if path.suffix == ".pts":
            assert read(path).warnings, path
        elif path.suffix != ".md" and not (path.suffix == ".laz" and readers.lacks("lazrs")):
            message(path)


def test_pipes():
    """A named pipe is no file; nothing waits for who writes into it."""
    if os.name == "nt":
        raise Skip("Windows has no named pipes among files")
    for ending in sorted(READERS, key=lambda ending: ending == ".laz"):  # which may end the test, last
        path = SCRATCH / f"pipe{ending}"
        os.mkfifo(path)
        if ending == ".laz":
            needs("lazrs")
        assert "is a device or pipe, not a file" in message(path)
        module = READERS[ending]
        in_pieces = getattr(module, "in_pieces", lambda *_: ())
        for run in (lambda: module.preview(path), lambda: list(in_pieces(path, 1, (), reading.Progress()))):
            try:
                run()
            except native.PatinaError as error:
                assert "pipe" in str(error) or "package" in str(error), error


# ---- E57

def crc32c(data):
    found = 0xFFFFFFFF
    for byte in data:
        found ^= byte
        for _ in range(8):
            found = found >> 1 ^ (0x82F63B78 if found & 1 else 0)
    return struct.pack(">I", found ^ 0xFFFFFFFF)


def e57_bytes(xml):
    """A file of XML alone, without check sums: what is wrong with it is found before libE57 sees it."""
    body = struct.pack("<8sIIQQQQ", b"ASTM-E57", 1, 0, 0, 48, len(xml), 1024) + xml
    pages = [body[at:at + 1020].ljust(1020, b"\0") + bytes(4) for at in range(0, len(body), 1020)]
    data = bytearray(b"".join(pages))
    struct.pack_into("<Q", data, 16, len(data))
    return bytes(data)


def e57_file(name, count=100, change=lambda xml: xml):
    """One written by libE57, whose XML was changed to another of the same length or shorter."""
    needs("pye57", "pyquaternion")
    import pye57
    path = SCRATCH / name
    path.unlink(missing_ok=True)
    file = pye57.E57(str(path), mode="w")
    file.write_scan_raw({axis: np.arange(count, dtype=np.float64) for axis in ("cartesianX", "cartesianY", "cartesianZ")})
    file.close()
    data = bytearray(path.read_bytes())
    offset, length = struct.unpack_from("<2Q", data, 24)
    plain = b"".join(bytes(data[at:at + 1020]) for at in range(0, len(data), 1024))
    start = offset // 1024 * 1020 + offset % 1024
    xml = change(plain[start:start + length])
    plain = plain[:start] + xml.ljust(length, b" ") + plain[start + max(length, len(xml)):]
    data = b"".join(plain[at:at + 1020] + crc32c(plain[at:at + 1020]) for at in range(0, len(plain), 1020))
    path.write_bytes(data)
    return path


def test_e57_is_read():
    points = read(e57_file("good.e57"))
    assert np.array_equal(points.positions[:, 0], np.arange(100)) and not points.warnings, points.warnings
    assert "E57, 1 scans" in e57.preview(SCRATCH / "good.e57")


def test_e57_xml():
    """Wide, deep and endless XML: refused in a second, also by the preview; libE57 takes quadratic time."""
    needs("pye57", "pyquaternion")
    start = b'<?xml version="1.0"?><e57Root type="Structure">'
    cases = {"wide": (start + b'<a type="Integer"/>' * 40_000 + b"</e57Root>", "more than 10,000 parts in 'e57Root'"),
             "scans": (start + b'<data3D type="Vector">' + b'<vectorChild type="Structure"/>' * 40_000 + b"</data3D></e57Root>", "parts in 'data3D'"),
             "deep": (start + b'<a type="Structure">' * 100_000 + b"</a>" * 100_000 + b"</e57Root>", "deeper than 64 levels"),
             "bomb": (b'<?xml version="1.0"?><!DOCTYPE a [<!ENTITY b "c">]><e57Root/>', "document type"),
             "cut": (start + b"<data3D>", "XML is damaged"),
             "text": (start + b"<a>" + b"x" * 3_000_000 + b"</a></e57Root>", "more than 1,048,576 characters"),
             "count": (start + b'<data3D type="Vector"><vectorChild><points recordCount="-5"/></vectorChild></data3D></e57Root>', "recordCount is '-5'")}
    for name, (xml, part) in cases.items():
        path = written(f"{name}.e57", e57_bytes(xml))
        began = time.process_time()
        told = message(path)
        assert part in told, told
        try:
            e57.preview(path)
        except native.PatinaError:
            pass
        assert time.process_time() - began < 2, f"{name}: {time.process_time() - began:.1f} s"


def test_e57_counts():
    """More points than the file can hold, and pages outside of it."""
    path = e57_file("many.e57", 100, lambda xml: xml.replace(b'recordCount="100"', b'recordCount="1000000000000"').replace(b'  <', b'<', 60))
    told = message(path)
    assert "scan 0 announces 1,000,000,000,000 points" in told and "at most" in told, told
    data = bytearray(e57_file("good.e57").read_bytes())
    for place, value, part in ((24, 1 << 50, "outside of its"), (32, 1 << 50, "outside of its"), (40, 1 << 20, "pages are of"), (16, 1 << 40, "ends after")):
        changed = bytearray(data)
        struct.pack_into("<Q", changed, place, value)
        assert part in message(written("head.e57", bytes(changed))), place


def test_e57_mutations():
    """Whatever libE57 does, there is a message or points, and the next file is read."""
    random.seed(3)
    good = e57_file("good.e57").read_bytes()
    for _ in range(15):
        data = bytearray(good)
        for _ in range(random.randint(1, 3)):
            data[random.randrange(len(data))] = random.randrange(256)
        for at in range(0, len(data), 1024):  # right check sums: deeper code sees what is wrong
            data[at + 1020:at + 1024] = crc32c(data[at:at + 1020])
        try:
            read(written("mutated.e57", bytes(data)))
        except native.PatinaError as error:
            assert "mutated.e57" in str(error)
    assert len(read(written("good.e57", good)).positions) == 100


if __name__ == "__main__":
    run_tests(globals(), SCRATCH)
