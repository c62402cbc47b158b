# SPDX-License-Identifier: GPL-3.0-or-later
"""Changed files for the readers in Python, changed job files, and changed arguments of the command line. Needs no Blender:

    PATINA_LIBRARY=... PYTHONPATH=(laspy, lazrs, pye57) python tests/fuzz/fuzz_readers.py --runs 200 [READER ...]

PATINA_PROGRAM names the command line; else it is looked for beside the library. fuzzer.py tells of the options.
"""

import json
import os
import random
import shutil
import struct
import subprocess
import sys
import tempfile
from functools import cache, partial
from pathlib import Path

sys.dont_write_bytecode = True
ROOT = Path(__file__).resolve().parents[2]
for folder in ("tests/files", "addon/read/streaming", "addon/read/unpacking", "tests/blender", "addon/farm", "tests/fuzz"):
    sys.path.insert(0, str(ROOT / folder))
import copc  # noqa: E402
import copc_files  # noqa: E402
import ept  # noqa: E402
import ept_files  # noqa: E402
import fuzzer  # noqa: E402
import mutate  # noqa: E402
import source  # noqa: E402
import task  # noqa: E402
import test_hostile as hostile  # noqa: E402
from fuzzer import Reader, Refused  # noqa: E402
from patina.read.importers import crs, scans  # noqa: E402

SCRATCH = Path(tempfile.mkdtemp(prefix="patina-fuzz-"))
PROGRAM = os.environ.get("PATINA_PROGRAM") or str(Path(os.environ["PATINA_LIBRARY"]).resolve().with_name("patina"))
STARTS = 0.04  # share of runs of readers that start a process for each input


def points(ending, data):
    """Reads a file as an import does, and previews it as the file dialog does."""
    path = SCRATCH / f"input{ending}"
    path.write_bytes(data)
    try:
        hostile.READERS[ending].preview(path)
    except hostile.native.PatinaError:
        pass
    hostile.read(path)


def las_with_records():
    """A LAS with a coordinate system as GeoTIFF keys, as words and as WKT."""
    keys = struct.pack("<16H", 1, 1, 0, 3, 1024, 0, 1, 1, 3072, 0, 1, 26910, 3076, 0, 1, 9001)
    texts = [(34735, keys), (34737, b"NAD83 / UTM zone 10N|\0"), (2112, b'PROJCS["x",GEOGCS["y",DATUM["z",SPHEROID["w",6378137,298.25]]],UNIT["metre",1]]\0')]
    records = b"".join(struct.pack("<H16sHH32s", 0, b"LASF_Projection", number, len(text), b"") + text for number, text in texts)
    plain = hostile.las_bytes(40, 6, 30, 4, records=len(texts), offset=375 + len(records))
    return plain[:375] + records + plain[375:]


def las_seeds():
    return [hostile.las_bytes(50), hostile.las_bytes(20, 3, 34), hostile.las_bytes(30, 7, 36, 4), las_with_records()]


def laz_seeds():
    return [hostile.laz_bytes(300, 1, 28, chunk=100), hostile.laz_bytes(300, 7, 36)]


def laz_change(data, chance, others):
    start = struct.unpack_from("<I", data, 96)[0]
    return mutate.change(data, chance, others, head=start + 200)


def pcd_seeds():
    rows = struct.pack("<36f", *range(36))
    return [hostile.pcd_text().encode(), hostile.pcd_text("binary", "").encode() + rows,
            hostile.pcd_text("ascii", "1 2 3 4.2e9 7\n" * 12, FIELDS="x y z rgb label", SIZE="4 4 4 4 4", TYPE="F F F F U", COUNT="1 1 1 1 1").encode(),
            hostile.pcd_text("binary_compressed", "").encode() + struct.pack("<II", 144 + 5, 144) + b"".join(
                bytes([len(part) - 1]) + part for part in (rows[at:at + 32] for at in range(0, 144, 32)))]


def e57_seeds():
    return [hostile.e57_file("seed.e57", 20).read_bytes()]


def e57_change(data, chance, others):
    """Of its pages' content; check sums are right, else nothing else would be seen."""
    plain = b"".join(data[at:at + 1020] for at in range(0, len(data), 1024))
    plain = mutate.change(plain, chance, others, text=chance.random() < 0.6, head=48)[:1 << 15]
    plain += bytes(-len(plain) % 1020)
    return b"".join(plain[at:at + 1020] + hostile.crc32c(plain[at:at + 1020]) for at in range(0, len(plain), 1020))


def e57_xml(data):
    """The part that looks at the XML, without a process for each file."""
    path = SCRATCH / "input.e57"
    path.write_bytes(data)
    hostile.e57_xml.check(path, hostile.e57_xml.read(path))


@cache
def copc_seed():
    path = SCRATCH / "seed.copc.laz"
    copc_files.write_copc(path, copc_files.points_of(1200)[0])
    return path.read_bytes()


def copc_change(data, chance, others):
    """Its head, its records, its hierarchy, or anything."""
    if chance.random() < 0.4:
        root, = struct.unpack_from("<Q", data, 469)
        tree = mutate.change(data[root:], chance, others)
        return data[:root] + tree
    return mutate.change(data, chance, others, head=700)


def copc_read(data):
    path = SCRATCH / "input.copc.laz"
    path.write_bytes(data)
    _pages(copc, source.FileSource(str(path)))


def _pages(kind, own):
    """The tree and some pages, as reader.py reads them."""
    tree = kind.read_tree(own)
    first = kind.fetch(tree, 0, own)
    kind.learn(tree, first, kind.unpack(tree, 0, first))
    for page in range(min(len(tree.nodes), 6)):
        with source.budget.of(kind.cost(tree, page)):
            kind.columns(tree, page, kind.unpack(tree, page, kind.fetch(tree, page, own)), "intensity" if kind.has_scalar(tree, "intensity") else "")


@cache
def ept_folder(packed):
    folder = SCRATCH / f"ept-{packed}"
    ept_files.write_ept(folder, copc_files.points_of(300)[0], packed=packed)
    return folder


PARTS = ("ept.json", "ept-hierarchy/0-0-0-0.json", "ept-data/0-0-0-0.bin")


def ept_seeds():
    """All files that may change, one behind another; each has its length before it."""
    files = [(ept_folder("binary") / name).read_bytes() for name in PARTS]
    return [json.dumps([len(data) for data in files]).encode() + b"\n" + b"".join(files)]


def _ept_files(data):
    head, _, rest = data.partition(b"\n")
    try:
        sizes = json.loads(head)
        found = [rest[sum(sizes[:k]):sum(sizes[:k + 1])] for k in range(len(PARTS))]
    except (ValueError, TypeError, RecursionError):
        found = [data, b"{}", b""]
    return found


def ept_change(data, chance, others):
    files = _ept_files(data)
    which = chance.choice((0, 0, 1, 1, 2))
    change = mutate.json_change if which < 2 and chance.random() < 0.7 else partial(mutate.change, text=which < 2)
    files[which] = change(files[which], chance, [])
    return json.dumps([len(each) for each in files]).encode() + b"\n" + b"".join(files)


def ept_read(data):
    folder = SCRATCH / "ept-input"
    for name, part in zip(PARTS, _ept_files(data), strict=True):
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(part)
    _pages(ept, source.FolderSource(str(folder / "ept.json")))


def crs_seeds():
    return [b'PROJCS["NAD83 / Oregon",GEOGCS["y",DATUM["z",SPHEROID["w",6378137,298.25]]],UNIT["US survey foot",0.3048006],AUTHORITY["EPSG","2269"]]',
            b'COMPD_CS["a + b",PROJCS["a",UNIT["metre",1]],VERT_CS["b",VERT_DATUM["c",2005],UNIT["foot",0.3048]]]',
            b'PROJCRS["WGS 84",BASEGEOGCRS["x"],CS[Cartesian,2],AXIS["(E)",east],LENGTHUNIT["metre",1],ID["EPSG",32610]]', b"NAD83 / UTM zone 10N|NAVD88 height (ft)|"]


def crs_read(data):
    text = data.decode("utf-8", "replace")
    crs.name(text)
    crs.units(text, {3072: 2269.0, 3076: 9003.0})
    crs.units(text)


def scans_seeds():
    """What a mesh in a .blend says of the scans that it was made of."""
    return [scans.packed([scans.Scan("tower", 200, (0.0, 0.0, 1.0), 0.1), scans.Scan("yard", 7, grid=(4, 2))]).encode()]


def scans_read(data):
    scans.unpacked(data.decode("utf-8", "surrogatepass") if data.isascii() else data)


# ---- jobs

JOB = {"patina_job": 1, "rounds": 2, "arguments": ["a.ply", "--size", "64x48"], "files": {}, "name": "tower", "kind": "tiles", "by": "patina",
       "program": "/usr/bin/patina", "version": "patina 1", "directory": "/tmp", "output": "tower.png", "tiles": [2, 2], "convert": []}


def job_seeds():
    other = {"kind": "frames", "frames": [1, 2], "options": [["--look", "1,2,3"], []], "output": "tower####.png"}
    blender = {"by": "blender", "program": "/usr/bin/blender", "scene": "Scene", "addon": [1, 0, 0], "frame": 1}
    converts = {"kind": "parts", "parts": 3, "convert": [["a.ply", str(SCRATCH / "job/clouds/1-a.cloud")]]}
    return [json.dumps(JOB | change).encode() for change in ({}, other, converts, other | blender, blender)]


def job_read(data):
    """Every task of the job and its scripts for Slurm, without the programs. Nothing is written outside of the folder."""
    import slurm
    folder = SCRATCH / "job"
    shutil.rmtree(folder, ignore_errors=True)
    (folder / "clouds").mkdir(parents=True)
    (folder / "clouds/1-a.cloud").write_bytes(b"x")
    (folder / "job.json").write_bytes(data)
    task.FOLDER = slurm.FOLDER = folder
    task.version_of, task.run, task.program_of = (lambda program: "patina 1"), (lambda *_, **__: 0), (lambda job: "/usr/bin/patina")
    told = []
    task.say = told.append
    codes = []
    for arguments in (["check"], ["convert", "1"], ["frame", "1"], ["tile", "1"], ["part", "1", "--round", "1"], ["merge"]):
        sys.argv = ["task.py", *arguments]
        codes.append(task.main())
    sys.argv = ["slurm.py", "--dry"]
    slurm.main()
    for script in (folder / "slurm").glob("*.sh") if (folder / "slurm").exists() else ():
        _one_job(script.read_text("utf-8"))
    if codes[0]:
        raise Refused(told[0])


def _one_job(script):
    """A script for Slurm has the lines of the template, whatever the job is called."""
    lines = script.rstrip("\n").split("\n")
    assert len(lines) in (13, 14) and all(line.startswith("#") for line in lines[:-8]), script


# ---- the command line

WORDS = ("info", "render", "convert", "analyse", "scatter", "merge", "help", "version", "job", "good.ply", "good.cloud", "none.ply", "-o", "out.png", "out.ply",
         "out.cloud", "out.keys", "--size", "64x48", "--region", "0,0,8,8", "--camera", "--look", "1,2,3,0,0,0", "--ortho", "--panorama", "--surface", "ranges",
         "discs", "soft", "--fill", "--iterations", "--error", "0.02", "--color", "scalar", "--ramp", "viridis", "--attribute", "intensity", "--layers", "3",
         "--hide-classes", "2,7", "--clip-box", "--sun", "--shadows", "--samples", "2", "--effect", "--edl", "--lines", "--device", "cpu", "--threads", "1",
         "--memory", "--pixel-samples", "--tiles", "2x2", "--tile", "1", "--part", "1/2", "--stats", "json", "--verbose", "--help", "--", "-", "--mesh",
         "--soft", "--background", "0.1,0.2,0.3", "--opacity", "0.5", "--trust", "--pack", "--grid")
SEEDS = ("info good.ply", "render good.ply -o out.png --size 32x24", "render good.ply -o out.png --size 32x24 --surface splats --lit --shadows",
         "render good.cloud -o out.png --size 32x24 --soft concentric --layers 3 --edl 1", "convert good.ply out.ply", "convert good.ply out.cloud",
         "render good.ply -o out.png --size 32x24 --ramp height --ramp-colors viridis", "scatter good.ply -o out.keys --size 32x24 --part 1/2",
         "help output", "version", "analyse good.ply -o out.ply")


@cache
def cli_folder():
    folder = SCRATCH / "cli"
    folder.mkdir()
    rows = "".join(f"{i % 7 / 7} {i % 11 / 11} {i % 13 / 13} {i % 256} {i}\n" for i in range(200))
    text = "ply\nformat ascii 1.0\nelement vertex 200\nproperty float x\nproperty float y\nproperty float z\nproperty uchar red\nproperty float intensity\n"
    (folder / "good.ply").write_text(f"{text}end_header\n{rows}")
    subprocess.run([PROGRAM, "convert", "good.ply", "good.cloud"], cwd=folder, check=True, capture_output=True)
    return folder


def cli_change(data, chance, _others):
    words = data.split(b"\n")
    for _ in range(chance.choice((1, 1, 2, 3))):
        at = chance.randrange(len(words))
        how = chance.randrange(5)
        word = chance.choice((*WORDS, *WORDS, *mutate.WORDS, *map(str, mutate.NUMBERS), *map(str, mutate.FLOATS))).encode("utf-8", "replace")
        if how == 0:
            words[at] = word
        elif how == 1:
            words.insert(at, word)
        elif how == 2 and len(words) > 1:
            del words[at]
        elif how == 3:
            words[at] = mutate.change(words[at], chance, [], text=True)
        else:
            words[at:at + 1] = [words[at], b"--" + chance.choice(WORDS).lstrip("-").encode() + b"=" + word]
    return b"\n".join(words)


def cli_read(data):
    """Ends with one of its codes, in time, without control characters; where it fails with a sentence. Writes into the current folder only."""
    arguments = [word.replace(b"\0", b"") for word in data.split(b"\n")][:40]
    if any(b"/" in word or b"\\" in word for word in arguments):  # outside of the folder
        return
    done = subprocess.run([PROGRAM, *arguments], cwd=cli_folder(), capture_output=True, stdin=subprocess.DEVNULL, timeout=50, check=False,
                          preexec_fn=_limits)
    said = done.stderr.decode("utf-8", "replace").strip().replace("\r", " ")
    assert done.returncode in (0, 1, 2, 3), f"ended with {done.returncode}: {said[-200:]}"
    assert not done.returncode or said, f"ended with {done.returncode} and says nothing"
    assert not fuzzer.controls(said), f"control characters: {said[:200]!r}"
    if done.returncode:
        raise Refused(said[-300:])


def _limits():
    import resource
    resource.setrlimit(resource.RLIMIT_CPU, (20, 20))
    resource.setrlimit(resource.RLIMIT_FSIZE, (1 << 28, 1 << 28))
    resource.setrlimit(resource.RLIMIT_AS, (3 << 30, 3 << 30))


def packed(data, chance, others):
    return mutate.change(data, chance, others, head=400)


def texts(data, chance, others):
    return mutate.change(data, chance, others, text=True)


OURS = (hostile.native.PatinaError,)
READERS = {
    "las": Reader(las_seeds, packed, partial(points, ".las"), OURS),
    "laz": Reader(laz_seeds, laz_change, partial(points, ".laz"), OURS, STARTS, lambda: hostile.needs("lazrs")),
    "pcd": Reader(pcd_seeds, texts, partial(points, ".pcd"), OURS),
    "e57": Reader(e57_seeds, e57_change, partial(points, ".e57"), OURS, STARTS, lambda: hostile.needs("pye57", "pyquaternion")),
    "e57_xml": Reader(e57_seeds, e57_change, e57_xml, (hostile.e57_xml.E57Error,), 1.0, lambda: hostile.needs("pye57", "pyquaternion")),
    "crs": Reader(crs_seeds, texts, crs_read, ()),
    "copc": Reader(lambda: [copc_seed()], copc_change, copc_read, (source.SourceError,), 1.0, lambda: hostile.needs("lazrs")),
    "ept": Reader(ept_seeds, ept_change, ept_read, (source.SourceError,), 0.5),
    "scans": Reader(scans_seeds, mutate.json_change, scans_read, ()),
    "job": Reader(job_seeds, mutate.json_change, job_read, (Refused,)),
    "cli": Reader(lambda: [line.replace(" ", "\n").encode() for line in SEEDS], cli_change, cli_read, (Refused,), 2 * STARTS,
                  lambda: subprocess.run([PROGRAM, "version"], check=True, capture_output=True)),
}

if __name__ == "__main__":
    random.seed(1)
    code = fuzzer.main(READERS, sys.argv[1:])
    for folder in (SCRATCH, hostile.SCRATCH):
        shutil.rmtree(folder, ignore_errors=True)
    os._exit(code)
