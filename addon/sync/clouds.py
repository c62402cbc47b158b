# SPDX-License-Identifier: GPL-3.0-or-later
"""Points of evaluated objects → clouds in the library, built once and kept while their content stays."""

from __future__ import annotations

import contextlib
import os
import threading
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import bpy
import numpy as np
from mathutils import Matrix

from .. import jobs, native, pairs, point_data
from ..importers import Progress
from ..jobs import Steps
from ..native.abi import LIGHTING
from ..properties import enum_number
from . import analysis, attributes, clips, colors, edits, estimates, images, linked, losses, materials, meshes, ranges, roles, soft, splats
from .analyzing import ANALYSES
from .camera import row_major
from .scans_of import SCAN_NAMES, Scans, scans_in

# Clouds that the last picture did not use may stay up to this many bytes (24 a point): enough for the other view
# layers and scenes of a session, little beside what Blender itself holds for the same points.
IDLE_BYTES = 1 << 30

SMALL = 1 << 14  # points: fewer are worked on by one thread each, in the library too
AT_ONCE = 16  # small clouds
MOST_WAITING = 1 << 22  # points of small clouds that are held beside Blender's own


@dataclass(frozen=True)
class PointArrays:
    positions: np.ndarray  # (n, 3) float32
    normals: np.ndarray | None  # (n, 3) float32
    colors: np.ndarray | None  # (n, 4) uint8 sRGB, or (n, 3|4) float32 linear
    opacities: np.ndarray | None  # (n, 1) float32
    scalars: np.ndarray | None = None  # (n, 1) float32
    classes: np.ndarray | None = None  # (n, 1) uint8
    radii: np.ndarray | None = None  # (n, 1) float32
    analyzed: bool = False
    stations: analysis.Stations | None = None  # where the scanners stood
    numbers: np.ndarray | None = None  # (n, 1) float32, that points are soft by
    scans: Scans | None = None  # where there are several
    scan_of: np.ndarray | None = None  # (n,) uint16, which of them each point is of

    def fingerprint(self) -> Steps[tuple[int, int]]:
        """Of the places, normals, opacities, radii and classes, and of the colours and scalars: what Blender's update tags miss
        (undo, geometry nodes, scripts) still shows."""
        task = native.start_fingerprint(self.positions, self.normals, self.colors, self.opacities, self.radii, self.scalars,
                                        self.classes)
        yield task
        return task.result()


@dataclass(frozen=True)
class CloudStyle:
    """patina_cloud_style."""

    world_from_object: tuple[float, ...]
    lighting: int
    cull_back: int
    d_min: float
    color: tuple[float, float, float]
    ambient: float
    diffuse: float
    specular: float
    shininess: int
    transparency: float
    shadow_off: int
    color_source: int = colors.OWN
    ramp: bytes = b""  # linear RGB, float32
    ramp_range: tuple[float, float] = (0.0, 0.0)  # equal: automatic
    exposure: float = 0.0
    contrast: float = 1.0
    hidden_classes: tuple[int, ...] = (0,) * 8
    clip_off: int = 0
    radius: float = 0.0
    largest_gap: float = 0.0
    free_space: int = 0
    least_trust: float = 0.0
    exact: int = 1  # black is black
    surface: int = 0  # as the settings; else PATINA_SURFACE_RANGES
    range_gamma: float = 0.0
    range_pixel: float = 0.0
    range_sharpness: float = 0.0
    range_cull: float = 0.0


class Pending:
    """Points that were read and wait to be made a cloud of. Shared by descriptions of one viewport."""

    def __init__(self, name: str, identity: tuple, arrays: PointArrays | None) -> None:
        self.name = name
        self._identity = identity
        self._arrays: PointArrays | None = arrays
        self._cloud: native.Cloud | None = None
        self.analyzed = arrays is not None and arrays.analyzed  # in time; a linked one is before it is seen
        self.stations = arrays.stations if arrays else None

        self.lost = ""  # why there will be no cloud, or that of an earlier file

    @property
    def built(self) -> native.Cloud | None:
        return self._cloud

    def resolve(self, progress: native.Progress) -> Steps[native.Cloud | None]:
        """The cloud; built at the first call. No viewport may draw meanwhile. None where it is lost."""
        if self._cloud is None:
            self._cloud = yield from CACHE.obtain(self._identity, self._arrays, progress, recolor=True)
            self._arrays = None
        return self._cloud


class PendingLink(Pending):
    """A linked cloud that waits to be opened."""

    def __init__(self, name: str, source: linked.Source) -> None:
        super().__init__(name, source.identity(), None)
        self._source = source

    def forget(self, identities: list[tuple]) -> bool:
        """Lets its cloud go, where it is one of these."""
        if self._identity in identities:
            self._cloud, self.lost = None, ""
        return self._identity in identities

    def resolve(self, progress: native.Progress) -> Steps[native.Cloud | None]:
        if self._cloud is None and not self.lost:
            self._cloud, self.lost = yield from CACHE.obtain_readable(self.name, self._source, Progress(progress))
        return self._cloud


@dataclass(frozen=True)
class CloudItem:
    cloud: native.Cloud | Pending
    style: CloudStyle
    pass_index: int  # of the object
    role: str = roles.SEEN
    name: str = ""  # of the object
    asset: str = ""  # of its topmost parent
    edits: edits.State = edits.State()
    soft: soft.Soft | None = None
    dotted: bool = False  # Blender's overlays draw its points too
    blender_depth: bool = False  # Blender draws its depth for overlays from 4.4 on
    told: str = ""  # of its scans, where they are drawn as range images: ranges.py
    analyzed: bool = True  # where its points are to be analyzed at all: this picture needs it


class CloudCache:
    """Clouds by the identity of the data they were built from. A scene that uses a cloud keeps it alive itself.
    For any thread; none waits for another one's building."""

    def __init__(self) -> None:
        self._entries: dict[tuple, tuple[tuple[int, ...], native.Cloud]] = {}  # least recently used first
        self._lock = threading.Lock()
        self._finals = 0

    @contextlib.contextmanager
    def final_render(self) -> Iterator[None]:
        """While one runs, clouds that it may have taken keep their colours."""
        with self._lock:
            self._finals += 1
        try:
            yield
        finally:
            with self._lock:
                self._finals -= 1

    def final(self) -> bool:
        return self._finals > 0

    def obtain(self, identity: tuple, arrays: PointArrays, progress: native.Progress | None = None,
               recolor: bool = False) -> Steps[native.Cloud]:
        """The cloud of these points: the one that is there, that one with new colours (recolor), or a new one."""
        fingerprint = yield from arrays.fingerprint()
        with self._lock:
            known, cloud = self._entries.pop(identity, ((), None))
            if fingerprint == known:
                self._entries[identity] = (known, cloud)
                _set_numbers(cloud, arrays)
                return cloud
            recolor = recolor and not self._finals and known[:1] == fingerprint[:1] and cloud not in ANALYSES
        if recolor:  # out of the cache: nobody takes it meanwhile
            task = cloud.start_colors(arrays.colors)
        else:
            cloud = None  # frees the old one before the new one is built
            task = native.Cloud.start(arrays.positions, arrays.normals, arrays.colors, arrays.opacities, progress, arrays.radii,
                                      arrays.scalars, arrays.classes)
        yield task
        cloud = task.result() or cloud
        if recolor:
            cloud.set_scalars(arrays.scalars)
            cloud.color_stamp += 1
        _set_numbers(cloud, arrays)
        self._keep(identity, fingerprint, cloud)
        return cloud

    def obtain_linked(self, source: linked.Source, progress: Progress) -> Steps[native.Cloud]:
        """The cloud of a linked file as it is now. One that is mapped is opened again once a picture lacked points of some file."""
        with self._lock:
            known, cloud = self._entries.pop(source.identity(), ((), None))
            if cloud and cloud.losses in (None, native.losses()):
                self._entries[source.identity()] = (known, cloud)
                return cloud
        cloud = (yield from linked.steps(source, progress)).cloud
        self._keep(source.identity(), (), cloud)
        return cloud

    def keep_streamed(self, source: linked.Source, cloud: native.Cloud) -> None:
        """Of a file that was opened just now, and is read as pictures want it: its head need not be read again."""
        if source.streamed:
            self._keep(source.identity(), (), cloud)

    def obtain_readable(self, name: str, source: linked.Source, progress: Progress) -> Steps[tuple[native.Cloud | None, str]]:
        """The same; where the file cannot be read that of the last one before it in its sequence that can, or None; and what to say."""
        failed: Exception | None = None
        shown: linked.Source | None = source
        while shown:
            try:
                cloud = yield from self.obtain_linked(shown, progress)
                return cloud, linked.loss(name, source, failed, shown) if failed else ""
            except (native.PatinaError, OSError) as error:
                said = linked.loss(name, source, failed or error)  # raises what is not the file's fault
                failed = failed or error
                shown = linked.before(shown)
        return None, said

    def drop(self, identities: list[tuple]) -> None:
        """Clouds that are no longer what they were built from."""
        with self._lock:
            for identity in identities:
                self._entries.pop(identity, None)

    def _keep(self, identity: tuple, fingerprint: tuple, cloud: native.Cloud) -> None:
        with self._lock:
            self._entries[identity] = (fingerprint, cloud)

    def trim(self, used: set[tuple]) -> None:
        with self._lock:
            idle = {identity: cloud.footprint for identity, (_, cloud) in self._entries.items() if identity not in used}
            total = sum(idle.values())
            for identity, size in idle.items():
                if total <= IDLE_BYTES:
                    break
                del self._entries[identity]
                total -= size

    def clear(self) -> None:
        with self._lock:
            self._entries.clear()

    def __len__(self) -> int:
        return len(self._entries)


def _set_numbers(cloud: native.Cloud, arrays: PointArrays) -> None:
    """Where they changed: fields are kept by their stamp."""
    if (arrays.numbers is None) != (cloud.numbers is None) or arrays.numbers is not None and not np.array_equal(arrays.numbers, cloud.numbers, equal_nan=True):
        cloud.numbers = arrays.numbers
        cloud.numbers_stamp += 1
    if arrays.scan_of is None and cloud.scan_of is None or (
            arrays.scans and cloud.scan_numbers == arrays.scans.numbers and np.array_equal(arrays.scan_of, cloud.scan_of)):
        return
    cloud.scan_of, cloud.scan_stamp = arrays.scan_of, cloud.scan_stamp + 1
    cloud.scan_name, cloud.scan_numbers = (arrays.scans.name, arrays.scans.numbers) if arrays.scans else ("", ())


CACHE = CloudCache()


# What collect() asks for each object with points or faces: (object, identity, linked file, whether an analysis is needed) → its cloud or
# mesh, or None without.
Take = Callable[[bpy.types.Object, tuple, "linked.Source | None", bool], "native.Cloud | Pending | meshes.Faces | None"]


def collect(depsgraph: bpy.types.Depsgraph, take: Take, notices: list[str],
            visible: Callable[[bpy.types.DepsgraphObjectInstance], bool] = lambda instance: True,
            frame: int | None = None, settle: Callable[[], None] = lambda: None,
            trusting: bool = False) -> list[CloudItem | meshes.MeshItem]:
    """Every visible cloud and mesh, instances too. Iterates the depsgraph only; keeps no reference into it. frame: whose
    files sequences show; None: of the scene's. settle: builds what take left for later. trusting: images are as they were unless
    Blender said that they changed."""
    items: list[CloudItem | meshes.MeshItem] = []
    taken: dict[tuple, native.Cloud | Pending | meshes.Faces | None] = {}  # by place in memory: it holds while the depsgraph does
    identities: dict[tuple, tuple] = {}  # by place
    used: set[tuple] = set()  # of them
    faces: set[str] = set()
    triangles = meshes.BARE if roles.are_used(depsgraph) or _wants_mattes(depsgraph.view_layer_eval) else meshes.TRIANGLES
    unknown = roles.Unknown(depsgraph.view_layer_eval)
    scales: list[tuple[str, float, native.Cloud | Pending]] = []
    for instance in depsgraph.object_instances:
        obj = instance.object
        if obj.type == 'LIGHT' and instance.show_self:
            unknown.look_at_light(instance)
        if not point_data.may_have_points(obj) or not instance.show_self or not obj.visible_camera or clips.cuts(obj):
            continue
        if not visible(instance) or not losses.is_placed(instance, notices):
            continue
        attributes.finish_edits(obj)
        solid = obj.type == 'MESH' and len(obj.data.polygons) > 0 and not obj.patina.linked_file
        if solid and depsgraph.scene_eval.patina.meshes == 'OFF':
            faces.add(obj.name)
            continue
        link = None
        patina = depsgraph.scene_eval.patina
        analyzed = not ranges.spare_analysis(obj, patina.surface, depsgraph.view_layer_eval)
        if obj.patina.linked_file:
            link = linked.source_of(obj, depsgraph.scene_eval.frame_current if frame is None else frame, notices, analyzed)
            if link is None:
                continue
        role = roles.role_of(instance, depsgraph.view_layer_eval)
        faces_as = 0 if not solid else triangles if patina.meshes == 'TRIANGLES' else patina.mesh_points
        radius = radius_name(obj, patina.surface)
        place = link.identity() if link else (obj.data.as_pointer(), radius, faces_as, *_attribute_names(obj), analysis.wanted(obj))
        place = (*place, *meshes.names_of(obj)) if solid else place
        if place not in identities:
            identities[place] = place if link else _identity(obj, used, radius, faces_as)
            used.add(identities[place])
        if (place, analyzed) not in taken:
            taken[place, analyzed] = take(obj, identities[place], link, analyzed)
        cloud = taken[place, analyzed]
        unknown.look(instance)
        if isinstance(cloud, meshes.Faces):
            notices += [text for text in cloud.notices if text not in notices]
            for part in cloud.parts:
                use = part.surface.use
                texture = images.CACHE.obtain(use, notices, trusting) if use else None
                style = _mesh_style(obj, instance.matrix_world, part.surface)
                items.append(meshes.MeshItem(part.mesh, style, obj.pass_index, role, *_names(obj), texture))
        elif cloud:
            style = style_of(obj, instance.matrix_world)
            if solid and obj.patina.lighting == 'AUTO':  # its colours are a material's, not a photograph's
                style = replace(style, lighting=LIGHTING["LIT"])
            edited = edits.state_of(obj)
            softened = soft.soft_of(obj, instance.matrix_world, depsgraph.scene_eval)
            told = ranges.told_of(obj, patina.surface)
            dotted = obj.type == 'MESH' and not solid and not link
            own_depth = solid or obj.type == 'POINTCLOUD' and not link and point_data.shows_spheres(obj)
            items.append(CloudItem(cloud, style, obj.pass_index, role, *_names(obj), edited, softened, dotted, own_depth, told, analyzed))
            scales.append((obj.original.name_full, max(map(abs, instance.matrix_world.to_scale())), cloud))
    settle()
    items = [replace(item, cloud=item.cloud.built) if isinstance(item, CloudItem) and isinstance(item.cloud, _Soon) else item
             for item in items]
    CACHE.trim(used)
    meshes.CACHE.trim(used)
    images.CACHE.trim()
    notices += filter(None, [edits.notice(item.name, item.edits, item.cloud) for item in items
                             if isinstance(item, CloudItem) and item.edits and isinstance(item.cloud, native.Cloud)])
    notices += [f"'{item.name}' has no {missing} to be soft by" for item in items if isinstance(item, CloudItem) and item.soft and
                isinstance(item.cloud, native.Cloud) and (missing := item.soft.missing(item.cloud))]
    estimates.keep({name: built.layer_distance * scale for name, scale, cloud in scales
                    if (built := cloud.built if isinstance(cloud, Pending) else cloud)})
    notices += unknown.notices()
    if not items:
        notices.append(losses.Loss("no visible object has points to draw"))
    if faces and not pairs.first_of(depsgraph.scene):  # else they are drawn by the other scene
        notices.append(f"{len(faces)} mesh object{'s' * (len(faces) > 1)} with faces not drawn: "
                       "Render Properties > Surface > Meshes draws them")
    return items


def _wants_mattes(layer: bpy.types.ViewLayer) -> bool:
    return layer.use_pass_cryptomatte_object or layer.use_pass_cryptomatte_asset


def _names(obj: bpy.types.Object) -> tuple[str, str]:
    """By which Cryptomatte knows an object, and what it is a part of."""
    top = obj
    while top.parent:
        top = top.parent
    return obj.name, top.name


class TakingNow:
    """Of a final picture: builds each cloud, polling; content decides whether it is built anew. Large ones are built at once, each
    by all cores; small ones wait for settle(), where several are built beside each other: starting all cores for one takes
    longer than its work."""

    def __init__(self, poll: Callable[[str, float], bool], notices: list[str]) -> None:
        self._poll = poll
        self._notices = notices
        self._waiting: list[_Soon] = []

    def __call__(self, obj: bpy.types.Object, identity: tuple, link: linked.Source | None, analyzed: bool
                 ) -> native.Cloud | Pending | meshes.Faces | None:
        name = obj.name
        progress = Progress()

        def stopped() -> bool:
            return self._poll(f"{progress.doing} of '{name}'", progress.value())

        def pause() -> None:
            if stopped():
                raise native.PatinaCancelled("cancelled", native.CANCELLED)

        if identity[-1] in {meshes.TRIANGLES, meshes.BARE}:
            pause()
            return meshes.CACHE.obtain(identity, obj)
        arrays = None if link else _read(obj, self._notices, identity[0], identity[-1], pause)
        if arrays is None and link is None:
            return None
        if arrays and not analyzed:
            arrays = replace(arrays, analyzed=False)
        if arrays and len(arrays.positions) < SMALL:
            soon = _Soon(name, identity, arrays, progress)
            self._waiting.append(soon)
            if sum(other.count for other in self._waiting) >= MOST_WAITING:
                self.settle()
            return soon

        def work() -> tuple[native.Cloud | None, str]:
            if link:
                return jobs.finish(CACHE.obtain_readable(name, link, progress))
            return _finished(identity, arrays, progress), ""

        cloud, lost = jobs.run(work, progress.cancel, stopped)
        if lost:
            self._notices.append(lost)
        if cloud is None:
            return None
        self._notice(name, cloud)
        if link and link.scalar and not cloud.has_scalars:
            self._notices.append(f"'{name}': its file has no attribute '{link.scalar}' to take as scalar")
        return cloud

    def settle(self) -> None:
        """Builds what waits."""
        waiting, self._waiting = self._waiting, []
        if not waiting:
            return
        what = f"Building '{waiting[0].name}'" if len(waiting) == 1 else f"Building {len(waiting)} small clouds"

        def cancel() -> None:
            for soon in waiting:
                soon.progress.cancel()

        def stopped() -> bool:
            return self._poll(what, sum(soon.built is not None for soon in waiting) / len(waiting))

        def work() -> None:
            from concurrent.futures import ThreadPoolExecutor  # 8 ms of Blender's start
            with ThreadPoolExecutor(min(os.cpu_count() or 1, AT_ONCE)) as pool:
                for _ in pool.map(_Soon.build, waiting):
                    pass

        jobs.run(work, cancel, stopped)
        for soon in waiting:
            self._notice(soon.name, soon.built)

    def _notice(self, name: str, cloud: native.Cloud) -> None:
        if cloud.invalid_positions:
            self._notices.append(f"'{name}': {cloud.invalid_positions:,} points without a finite position left out")


class _Soon(Pending):
    """A small cloud that waits for TakingNow.settle."""

    def __init__(self, name: str, identity: tuple, arrays: PointArrays, progress: Progress) -> None:
        super().__init__(name, identity, arrays)
        self.progress = progress
        self.count = len(arrays.positions)

    def build(self) -> None:
        """Any thread."""
        self._cloud = _finished(self._identity, self._arrays, self.progress)
        self._arrays = None


def of_object(obj: bpy.types.Object, surface: str, link: linked.Source | None, poll: Callable[[str, float], bool],
              notices: list[str]) -> native.Cloud | None:
    """The cloud of an object's own points, not evaluated, or of its linked file: the one that pictures have, or a new one. Analyzed where
    the object's pictures are."""
    identity = link.identity() if link else _identity(obj, set(), radius_name(obj, surface), 0)
    taking = TakingNow(poll, notices)
    found = taking(obj, identity, link, True)
    taking.settle()
    return found.built if isinstance(found, Pending) else found


def _finished(identity: tuple, arrays: PointArrays, progress: Progress) -> native.Cloud:
    """The cloud of these points, analyzed where that is wanted."""
    with progress.inner() as inner:
        cloud = jobs.finish(CACHE.obtain(identity, arrays, inner))
    if arrays.analyzed and not cloud.has_shapes:
        progress.doing = analysis.label(cloud)
        ANALYSES.finish(cloud, arrays.stations, progress.follow)
    return cloud


class Trusted:
    """Clouds of a viewport, read again only after Blender said that their data changed."""

    def __init__(self) -> None:
        self._known: dict[tuple, tuple[Pending | meshes.Faces | None, list[str]]] = {}
        self._used: set[tuple] = set()
        self.reads = 0  # how often points were read, for tests

    def forget(self, owners: set[tuple[str, str]] | None = None) -> None:
        """Data that changed, as (type name, full name) of object, data or material; None: all."""
        self._known = {} if owners is None else {
            identity: known for identity, known in self._known.items() if not owners.intersection(identity[-1])}

    def take(self, notices: list[str]) -> Take:
        self._known = {key: known for key, known in self._known.items() if key in self._used}  # objects go
        self._used = set()

        def take(obj: bpy.types.Object, identity: tuple, link: linked.Source | None, analyzed: bool) -> Pending | meshes.Faces | None:
            owners = {item: None for item in (obj, obj.data, *(slot.material for slot in obj.material_slots),
                                              *getattr(obj.data, "materials", ())) if item}  # each once
            key = (*identity, tuple((_kind(owner), owner.original.name_full) for owner in owners))
            self._used.add(key)
            if key not in self._known:
                said: list[str] = []
                if link:
                    self._known[key] = (PendingLink(obj.name, link), said)
                elif identity[-1] in {meshes.TRIANGLES, meshes.BARE}:
                    self.reads += 1
                    self._known[key] = (meshes.CACHE.obtain(identity, obj), said)
                else:
                    self.reads += 1
                    arrays = _read(obj, said, identity[0], identity[-1])
                    self._known[key] = (Pending(obj.name, identity, arrays) if arrays else None, said)
            pending, said = self._known[key]
            notices.extend(said)
            return pending

        return take


def _kind(item: bpy.types.ID) -> str:
    return type(item.original).__name__


def changed_owners(depsgraph: bpy.types.Depsgraph) -> set[tuple[str, str]]:
    """Objects and data whose points Blender says have changed, for Trusted.forget."""
    owners = set()
    for update in depsgraph.updates:
        item = update.id.original
        if isinstance(item, bpy.types.Material):  # all that Blender says where an image was loaded anew
            images.CACHE.forget(images.names_in(item))
        if isinstance(item, bpy.types.Object):
            if update.is_updated_geometry:
                owners.add((_kind(item), item.name_full))
        elif isinstance(item, bpy.types.Image):
            images.CACHE.forget({item.name_full})
        elif update.is_updated_geometry or isinstance(item, (bpy.types.Mesh, bpy.types.PointCloud, bpy.types.Material)):
            owners.add((_kind(item), item.name_full))
    return owners


def _identity(obj: bpy.types.Object, used: set[tuple], radius: str, faces_as: int | str) -> tuple:
    """Names the data for this session. Geometry that modifiers made has no original: its object stands for it,
    counted where there are several."""
    original = obj.data.original
    owner = obj.original if original == obj.data else original
    # session_uid came with Blender 4.1
    base = (type(owner).__name__, getattr(owner, "session_uid", None) or owner.name_full, obj.type,
            *_attribute_names(obj), analysis.wanted(obj))
    number = 0
    while (radius, *base, number, faces_as) in used:
        number += 1
    return (radius, *base, number, faces_as)


def _attribute_names(obj: bpy.types.Object) -> tuple[str | bool, ...]:
    return (obj.patina.color_attribute, obj.patina.normal_attribute, obj.patina.opacity_attribute, colors.scalar_name(obj),
            obj.patina.colors.class_attribute, obj.patina.radius_attribute, obj.patina.hide_uncolored, soft.attribute_name(obj))


def radius_name(obj: bpy.types.Object, surface: str) -> str:
    """The attribute that discs' radii are taken from. Geometry Nodes gives every point cloud radii, asked or not: they count where
    the artist wants discs."""
    if obj.patina.radius_attribute or obj.type != 'POINTCLOUD' or surface != 'SPLATS':
        return obj.patina.radius_attribute
    return point_data.RADIUS if point_data.RADIUS in obj.data.attributes and not point_data.are_for_display(obj.data) else ""


def _read(obj: bpy.types.Object, notices: list[str], radius_name: str, mesh_points: int,
          pause: Callable[[], None] = lambda: None) -> PointArrays | None:
    """The object's points; mesh_points > 0: so many on its faces. pause() is called between steps and may raise."""
    pause()
    with attributes.readable(obj) as data:
        return _read_data(obj, data, notices, radius_name, mesh_points, pause)


def _read_data(obj: bpy.types.Object, data: bpy.types.ID, notices: list[str], radius_name: str, mesh_points: int,
               pause: Callable[[], None]) -> PointArrays | None:
    if mesh_points:
        found = meshes.sample(obj, data, mesh_points)
        return PointArrays(*found, None) if found else None
    count = point_data.count_of(data)
    if count == 0:
        return None
    positions = attributes.positions(data, count)
    if positions is None:
        return None
    pause()
    normals = attributes.normals(data, count, obj.patina.normal_attribute)
    pause()
    rgb = attributes.colors(data, count, obj.patina.color_attribute, pause)
    pause()
    scalar, class_name = colors.scalar_name(obj), obj.patina.colors.class_attribute

    def numbers(name: str) -> np.ndarray | None:
        found = attributes.scalars(data, count, name)
        return attributes.weights(obj, data, count, name, pause) if found is None else found

    scalars = numbers(scalar)
    classes = attributes.classes(data, count, class_name)
    pause()
    opacities = attributes.opacities(data, count, obj.patina.opacity_attribute)
    if opacities is None:
        opacities = attributes.weights(obj, data, count, obj.patina.opacity_attribute, pause)
    radii = numbers(radius_name)
    if splats.are(data):
        discs = splats.read(obj.name, data, count, notices)
        normals = discs.normals if normals is None else normals
        rgb = rgb if obj.patina.color_attribute or discs.colors is None else discs.colors
        opacities = discs.opacities if opacities is None else opacities
        radii = radii if obj.patina.radius_attribute or discs.radii is None else discs.radii
    for kind, name, found in (("color", obj.patina.color_attribute, rgb),
                              ("normal", obj.patina.normal_attribute, normals),
                              ("opacity", obj.patina.opacity_attribute, opacities),
                              ("radius", radius_name, radii),
                              ("scalar", scalar, scalars), ("class", class_name, classes)):
        if name and found is None:
            notices.append(f"'{obj.name}' has no point attribute '{name}' to take as {kind}")
    softened = soft.attribute_name(obj)
    by = numbers(softened)
    if softened and by is None:
        notices.append(f"'{obj.name}' has no point attribute '{softened}' to be soft by")
    if obj.patina.hide_uncolored:
        opacities, rgb = attributes.without_uncolored(opacities, rgb)
    analyzed = analysis.wanted(obj)
    stations = analysis.stations(obj, data, count, analyzed == 2) if analyzed else None
    if analyzed == 2 and not (stations and stations.by_grid):
        notices.append(f"'{obj.name}': {analysis.NO_GRID}")
    scans, scan_of = scans_in({name: column[:, 0] for name in SCAN_NAMES
                                      if (column := attributes.scalars(data, count, name)) is not None})
    return PointArrays(positions, normals, rgb, opacities, scalars, classes, radii, bool(analyzed), stations, by, scans, scan_of)


def style_of(obj: bpy.types.Object, matrix: Matrix) -> CloudStyle:
    patina = obj.patina
    return CloudStyle(
        world_from_object=row_major(matrix),
        lighting=enum_number(patina, "lighting"),
        cull_back=int(patina.cull_back),
        d_min=patina.d_min,
        color=materials.color(obj),
        ambient=patina.ambient,
        diffuse=patina.diffuse,
        specular=patina.specular,
        shininess=patina.shininess,
        transparency=1.0 - patina.opacity,
        shadow_off=_shadow_off(obj),
        radius=patina.radius,
        largest_gap=patina.largest_gap,
        free_space=enum_number(patina, "free_space"),
        least_trust=analysis.least_trust(patina),
        **ranges.style_fields(obj), **colors.style_fields(obj))


def _mesh_style(obj: bpy.types.Object, matrix: Matrix, surface: images.Surface) -> meshes.MeshStyle:
    use = surface.use
    return meshes.MeshStyle(world_from_object=row_major(matrix), color=surface.color[:3],
                            shadow_off=_shadow_off(obj) & 3, unlit=int(surface.unlit), alpha=use.alpha if use else images.NONE,
                            alpha_least=use.alpha_least if use else 0.0)


def _shadow_off(obj: bpy.types.Object) -> int:
    """patina_shadow_off; Blender's own ray visibility counts too."""
    patina = obj.patina
    casts = patina.cast_shadows and obj.visible_shadow
    return (not casts) * 1 + (not patina.receive_shadows) * 2 + (not patina.self_shadows) * 4
