# SPDX-License-Identifier: GPL-3.0-or-later
"""Files that Patina writes and reads again. Processes are killed at random moments while they write; disks are full; bytes are flipped. A file is
the old one or the new one, nothing is left over after the next process, and a damaged file is reported or does no harm.

    PATINA_LIBRARY=... PYTHONPATH=(laspy, lazrs, pye57) python tests/files/test_caches.py [NAME ...]

PATINA_LONG=1: 200 kills of each kind, and every byte of each header."""

import json
import os
import random
import re
import resource
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from patina_modules import imported
from runner import run_tests

exporters, whole = imported("write.exporters", "whole")
sys.path.append(str(Path(whole.__file__).parent / "read/streaming"))  # whose programs import each other so
import shelf  # noqa: E402

LONG = bool(os.environ.get("PATINA_LONG"))
KILLS = 200 if LONG else 5
PATINA = str(Path(os.environ["PATINA_LIBRARY"]).parent / "patina")
SCRATCH = Path(tempfile.mkdtemp(prefix="patina-caches-"))
LIGHT = ("--lit", "--sun", "-30,20", "--shadows")
SMALL = ("--size", "48x48", "--threads", "1", "--device", "cpu-scalar")


def run(*arguments, code=0, **options):
    done = subprocess.run([PATINA, *map(str, arguments)], capture_output=True, text=True, cwd=SCRATCH, timeout=120, check=False, **options)
    assert done.returncode == code, f"{arguments}: {done.returncode} in place of {code}: {done.stderr}"
    return done


def scan(name="scan.ply", count=8000):
    """A wave, of which half lies in the other's shadow."""
    path = SCRATCH / name
    if not path.exists():
        random.seed(3)
        rows = "".join(f"{i % 100 / 50} {i // 100 / 50} {0.5 if i % 100 < 30 else 0.0} 0 0 1\n" for i in range(count))
        path.write_text(f"ply\nformat ascii 1.0\nelement vertex {count}\n" + "".join(f"property float {name}\n" for name in ("x", "y", "z", "nx", "ny", "nz")) +
                        "end_header\n" + rows)
    return path


# What the command line writes: the arguments, and the name of what they write.
def commands():
    scan()
    if not (SCRATCH / "good.cloud").exists():
        run("convert", "scan.ply", "good.cloud")
    return {"cloud": (("convert", "scan.ply", "out.cloud"), "out.cloud"),
            "packed": (("convert", "scan.ply", "small.cloud", "--pack", "on", "--order", "drop"), "small.cloud"),
            "bare": (("convert", "scan.ply", "bare.cloud", "--analysis", "off"), "bare.cloud"),
            "repacked": (("convert", "good.cloud", "again.cloud", "--pack", "on"), "again.cloud"),
            "ply": (("convert", "scan.ply", "out.ply"), "out.ply"),
            "analysed": (("analyse", "scan.ply", "-o", "known.ply"), "known.ply"),
            "picture": (("render", "good.cloud", "-o", "out.png", *SMALL), "out.png"),
            "shadows": (("render", "good.cloud", "-o", "shadow.png", *SMALL, *LIGHT, "--save-shadows", "out.shadows"), "out.shadows"),
            "keys": (("scatter", "good.cloud", "-o", "out.keys", "--part", "1/2", *SMALL), "out.keys")}


# Files that are never read again.
def reports():
    section = ("--plane", "section:0,0.4,2,0.4", "--scale", "20")
    return {"distances": (("distance", "scan.ply", "scan.ply", "-o", "distances.ply", "--cylinder", "0.2"), "distances.ply"),
            "ground": (("ground", "scan.ply", "-o", "ground.ply"), "ground.ply")} | {
            ending: (("draw", "scan.ply", *section, "-o", f"sheet.{ending}"), f"sheet.{ending}") for ending in ("dxf", "svg", "png")}


def left_beside(name):
    return [path.name for path in SCRATCH.iterdir() if path.name.startswith(name) and path.name != name]


def test_killed_at_any_moment():
    """Each kind of file of the command line."""
    chance, table = random.Random(49), []
    for kind, (arguments, name) in (commands() | reports()).items():
        begun = time.monotonic()
        run(*arguments)
        took, wanted, path = time.monotonic() - begun, (SCRATCH / name).read_bytes(), SCRATCH / name
        path.write_bytes(b"before")
        survived = dirty = 0
        for _ in range(KILLS):
            process = subprocess.Popen([PATINA, *arguments], cwd=SCRATCH, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
            time.sleep(took * chance.random() * 1.1)
            process.kill()
            process.wait()
            found = path.read_bytes()
            assert found in (b"before", wanted), f"{kind}: {len(found)} bytes, which are neither the old nor the new file"
            survived, dirty = survived + (found == b"before"), dirty + bool(left_beside(name))
            if found == wanted:
                path.write_bytes(b"before")
        run(*arguments)
        assert path.read_bytes() == wanted, f"{kind}: another file after kills"
        assert not left_beside(name), f"{kind}: left over: {left_beside(name)}"
        table.append(f"{kind}: {KILLS} kills, {survived} kept the old file, {dirty} left something for the next")
    print("\n".join(table))


def test_steps_of_killed_conversions_go():
    """A conversion that was killed between its steps leaves the whole cloud of a step; the next one of any kind removes it."""
    scan()
    for step in (".built", ".analysed", ".smaller", ".built.part"):
        for slot in ("", "4"):
            beside = SCRATCH / f"steps.cloud.part{slot}"
            beside.write_bytes(b"")
            beside.with_name(beside.name + step).write_bytes(b"half")
    run("convert", "scan.ply", "steps.cloud", "--analysis", "off")
    assert not left_beside("steps.cloud"), left_beside("steps.cloud")


def test_conversions_at_once():
    """Of two scans to one name: each ends well, and the file is one of theirs."""
    scan(), scan("other.ply", 6000)
    wanted = []
    for name in ("scan.ply", "other.ply"):
        run("convert", name, "single.cloud")
        wanted.append((SCRATCH / "single.cloud").read_bytes())
    for round_ in range(20 if LONG else 4):
        processes = []
        for name in ("scan.ply", "other.ply") * 2:
            processes.append(subprocess.Popen([PATINA, "convert", name, "both.cloud"], cwd=SCRATCH, stderr=subprocess.PIPE, text=True))
            time.sleep(0.01 * (round_ % 5))
        for process in processes:
            said = process.communicate(timeout=120)[1]
            assert process.returncode == 0, said
        assert (SCRATCH / "both.cloud").read_bytes() in wanted and not left_beside("both.cloud"), left_beside("both.cloud")


def limited(size):
    """For a process whose files grow to that many bytes and no further, as on a full disk."""
    def limit():
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))
    return limit


def test_full_disk():
    """Each kind of file of the command line: one message, status 1, the old file stays, nothing is left over."""
    for kind, (arguments, name) in (commands() | reports()).items():
        run(*arguments)
        whole_size = (SCRATCH / name).stat().st_size
        (SCRATCH / name).write_bytes(b"before")
        for size in (0, 100, whole_size // 2, whole_size - 1):
            said = run(*arguments, code=1, preexec_fn=limited(size)).stderr
            errors = [line for line in said.splitlines() if line and not re.search(r"100 %|points, |warning|note", line)]
            assert len(errors) == 1 and name in errors[0], f"{kind}, {size} bytes: {said}"
            assert (SCRATCH / name).read_bytes() == b"before" and not left_beside(name), f"{kind}, {size} bytes: {left_beside(name)}"


def test_files_of_newer_versions():
    """Of each kind with a version: refused with one line that names the file and says why."""
    uses = {"cloud": ("info",), "shadows": ("render", "good.cloud", "-o", "new.png", *SMALL, *LIGHT, "--load-shadows"), "keys": ("merge", "-o", "new.png")}
    for kind, use in uses.items():
        arguments, name = commands()[kind]
        run(*arguments)
        data = bytearray((SCRATCH / name).read_bytes())
        version = int.from_bytes(data[8:12], "little")
        assert 0 < version < 1000, f"{kind}: no version behind the first eight bytes"
        data[8:12] = (version + 1).to_bytes(4, "little")
        (SCRATCH / f"newer.{kind}").write_bytes(data)
        lines = run(*use, f"newer.{kind}", code=1).stderr.splitlines()
        assert len(lines) == 1 and f"newer.{kind}" in lines[0] and "version" in lines[0], f"{kind}: {lines}"


# ---- flipped bytes

LAST_OF_ENGINE = 47  # of a head of keys: the reader once ended its text there, and then looked at the sum

def places(size, header):
    """Each byte of the header, one in a thousand of the body; a chosen part of these in a short run."""
    chance = random.Random(size)
    chosen = [*range(min(header, size)), *(chance.randrange(header, size) for _ in range(max(size - header, 0) // 1000 + 1) if size > header)]
    return chosen if LONG else [LAST_OF_ENGINE, *chance.sample(chosen, min(len(chosen), 60))]


def flips(path, header):
    """Of each place the file's bytes with one changed."""
    good = path.read_bytes()
    for place in places(len(good), header):
        for mask in (0xFF, 1 << place % 8):
            data = bytearray(good)
            data[place] ^= mask
            yield place, bytes(data)


def test_flipped_shadows_and_keys():
    """Both have a sum of all their bytes: a file with any other byte is refused, by its name."""
    for kind, name, use in (("shadows", "out.shadows", ("render", "good.cloud", "-o", "flip.png", *SMALL, *LIGHT, "--load-shadows")),
                            ("keys", "out.keys", ("merge",))):
        arguments = commands()[kind][0]
        run(*arguments)
        more = ()
        if kind == "keys":
            run(*[word.replace("1/2", "2/2").replace("out.keys", "second.keys") for word in arguments])
            more = ("second.keys", "-o", "flip.png")
        run(*use, name, *more)
        tried = 0
        for place, data in flips(SCRATCH / name, 112):
            if tried >= 24 and not LONG:
                break
            (SCRATCH / "flipped.bin").write_bytes(data)
            done = run(*use, "flipped.bin", *more, code=1)
            assert "flipped.bin" in done.stderr and len(done.stderr.splitlines()) == 1, f"{kind}, byte {place}: {done.stderr}"
            tried += 1
        whole_file = (SCRATCH / name).read_bytes()
        for size in (0, 1, 31, 112, len(whole_file) // 2, len(whole_file) - 1):  # these are read, not mapped
            (SCRATCH / "flipped.bin").write_bytes(whole_file[:size])
            assert "flipped.bin" in run(*use, "flipped.bin", *more, code=1).stderr, f"{kind} of {size} bytes"
        print(f"{kind}: {tried} flips, all refused")


def test_flipped_clouds():
    """By the command line: refused, or the picture is the same, or standard error names the file."""
    for kind in ("cloud", "packed"):
        arguments, name = commands()[kind]
        run(*arguments)
        run("render", name, "-o", "good.png", *SMALL)
        wanted, counts, tried = (SCRATCH / "good.png").read_bytes(), {"refused": 0, "same": 0, "told": 0}, 0
        for place, data in flips(SCRATCH / name, 4096):
            if tried >= 24 and not LONG:
                break
            tried += 1
            (SCRATCH / "flipped.cloud").write_bytes(data)
            (SCRATCH / "flip.png").unlink(missing_ok=True)
            done = subprocess.run([PATINA, "render", "flipped.cloud", "-o", "flip.png", *SMALL], capture_output=True, text=True, cwd=SCRATCH,
                                  timeout=120, check=False)
            assert done.returncode in (0, 1), f"{kind}, byte {place}: {done.returncode} {done.stderr}"
            named = any("flipped.cloud" in line for line in done.stderr.splitlines())
            if done.returncode:
                assert named, f"{kind}, byte {place}: {done.stderr}"
                counts["refused"] += 1
            elif (SCRATCH / "flip.png").read_bytes() == wanted:
                counts["same"] += 1
            else:
                assert named, f"{kind}, byte {place}: another picture, and nobody says so"
                counts["told"] += 1
        print(f"{kind}: {tried} flips: {counts}")


# ---- files of the add-on

WRITER = """
import importlib.util, sys, time
spec = importlib.util.spec_from_file_location("whole", sys.argv[1])
whole = importlib.util.module_from_spec(spec)
spec.loader.exec_module(whole)
from pathlib import Path
print("begun", flush=True)
for i in range(100000):
    with whole.writing(Path(sys.argv[2])) as file:
        for _ in range(50):
            file.write(bytes([65 + i % 26]) * 4096)
            file.flush()
            time.sleep(0.0005)
    with whole.Folder("patina-test-", Path(sys.argv[2]).parent) as folder:
        (folder / "x").write_bytes(b"1" * 1000)
"""


def test_whole_files_are_killed():
    """Whoever is killed leaves the old file or the new one; the next process removes the rest, and nothing of a process that lives."""
    folder, chance = SCRATCH / "whole", random.Random(4)
    folder.mkdir()
    path, script = folder / "data", SCRATCH / "writer.py"
    script.write_text(WRITER)
    left = 0
    with whole.writing(folder / "mine") as mine, whole.Folder("patina-test-", folder) as held:
        for _ in range(KILLS * 3):
            process = subprocess.Popen([sys.executable, "-I", script, whole.__file__, path], stdout=subprocess.PIPE)
            process.stdout.readline()
            time.sleep(0.01 + 0.05 * chance.random())
            process.kill()
            process.communicate()
            if path.exists():
                data = path.read_bytes()
                assert len(data) == 50 * 4096 and len(set(data)) == 1, f"{len(data)} bytes of {set(data)}"
            left += len(list(folder.glob("*.part"))) - 1
            whole.remove_left(folder, lambda item: item.name in {"data", "mine"})
            whole.remove_left_folders(folder, "patina-test-")
            assert [item.name for item in folder.glob("*.part")] == [Path(mine.name).name], sorted(folder.iterdir())
            assert list(folder.glob("patina-test-*")) == [held.parent], sorted(folder.glob("patina-test-*"))
        mine.write(b"whole")
    assert (folder / "mine").read_bytes() == b"whole" and not list(folder.glob("*.part")) and left > 0, left


def test_whole_files_of_others_stay():
    """Names that are not ours, and folders with files but no lock that are new, are left alone."""
    folder = SCRATCH / "others"
    folder.mkdir()
    for name in ("film.mkv.part", "a.cloud.part2", "b.cloud.77-1.part", "b.cloud.77.part", "b.cloud.part.built"):
        (folder / name).write_bytes(b"x")
    for name in ("new", "empty"):  # who made the second was killed before its lock
        (folder / f"patina-test-{name}").mkdir()
    (folder / "patina-test-new" / "file").write_bytes(b"x")
    assert whole.remove_left(folder, lambda item: item.name == "b.cloud") == 3
    assert whole.remove_left_folders(folder, "patina-test-") == 1 and (folder / "patina-test-new/file").exists()
    os.utime(folder / "patina-test-new", (1, 1))
    assert whole.remove_left_folders(folder, "patina-test-") == 1
    assert sorted(item.name for item in folder.iterdir()) == ["a.cloud.part2", "film.mkv.part"]


DELETER = """
import importlib.util, os, sys
spec = importlib.util.spec_from_file_location("whole", sys.argv[1])
whole = importlib.util.module_from_spec(spec)
spec.loader.exec_module(whole)
from pathlib import Path
place, who, left = Path(sys.argv[2]), sys.argv[3], int(sys.argv[4])

def dies(delete):
    def counted(*arguments, **options):
        global left
        left -= 1
        if left < 0:
            os._exit(9)
        return delete(*arguments, **options)
    return counted

made = whole.Folder("patina-test-", place)
(made.path / "x").write_bytes(b"1")
(made.path / "y").mkdir()
if who == "next":
    os.close(made._lock.fileno())  # as if this process had been killed
    made._folder._finalizer.detach()
os.unlink, os.rmdir = dies(os.unlink), dies(os.rmdir)
made.cleanup() if who == "owner" else whole.remove_left_folders(place, "patina-test-")
os._exit(0)
"""


def test_folders_killed_while_they_go():
    """At each deletion, of the folder's owner, and of the next process that removes the folder: what is then left over goes at once."""
    folder, script = SCRATCH / "going", SCRATCH / "deleter.py"
    folder.mkdir()
    script.write_text(DELETER)
    for who in ("owner", "next"):
        codes = []
        while not codes or codes[-1]:
            done = subprocess.run([sys.executable, "-I", script, whole.__file__, folder, who, str(len(codes))], check=False)
            codes.append(done.returncode)
            assert codes[-1] in (0, 9) and len(codes) < 20, codes
            whole.remove_left_folders(folder, "patina-test-")
            assert not list(folder.iterdir()), f"{who}, killed at deletion {len(codes)}: {sorted(folder.rglob('*'))}"
        assert len(codes) > 4, codes


def test_failed_writing_leaves_the_file():
    path = SCRATCH / "failed"
    path.write_bytes(b"before")
    for error in (OSError("full"), KeyboardInterrupt()):
        try:
            with whole.writing(path) as file:
                file.write(b"half")
                raise error
        except (OSError, KeyboardInterrupt) as found:
            assert found is error
    assert path.read_bytes() == b"before" and not left_beside("failed")


def points(count=4000):
    random.seed(2)
    return exporters.Points(np.random.default_rng(1).random((count, 3)) * 100 + 5000, None, np.full((count, 3), 7, np.uint8), {})


EXPORT = """
import resource, signal, sys
sys.path.insert(0, sys.argv[3])
import test_caches as t
from pathlib import Path
t.limited(int(sys.argv[2]))()
try:
    t.exporters.write(Path(sys.argv[1]), t.points())
except (t.exporters.ExportError, OSError) as error:
    print("said", str(error) or type(error))
    sys.exit(7)
"""


def test_exports_to_a_full_disk():
    """Of each format: a message, the old file stays, nothing is left over."""
    from patina.read import readers
    for ending, needs in exporters.NEEDS.items():
        if readers.lacks(*needs):
            print(f"skip {ending}: {needs} not installed")
            continue
        path = SCRATCH / f"full.{ending}"
        exporters.write(path, points())
        size = path.stat().st_size
        path.write_bytes(b"before")
        for limit in (0, 500, size // 2):
            done = subprocess.run([sys.executable, "-c", EXPORT, path, str(limit), str(Path(__file__).parent)], capture_output=True, text=True, timeout=120,
                                  check=False)
            assert done.returncode == 7, f"{ending}, {limit} bytes: {done.returncode} {done.stdout} {done.stderr}"
            assert path.read_bytes() == b"before", f"{ending}, {limit} bytes"
            left = [item.name for item in SCRATCH.glob(".patina-export-*")]
            assert not left, f"{ending}: {left}"


EXPORTS = """
import sys
sys.path.insert(0, sys.argv[2])
import test_caches as t
from pathlib import Path
points = t.points(40_000)
print("begun", flush=True)
while True:
    t.exporters.write(Path(sys.argv[1]), points)
"""


def test_exports_are_killed():
    """Of each format: the old file or the whole new one, and the next export removes what is left."""
    from patina.read import readers
    chance = random.Random(5)
    for ending, needs in exporters.NEEDS.items():
        if readers.lacks(*needs):
            print(f"skip {ending}: {needs} not installed")
            continue
        path, left = SCRATCH / f"killed.{ending}", 0
        exporters.write(path, points(40_000))
        size = path.stat().st_size
        for _ in range(KILLS if LONG else 2):
            path.write_bytes(b"before")
            process = subprocess.Popen([sys.executable, "-c", EXPORTS, path, str(Path(__file__).parent)], stdout=subprocess.PIPE,
                                       env=os.environ | {"TMPDIR": str(SCRATCH)})
            process.stdout.readline()
            time.sleep(0.3 * chance.random())
            process.kill()
            process.communicate()
            found = path.read_bytes()
            assert found == b"before" or len(found) == size, f"{ending}: {len(found)} bytes, a whole file has {size}"
            left += len(list(SCRATCH.glob(".patina-export-*")))
            exporters.write(path, points(1000))
            assert not list(SCRATCH.glob(".patina-export-*")), ending
        print(f"{ending}: {left} killed exports left something for the next")


def test_flipped_parts_of_streams():
    """What is kept of a stream has a sum: a part with another byte is fetched again."""
    keep = shelf.Shelf(SCRATCH / "shelf", 1 << 20, print, least_free=0)
    path, data = shelf.place_of(SCRATCH / "shelf", "place") / ("0" * 16) / "0-100.kept", random.Random(1).randbytes(300)
    keep.put(path, "0-100", data)
    assert keep.take(path, "0-100") == data
    good = path.read_bytes()
    for place in range(len(good)):
        raw = bytearray(good)
        raw[place] ^= 1 << place % 8
        path.write_bytes(raw)
        assert keep.take(path, "0-100") is None and not path.exists(), place
    about = path.parent.parent / shelf.ABOUT
    text = json.dumps({"version": "0" * 16, "total": 5, "etag": "", "modified": "", "head": ""})
    for changed in ("[" * 100_000, "9" * 5000, "{}", "\0", text.replace("5", "9" * 5000), text.replace("000", "../")):
        about.write_text(changed)
        assert shelf.about(about.parent) is None, changed[:40]


if __name__ == "__main__":
    run_tests(globals(), SCRATCH)
