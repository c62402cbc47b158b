# SPDX-License-Identifier: GPL-3.0-or-later
"""Linked clouds: objects that name a file which only the library reads. Blender holds a box.

A cloud is built at the first time, analyzed, and saved in Blender's folder of user data; later it is mapped from there. A file that is a saved
cloud is mapped as it is.
"""

from __future__ import annotations

import contextlib
import hashlib
import math
import os
from dataclasses import asdict, dataclass
from pathlib import Path

import bpy
import numpy as np

from ... import choices, jobs, native, whole
from ...read import importers, streaming
from ...read.importers import crs, saved
from ...read.importers import scans as scans_of_files
from ...read.streaming import shelf
from ..analyses import analysis, analyzing
from ..analyses.scans_of import SCAN_ENDING, Scans, scans_in
from ..losses import Loss, MissingFile
from . import addresses, attributes, building, cache, files, kept, sequence
from .colors import scalar_name
from .origin import PROPERTY, TOGETHER, ZERO
from .soft import attribute_name

Corner = tuple[float, float, float]

OLD = "saved by an older version"  # says the library's log of a saved cloud whose analysis knows no trust
DETAIL = 1e-3  # of a saved cloud, in its units, half of which an origin keeps


@dataclass(frozen=True)
class Source:
    """A file as it is now, and where its cloud is kept."""

    path: Path | addresses.Address
    kept: Path
    origin: Corner | None = None  # float64, that the cloud shall be relative to; None: the file's own
    scalar: str = ""  # that a ramp is laid over
    analyzed: bool = True
    hide_uncolored: bool = False
    pattern: Path | None = None  # of the sequence that it is of
    streamed: bool = False  # a COPC whose points are read as pictures want them
    state: str = ""  # of a saved cloud

    @property
    def is_saved(self) -> bool:
        """Whether the file is a cloud as it is."""
        return self.kept == self.path

    def identity(self) -> tuple:
        return ("linked", str(self.path), self.state, self.origin, self.kept.name)


@dataclass(frozen=True)
class Linked:
    cloud: native.Cloud
    origin: Corner  # float64; the cloud is relative to it
    box: tuple[Corner, Corner]
    scanners: list[float]  # x, y, z of each, relative to origin
    units: tuple[float, float] = (1.0, 1.0)  # metres of the file's, across and up
    scans: Scans | None = None  # None: one, or it is not said
    told: str = ""  # what the file says of them: importers.scans


def source_of(obj: bpy.types.Object, frame: int, notices: list[str], analyzed: bool | None = None) -> Source | None:
    """Of an object with a linked file, evaluated or not; None where there is nothing to show. The files of a sequence are
    all relative to the object's origin, so that they lie to one another as they were scanned. analyzed: whether an analysis
    is needed, as far as the object has one; None: what is kept will do, with it or without. Where none is needed, one that is kept does
    no harm."""
    path = files.path_of(obj)
    origin = pattern = None
    if isinstance(path, addresses.Address):
        return source(path, scalar=scalar_name(obj) or attribute_name(obj))
    if not sequence.is_pattern(path) and addresses.is_streamed(path, obj.patina.stream):
        found = source(path, scalar=scalar_name(obj) or attribute_name(obj), streamed=True)
        if found:
            return found
    if sequence.is_pattern(path):
        pattern = path
        settings = obj.patina.sequence
        path, notice = sequence.file_at(path, frame, settings.start, settings.step, settings.outside)
        if notice:
            notices.append(Loss(f"'{obj.name}': {importers.told(notice)}"))
        if path is None:
            return None
        origin = tuple(obj[PROPERTY]) if PROPERTY in obj else None
    elif saved.is_saved(path):  # which may be another one by now, whose box begins elsewhere
        origin = tuple(obj[PROPERTY]) if PROPERTY in obj else None
    scalar, wanted, shown = scalar_name(obj) or attribute_name(obj), bool(analysis.wanted(obj)), obj.patina.hide_uncolored
    found = source(path, origin, scalar, wanted, shown, pattern)
    if found and wanted and not analyzed and not found.kept.exists():
        bare = source(path, origin, scalar, False, shown, pattern)
        found = bare if bare and (analyzed is False or bare.kept.exists()) else found
    if found is None:
        notices.append(MissingFile(f"'{obj.name}': the file {importers.told(path)} is missing", obj.name))
    return found


def source(path: Path | addresses.Address, origin: Corner | None = None, scalar: str = "", analyzed: bool = True,
           hide_uncolored: bool = False, pattern: Path | None = None, streamed: bool = False) -> Source | None:
    if streamed or isinstance(path, addresses.Address):
        return _streamed(path, scalar)
    try:
        status = path.stat()
    except OSError:
        return None
    if saved.is_saved(path):
        return Source(path, path, origin, scalar, False, pattern=pattern, state=f"{status.st_size} {status.st_mtime_ns}")
    place = _hash(f"{path.resolve()}{origin or ''}", 12)
    state = _hash(f"{status.st_size} {status.st_mtime_ns}", 6)
    variant = _hash(f"{scalar} {analyzed} {hide_uncolored}", 4)  # several objects may link one file
    return Source(path, kept.place_of(path, f"{place}-{state}-{variant}.cloud"), origin, scalar, analyzed, hide_uncolored, pattern)


def _streamed(path: Path | addresses.Address, scalar: str) -> Source | None:
    """Nothing is analyzed or kept of it."""
    state = "" if isinstance(path, Path) or not addresses.refusal(path) else "kept alone"
    if isinstance(path, Path):
        try:
            status = path.stat()
        except OSError:
            return None
        state = f"{status.st_size} {status.st_mtime_ns}"
    return Source(path, kept.folder() / f"{_hash(f'{path} {state} {scalar}', 16)}.pages", None, scalar, False, False, None, True)


def before(found: Source) -> Source | None:
    """The file before it in its sequence."""
    path = sequence.before(found.pattern, found.path) if found.pattern else None
    return source(path, found.origin, found.scalar, found.analyzed, found.hide_uncolored, found.pattern) if path else None


def _hash(text: str, size: int) -> str:
    return hashlib.blake2b(text.encode("utf-8", "surrogateescape"), digest_size=size).hexdigest()


def loss(name: str, source: Source, error: Exception, shown: Source | None = None) -> Loss:
    """What to say where an object's file cannot be read. shown: in its stead. Raises what is not the file's fault: a cancel, memory."""
    if isinstance(error, native.PatinaCancelled) or getattr(error, "code", 0) == native.MEMORY:
        raise error
    why = str(error).removeprefix(f"{source.path}: ")
    what = f"'{name}': {shown.path.name} stays" if shown else f"'{name}' is left out"
    return Loss(importers.told(f"{what}: {source.path} cannot be read: {why}"))


def share(source: Source) -> bool:
    """Puts what is kept of a scan beside it, for other machines. Whether it lies there; not where nothing is kept, or the folder may not be written."""
    if source.is_saved:
        return True
    target = kept.beside(source.path)
    names = [source.kept.with_suffix(ending) for ending in (".json", SCAN_ENDING, source.kept.suffix)]  # the cloud last: with it the rest is there
    if source.kept.parent == target:
        return True
    if not source.kept.is_file():
        return False
    try:
        target.mkdir(exist_ok=True)
        for path in names:
            if path.is_file() and not (target / path.name).is_file():
                whole.copy(path, target / path.name)
        kept.remove_left(target)
    except OSError:
        return False
    return True


def load(source: Source, progress: importers.Progress | None = None) -> Linked:
    """Maps the kept cloud, or builds and keeps it. Any thread. PatinaError when the file cannot be read."""
    return jobs.finish(steps(source, progress or importers.Progress()))


def steps(source: Source, progress: importers.Progress) -> jobs.Steps[Linked]:
    """The same in steps."""
    if source.streamed:
        return (yield from _stream(source, progress))
    if source.is_saved:
        return (yield from _saved(source, progress))
    found = _opened(source)
    if found and not _is_outdated(found.cloud, source):
        return found
    if found:
        found.cloud.close()
    made = yield from _make(source, progress)
    if found:
        made.cloud.renewed = "its cache was of an older version of Patina, so the file was read and analyzed again"
    return made


def _is_outdated(cloud: native.Cloud, source: Source) -> bool:
    """Whether a kept cloud was analyzed by an older version: the library opens it without that analysis."""
    return bool(source.analyzed and cloud.drawn and not cloud.has_shapes)


def _make(source: Source, progress: importers.Progress) -> jobs.Steps[Linked]:
    """Builds, analyzes and keeps the cloud of a file."""
    unsure = kept.is_unsure(source.path)
    pieces = yield from importers.in_pieces(source.path, building.LARGE, building.names_of(source.scalar), progress)
    if pieces:
        try:
            return (yield from _build(source, pieces, progress, unsure))
        except (native.PatinaError, OSError) as error:
            code = getattr(error, "code", native.FILE)
            found = _opened(source) if code == native.FILE else None
            if found:  # another Blender has made it meanwhile
                return found
            if code != native.FILE or not building.fits_in_memory(pieces.count):
                raise error if isinstance(error, native.PatinaError) else native.PatinaError(
                    f"{source.kept}: cannot be written: {error.strerror}", native.FILE) from None
    parts = 3 if source.analyzed else 2
    points = yield from importers.steps(source.path, importers.Filter(), progress.part(0, parts))
    seen_by = [points.scalars.get(name) for name in (analysis.SCAN, analysis.ROW, analysis.COLUMN)]
    scans, scan_of = scans_in(points.scalars)
    discs = [building.column(points, name) if points.splats else None for name in ("opacity", "radius")]
    for name in points.scalars.keys() - {source.scalar, *attributes.CLASS_NAMES}:  # clouds have no use for them
        del points.scalars[name]
    origin = source.origin or points.origin
    offset = tuple(own - wanted for own, wanted in zip(points.origin, origin, strict=True))
    units, told = points.notes.get("units"), points.notes.get(scans_of_files.NOTE, "")
    scanners = [value + offset[i % 3] for i, value in enumerate(points.notes.get("scanners", ()))]
    opacities, rgb = attributes.without_uncolored(discs[0], points.colors) if source.hide_uncolored else (discs[0], points.colors)
    with progress.part(1, parts).inner() as inner:
        task = native.Cloud.start(points.positions, points.normals, rgb, opacities, inner, discs[1], origin=offset,
                                  scalars=building.column(points, source.scalar), classes=building.classes(points))
    yield task
    cloud = task.result()
    if source.analyzed:
        part = progress.part(2, parts)
        part.doing = analysis.label(cloud)
        with part.inner() as inner:
            task = analyzing.start(cloud, analysis.of_columns(scanners, *seen_by), inner)
        yield task
        task.result()
    try:
        _forget_older(source)
        task = cloud.start_save(source.kept)
        yield task
        task.result()
        if scans:
            whole.write(source.kept.with_suffix(SCAN_ENDING), scan_of.tobytes())
        _write_notes(source.kept, origin, scanners, units, scans, told, unsure)
        _tidy(source.kept)
        cloud = native.Cloud.open(source.kept)  # whose memory is the file's
    except (native.PatinaError, OSError):
        pass  # no room on the disk: it stays in memory
    return _linked(cloud, origin, scanners, units, scans and asdict(scans), told, source.kept)


def _saved(source: Source, progress: importers.Progress) -> jobs.Steps[Linked]:
    """A saved cloud that the artist names: it is what it is, and nothing of it is made anew, but for an analysis of an older version."""
    found = _open_saved(source)
    cloud = found.cloud
    if not cloud.has_shapes and any(OLD in text and source.path.name in text for _, text in native.log_lines()):
        progress.doing = analysis.label(cloud)
        try:
            with progress.inner() as inner:
                task = analyzing.start(cloud, None, inner)
            yield task
            task.result()
            cloud.renewed = (f"{source.path.name} was saved by an older version of Patina, so its points were analyzed again. To keep that, "
                             f"run: patina analyse {source.path.name} -o NEW.cloud")
        except native.PatinaCancelled:
            raise
        except native.PatinaError as error:
            cloud.renewed = (f"{source.path.name} was saved by an older version of Patina, and its points cannot be analyzed here ({error}). "
                             f"Run: patina analyse {source.path.name} -o NEW.cloud")
    return found


def _open_saved(source: Source) -> Linked:
    origin = source.origin or ZERO
    cloud = native.Cloud.open(source.path, [-value for value in origin])
    if source.origin is None or math.dist(np.clip(ZERO, *cloud.box), ZERO) > TOGETHER:  # one of elsewhere, which came in its place
        own = importers.reading.origin_of(*np.add(cloud.box, origin), DETAIL)
        if own != origin:
            cloud.close()
            origin, cloud = own, native.Cloud.open(source.path, [-value for value in own])
    return Linked(cloud, origin, cloud.box, [])


def saved_cloud(source: Source) -> tuple[Path, Corner] | None:
    """The file of a cloud that is there already, and the offset of its positions to the object's. None: there is none yet, or its points
    are read as needed."""
    if source.streamed or not source.kept.is_file():
        return None
    return source.kept, tuple(-value for value in source.origin or ZERO) if source.is_saved else ZERO


def _opened(source: Source) -> Linked | None:
    """The kept cloud; None where it is not there yet, of another version, or damaged: it is made anew then."""
    try:
        found = _linked(native.Cloud.open(source.kept), *kept.read_notes(source.kept.with_suffix(".json")), source.kept)
        if found.scans:
            kept.check_scan_file(source.kept.with_suffix(".json"), found.cloud.scan_file, found.cloud.count)
        with contextlib.suppress(OSError):  # of another user
            os.utime(source.kept)  # used just now
        kept.CHECKS.start(source.identity(), source.kept)
        return found
    except (native.PatinaError, OSError, ValueError):
        return None


def _forget_older(source: Source) -> None:
    """What is kept of the file as it was."""
    place, state, _ = source.kept.stem.split("-")
    for old in source.kept.parent.glob(f"{place}-*"):
        if not old.name.startswith(f"{place}-{state}-"):
            old.unlink()


def _write_notes(place: Path, origin: Corner, scanners: list[float], units: list[float] | None, scans: Scans | dict | None, told: str,
                 unsure: bool) -> None:
    scans = asdict(scans) if isinstance(scans, Scans) else scans
    kept.write_notes(place.with_suffix(".json"), {"origin": origin, "scanners": scanners, "units": units, "scans": scans, "told": told} |
                     ({"unsure": True} if unsure else {}), place.with_suffix(SCAN_ENDING) if scans else None)


def _build(source: Source, pieces: importers.Pieces, progress: importers.Progress, unsure: bool) -> jobs.Steps[Linked]:
    """A large file's cloud: built on the disk without an analysis, kept so, and then analyzed. Whoever was killed between the two
    goes on from there."""
    parts = 3 if source.analyzed else 2
    bare = _bare(source) if source.analyzed else source
    found = _opened(bare) if source.analyzed else None
    made = found is None
    if made:
        origin = source.origin or pieces.origin
        offset = tuple(own - wanted for own, wanted in zip(pieces.origin, origin, strict=True))
        with contextlib.suppress(OSError):
            _forget_older(source)
        scans = yield from building.steps(pieces, bare.kept, source.scalar, offset, source.hide_uncolored, progress, parts)
        units, told = pieces.notes.get("units"), pieces.notes.get(scans_of_files.NOTE, "")
        scanners = [value + offset[i % 3] for i, value in enumerate(pieces.notes.get("scanners", ()))]
        _write_notes(bare.kept, origin, scanners, units, scans, told, unsure)
        _tidy(bare.kept)
        found = _linked(native.Cloud.open(bare.kept), origin, scanners, units, scans and asdict(scans), told, bare.kept)
    if not source.analyzed:
        return found
    return (yield from _analyze(source, bare, found, made, progress.part(2, parts), unsure))


def _bare(wanted: Source) -> Source:
    """The same without an analysis."""
    found = source(wanted.path, wanted.origin, wanted.scalar, False, wanted.hide_uncolored, wanted.pattern)
    if found is None:
        raise native.PatinaError(f"{wanted.path}: is missing", native.FILE)
    return found


def _analyze(source: Source, bare: Source, found: Linked, made: bool, progress: importers.Progress,
             unsure: bool) -> jobs.Steps[Linked]:
    """Analyzes what was built, on the disk too; lets the cloud without go where nobody else asked for it."""
    units = None if found.units == (1.0, 1.0) else list(found.units)
    notes = (found.origin, found.scanners, units, found.scans, found.told)
    if found.scans:  # at once: another Blender may let the cloud without go
        scan_file = source.kept.with_suffix(SCAN_ENDING)
        whole.copy(found.cloud.scan_file, scan_file)
        found.cloud.scan_file = scan_file
    stations = analysis.of_columns(found.scanners, _scan_of(found))
    try:
        yield from analyzing.on_disk(found.cloud, stations, bare.kept, source.kept, progress)
        _write_notes(source.kept, *notes, unsure)
        known = _linked(native.Cloud.open(source.kept), *notes[:3], found.scans and asdict(found.scans), found.told, source.kept)
    except (native.PatinaError, OSError) as error:
        if getattr(error, "code", native.FILE) == native.TOO_MANY_POINTS:
            return found  # is shown without an analysis
        if getattr(error, "code", native.FILE) != native.FILE:
            raise
        known = _opened(source)
        if known:  # another Blender has made it meanwhile, and let what was built go
            return known
        if not building.fits_in_memory(found.cloud.count):
            raise
        progress.doing = analysis.label(found.cloud)  # no room on the disk: what is found stays in memory
        with progress.inner() as inner:
            task = analyzing.start(found.cloud, stations, inner)
        yield task
        task.result()
        return found
    if made:
        found.cloud.close()
        _let_go(bare.kept)
    _tidy(source.kept)
    return known


def _scan_of(found: Linked) -> np.ndarray | None:
    """The scan of each point, where scanners are known: the scans that a file tells of follow each other, and a file beside the cloud, which
    only several scans have, is not asked."""
    counts = [scan.count for scan in scans_of_files.unpacked(found.told)] if found.scanners else []
    return np.repeat(np.arange(len(counts), dtype=np.min_scalar_type(len(counts))), counts) if sum(counts) == found.cloud.count else None


def _stream(source: Source, progress: importers.Progress) -> jobs.Steps[Linked]:
    """The head of a COPC or an EPT, whose points come later; where nothing may be fetched, what is kept of it."""
    place, offline = str(source.path), ""
    keep = cache.keep_of(place)
    if isinstance(source.path, addresses.Address):
        offline = addresses.refusal(place)
        if not keep or not shelf.holds(keep.folder, place):
            addresses.check(place)
    progress.doing = "Reading the octree"
    stream = streaming.Stream(place, source.scalar, keep, offline)
    try:
        cloud = yield from stream.steps(lambda: progress.step(0.5))
    except BaseException:
        stream.close()
        raise
    units = crs.units(stream.wkt, {})
    told = importers.reading.crs_notes(units).get("units")
    return Linked(cloud, stream.origin, cloud.box, [], tuple(told or (1.0, 1.0)))


def _tidy(newest: Path) -> None:
    """Lets the clouds go that were not used for longest, where all together are too large, and what was never finished."""
    kept.remove_left(newest.parent)
    clouds = []
    for path in filter(kept.is_of_scan, newest.parent.glob("*.cloud")):
        with contextlib.suppress(OSError):  # another Blender lets it go just now
            status = path.stat()
            clouds.append((-status.st_mtime_ns, status.st_size, path))
    total = 0
    for _, size, path in sorted(clouds):
        total += size
        if total > choices.cache_bytes() and path != newest:
            _let_go(path)


def _let_go(path: Path) -> None:
    """A cloud first, then what belongs to it: where the cloud is another Blender's, which Windows holds fast, all stays."""
    with contextlib.suppress(OSError):
        for ending in (path.suffix, ".json", SCAN_ENDING):
            path.with_suffix(ending).unlink(missing_ok=True)


def _linked(cloud: native.Cloud, origin: Corner, scanners: list[float] | None, units: list[float] | None,
            scans: dict | None, told: str, place: Path) -> Linked:
    known = Scans(scans["name"], tuple(scans["numbers"])) if scans else None
    if known:
        cloud.scan_file = place.with_suffix(SCAN_ENDING)
        cloud.scan_name, cloud.scan_numbers = known.name, known.numbers
    return Linked(cloud, origin, cloud.box, scanners or [], tuple(units or (1.0, 1.0)), known, told)


def box_mesh(name: str, box: tuple[Corner, Corner], known: Linked | None = None) -> bpy.types.Mesh:
    """Eight corners and twelve edges, and what is known of the scanners and their scans."""
    corners = [tuple(box[i >> k & 1][k] for k in range(3)) for i in range(8)]
    edges = [(i, i | 1 << k) for i in range(8) for k in range(3) if not i >> k & 1]
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(corners, edges, [])
    if known and known.scanners:
        mesh[analysis.SCANNERS] = known.scanners
    if known and known.told:
        mesh[scans_of_files.PROPERTY] = known.told
    return mesh
