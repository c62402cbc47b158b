# SPDX-License-Identifier: GPL-3.0-or-later
"""Trust as an artist sees it: the threshold, histogram, pass, ramp, style, selection, export, statistics and warnings, on both kinds of
objects; saved clouds of older versions."""

import struct

import bpy
import numpy as np
from check_import import import_ply, write_ply
from harness import SCRATCH, Skip, add_points, check, check_close, new_scene, patina, render, reports, sphere, stats, written
from patina import migrate, point_data
from patina.draw import histogram
from patina.read.importers import library
from patina.sync.analyses import trust
from patina.sync.points import built, edits, linked

BALL, STRAYS = 20000, 20
KINDS = ('MESH', 'POINTCLOUD') if point_data.HAS_CLOUDS else ('MESH',)


def places():
    """A green ball, and far apart before it strays, which are red."""
    random = np.random.default_rng(11)
    ball = sphere(BALL)[0] * (1.0 + 0.001 * random.standard_normal((BALL, 1)))
    row, column = np.divmod(np.arange(STRAYS), 5)
    strays = np.column_stack([0.36 * (column - 2), 0.36 * (row - 1.5), random.uniform(-2.8, -2.2, STRAYS)])
    colors = np.full((BALL + STRAYS, 4), (0, 255, 0, 255), np.uint8)
    colors[BALL:] = (255, 0, 0, 255)
    return np.concatenate([ball, strays]), colors


def scene_with_strays(kind='MESH', width=160, height=120):
    built.CACHE.clear()
    histogram.forget()
    scene = new_scene(width, height)
    scene.patina.surface = 'SPLATS'
    obj = add_points(*places())
    obj.patina.lighting = 'UNLIT'
    bpy.context.view_layer.objects.active = obj
    obj.select_set(True)
    if kind == 'POINTCLOUD':
        bpy.ops.object.patina_to_point_cloud()
        obj = bpy.context.object
        check(obj.type == 'POINTCLOUD', "converted")
    return scene, obj


def red(picture):
    """How many pixels are."""
    color = picture["Combined"]
    return int(((color[..., 3] > 0) & (color[..., 0] > color[..., 1])).sum())


def warnings():
    return [text for kind, text in reports if kind == 'WARNING']


def selected(obj):
    """(n,) bool, in Object or Edit Mode."""
    count = BALL + STRAYS
    if obj.type == 'POINTCLOUD':
        found = np.ones(count, bool)
        if known := obj.data.attributes.get(".selection"):
            known.data.foreach_get("value", found)
        return found
    if obj.mode == 'EDIT':
        import bmesh
        return np.array([vertex.select for vertex in bmesh.from_edit_mesh(obj.data).verts])
    found = np.empty(count, bool)
    obj.data.vertices.foreach_get("select", found)
    return found


def test_the_threshold():
    """Automatic leaves strays out, 0 draws them; ticked, the slider begins where automatic was. The line above a render counts them."""
    for kind in KINDS:
        _, obj = scene_with_strays(kind)
        patina_of = obj.patina
        check(patina_of.least_trust < 0.0 and not patina_of.use_least_trust, "automatic as it comes")
        automatic = render()
        known = histogram.trust_of(obj)
        out = trust.left_out(known.cloud(), 0.0)
        check(0.8 * STRAYS <= out <= 1.5 * STRAYS, f"{kind}: {out} of {STRAYS} strays are left out")
        check(any(f"{out:,} left out for their trust" in text for text in stats), f"{stats[-1]}")
        patina_of.use_least_trust = True
        check_close(patina_of.least_trust, known.cloud().trust_default, 1e-6, "begins at the automatic one")
        patina_of.least_trust = 0.0
        check(patina_of.use_least_trust, "0 is a threshold of one's own")
        everything = render()
        check(red(everything) > 15 and red(automatic) < 0.2 * red(everything), f"{kind}: {red(automatic)}, {red(everything)} red pixels")
        check(not any("left out" in text for text in stats), f"{stats[-1]}")
        patina_of.least_trust = 1.0
        check((render()["Combined"][..., 3] > 0).sum() <= (automatic["Combined"][..., 3] > 0).sum(), "1 leaves out most")
        patina_of.use_least_trust = False
        check(patina_of.least_trust < 0.0 and np.array_equal(render()["Combined"], automatic["Combined"]), "automatic again")


def test_histogram_of_trust():
    """A bar a level of trust: red ones left of the line are left out. Known from a picture on, and the same cloud is not counted anew."""
    _, obj = scene_with_strays()
    check(histogram.trust_of(obj) is None, "nothing before a picture")
    render()
    known = histogram.trust_of(obj)
    check(known.counts.sum() == BALL + STRAYS and len(known.counts) == trust.LEVELS, f"{known.counts}")
    level = trust.level_from(known.cloud(), trust.least_of(obj.patina))
    histogram.trust_icon(obj, known, level)
    histogram.paint()
    image = histogram.pixels(obj, histogram._trust_title)

    def are(color):
        return (np.abs(image - color).max(-1) < 0.01).any(0)

    wide = histogram.SIZE // trust.LEVELS
    line, out, drawn = np.flatnonzero(are(histogram._LINE)), np.flatnonzero(are(histogram._LEFT_OUT)), np.flatnonzero(are(histogram._SOFT))
    check(line.max() == level * wide and out.max() < line.min() and drawn.min() > line.max() - 1, f"line {line}, left out to {out.max()}")
    check(known.counts[:level].sum() == trust.left_out(known.cloud(), 0.0), "the bars before the line")
    obj.patina.least_trust = 0.5
    render()
    check(histogram.trust_of(obj).stamp == known.stamp, "the same cloud is not counted anew")
    check(trust.level_from(known.cloud(), trust.least_of(obj.patina)) < level, "a lower threshold")
    obj.patina.analysis = 'OFF'
    render()
    check(histogram.trust_of(obj) is None, "nothing is known without an analysis")


def test_trust_as_color():
    """A gray ramp over trust shows what the pass tells; a cloud without an analysis has the fallback color."""
    for kind in KINDS:
        scene, obj = scene_with_strays(kind)
        scene.patina.surface = 'FILL'
        obj.patina.least_trust = 0.0
        obj.patina.colors.source, obj.patina.colors.ramp = 'TRUST', 'GREY'
        scene.view_layers[0].patina.use_pass_trust = True
        picture = render()
        shows = picture["Combined"][..., 3] > 0
        value, wanted = picture["Combined"][..., 0], picture["Trust"][..., 0]
        check(shows.sum() > 1000 and np.ptp(wanted[shows]) > 0.5, f"{kind}: trust from {wanted[shows].min()} to {wanted[shows].max()}")
        check(np.abs(value - patina.native.ramp("grey")[np.rint(wanted * 255).astype(int), 0])[shows].max() < 0.02, f"{kind}: the ramp")
        order = np.argsort(wanted[shows])
        check((np.diff(value[shows][order]) >= -1e-6).all(), f"{kind}: brighter where trust is more")
        obj.patina.analysis, obj.patina.color = 'OFF', (0.25, 0.5, 0.75)
        bare = render()
        check_close(bare["Combined"][bare["Combined"][..., 3] > 0][:, :3], (0.25, 0.5, 0.75), 1e-6, f"{kind}: without an analysis")


def test_trust_pass_in_a_file():
    """Layers of an EXR: the pass is called Trust, one channel."""
    for kind in KINDS:
        scene, _ = scene_with_strays(kind, 40, 30)
        scene.view_layers[0].patina.use_pass_trust = True
        settings = scene.render.image_settings
        if hasattr(settings, "media_type"):  # from Blender 5.0 on
            settings.media_type = 'MULTI_LAYER_IMAGE'
        settings.file_format, settings.color_depth, settings.exr_codec = 'OPEN_EXR_MULTILAYER', '32', 'NONE'
        scene.render.filepath = str(SCRATCH / f"trust-{kind}.exr")
        bpy.ops.render.render(write_still=True)
        data = (SCRATCH / f"trust-{kind}.exr").read_bytes()
        check(f"{scene.view_layers[0].name}.Trust.X\0".encode() in data[:4096], f"{kind}: {data[:1200]}")
        shown = written[-1][1]["TRUST"]
        check(0.5 < shown.max() <= 1.0 and shown.min() == 0.0, f"{kind}: {shown.min()} to {shown.max()}")


def test_style_that_shows_trust():
    """It draws all points by their trust. The next style takes that back; a threshold of one's own stays with others."""
    for kind in KINDS:
        scene, obj = scene_with_strays(kind)
        obj.patina.least_trust = 0.4
        scene.patina.style.applied = "ink"
        bpy.ops.patina.apply_style(style="ink")
        check_close(obj.patina.least_trust, 0.4, 1e-6, "one's own threshold stays")
        bpy.ops.patina.apply_style(style="trust")
        check(obj.patina.colors.source == 'TRUST' and obj.patina.least_trust == 0.0, "the style's")
        picture = render()
        known = histogram.trust_of(obj)
        check(trust.left_out(known.cloud(), trust.least_of(obj.patina)) == 0, "all are drawn")
        color = picture["Combined"]
        sure = np.median(color[50:70, 70:90].reshape(-1, 4), axis=0)
        check((sure[:3] > 0.6).all(), f"{kind}: a sure surface is white, not {sure}")
        bpy.ops.patina.apply_style(style="scan")
        check(obj.patina.colors.source == 'OWN' and obj.patina.least_trust < 0.0, "taken back")


def test_select_untrusted():
    """In Object and Edit Mode, of both kinds: the strays, hardly anything else, and as many as pictures leave out."""
    for kind in KINDS:
        for mode in ('OBJECT', 'EDIT'):
            _, obj = scene_with_strays(kind)
            if mode == 'EDIT':
                bpy.ops.object.mode_set(mode='EDIT')
            try:
                check(bpy.ops.object.patina_select_untrusted() == {'FINISHED'}, f"{kind}, {mode}")
                check(obj.mode == mode, "the mode stays")
                found = selected(obj)
                check(found[BALL:].sum() >= 0.8 * STRAYS and found[:BALL].sum() < 0.001 * BALL,
                      f"{kind}, {mode}: {found[BALL:].sum()} of {STRAYS} strays and {found[:BALL].sum()} others")
                bpy.ops.object.patina_select_untrusted(how='SUB')
                check(not selected(obj).any(), f"{kind}, {mode}: subtracted")
                obj.patina.least_trust = 0.0
                bpy.ops.object.patina_select_untrusted(how='ADD')
                check(np.array_equal(selected(obj), found), f"{kind}, {mode}: at 0 those that the default leaves out")
            finally:
                if obj.mode == 'EDIT':
                    bpy.ops.object.mode_set(mode='OBJECT')
            obj.patina.property_unset("least_trust")
            render()
            check(found.sum() == trust.left_out(histogram.trust_of(obj).cloud(), 0.0), f"{kind}, {mode}: as many as are left out")
    obj.patina.analysis = 'OFF'
    try:
        bpy.ops.object.patina_select_untrusted()
    except RuntimeError as error:
        check("Analysis is Off" in str(error), str(error))
    else:
        raise AssertionError("without an analysis nothing is known")


def linked_strays(name="strays.ply"):
    positions, colors = places()
    scene = new_scene(160, 120)
    scene.patina.surface = 'SPLATS'
    path = write_ply(name, [*((axis, "f4", positions[:, i]) for i, axis in enumerate("xyz")),
                            *((channel, "u1", colors[:, i]) for i, channel in enumerate(("red", "green", "blue")))])
    obj, = import_ply(path, link=True)
    bpy.context.view_layer.objects.active = obj
    return obj, path


def test_select_untrusted_of_a_linked_cloud():
    """They can be deleted then."""
    obj, _ = linked_strays()
    obj.patina.least_trust = 0.0
    before = red(render())
    bpy.ops.object.patina_select_untrusted()
    found = edits.flags(edits.for_cloud(edits.packed_of(obj), BALL + STRAYS).selected, BALL + STRAYS)
    check(found[BALL:].sum() >= 0.8 * STRAYS and found[:BALL].sum() < 0.001 * BALL, f"{found[BALL:].sum()}, {found[:BALL].sum()}")
    bpy.ops.object.patina_points_delete()
    check(before > 15 and red(render()) < 0.2 * before, f"{before} red pixels, then {red(render())}")


def test_export_of_trusted_points():
    """All formats, both kinds, and linked clouds without what was deleted."""
    kinds = [kind for kind, packages in (('PLY', ()), ('LAS', ()), ('LAZ', ("laspy", "lazrs")), ('E57', ("pye57",)))
             if not any(patina.read.readers.lacks(name) for name in packages)]
    for kind in KINDS:
        _, obj = scene_with_strays(kind)
        render()
        out = trust.left_out(histogram.trust_of(obj).cloud(), 0.0)
        for file in kinds:
            path = SCRATCH / f"trusted-{kind}.{file.lower()}"
            for trusted in (False, True):
                bpy.ops.export_scene.patina_points(filepath=str(path), kind=file, overwrite=True, trusted=trusted)
                points = patina.read.importers.reader(path).read(path, patina.read.importers.Filter(), patina.read.importers.Progress())
                positions = points.positions + np.array(points.origin)
                strays = int((positions[:, 2] > -2.9).sum())
                check(len(positions) == BALL + STRAYS - out * trusted, f"{kind}, {file}: {len(positions)} points, {out} are untrusted")
                check(strays < 0.2 * STRAYS if trusted else strays == STRAYS, f"{kind}, {file}: {strays} strays")
    obj, _ = linked_strays("deleted.ply")
    old = edits.none(BALL + STRAYS)
    first = np.arange(BALL + STRAYS) < 100
    from dataclasses import replace
    patina.operators.points.write(obj, replace(old, deleted=edits.of_flags(first)))
    path = SCRATCH / "trusted-linked.ply"
    bpy.ops.export_scene.patina_points(filepath=str(path), kind='PLY', trusted=True)
    linked_cloud = trust.analyzed_cloud(obj, bpy.context.scene)
    untrusted = trust.untrusted(linked_cloud, 0.0)
    with library.native.File(str(path)) as file:
        check(file.count == BALL + STRAYS - int((untrusted | first).sum()), f"{file.count}")


def test_none_is_trusted():
    """All are drawn, and one warning says so; with 0 none does. Statistics and the selection agree."""
    for kind in KINDS:
        built.CACHE.clear()
        new_scene(160, 120).patina.surface = 'FILL'
        positions = np.random.default_rng(2).uniform(-1.0, 1.0, (300, 3)) - (0, 0, 4)
        obj = add_points(positions, np.full((300, 4), 255, np.uint8))
        bpy.context.view_layer.objects.active = obj
        obj.select_set(True)
        if kind == 'POINTCLOUD':
            bpy.ops.object.patina_to_point_cloud()
            obj = bpy.context.object
        obj.patina.least_trust = 0.0
        everything = render()
        check(not warnings(), f"{kind}: {warnings()}")
        counts = histogram.trust_of(obj).counts
        highest = int(np.flatnonzero(counts).max())
        if highest == trust.LEVELS - 1:
            raise Skip("this analysis trusts a point among strays fully")
        obj.patina.least_trust = trust.of_level(highest + 1)
        drawn = render()
        check(np.array_equal(drawn["Combined"], everything["Combined"]) and (drawn["Combined"][..., 3] > 0).sum() > 100, f"{kind}: all are drawn")
        check(len(warnings()) == 1 and "no point is trusted" in warnings()[0] and obj.name in warnings()[0], f"{kind}: {reports}")
        check(trust.none_is_trusted(histogram.trust_of(obj).cloud(), obj.patina.least_trust), "known to panels")
        check(bpy.ops.object.patina_select_untrusted() == {'CANCELLED'}, f"{kind}: nothing is selected")


# ---- saved clouds of older versions ------------------------------------------------------------------------------------

_MASK = (1 << 64) - 1
_TODAY, _UNTRUSTED = 14, 12  # versions of saved clouds: native/scene/clouds/cloud_store.c
_TAIL, _UNTRUSTED_TAIL = 24 + 136, 24  # bytes of their headers behind the check sum


def _mix(value, word):
    value = (value ^ word) * 0x9E3779B97F4A7C15 & _MASK
    return value ^ value >> 29


def _sum(seed, data):
    """As the library sums up a file's head: fingerprint.c."""
    ways, whole = [(seed + i) & _MASK for i in range(4)], len(data) // 32 * 32
    for at in range(0, whole, 32):
        ways = [_mix(way, word) for way, word in zip(ways, struct.unpack_from("<4Q", data, at), strict=True)]
    rest = struct.unpack("<4Q", data[whole:].ljust(32, b"\0"))
    found = _mix(seed, len(data) - whole)
    for way, word in zip(ways, rest, strict=True):
        found = _mix(found, _mix(way, word))
    return found


def make_older(path):
    """Turns a saved cloud of today into one of version 12, which has no trust: its header is shorter and has another number."""
    data = bytearray(path.read_bytes())
    version, chunk_size, _, chunks = struct.unpack_from("<4I", data, 8)
    check(version == _TODAY, f"version {version}")
    tail = next(at for at in range(8, 1 << 16, 8) if _sum_of_head(data, at, chunk_size, chunks, _TAIL) == struct.unpack_from("<Q", data, at)[0])
    struct.pack_into("<I", data, 8, _UNTRUSTED)
    section = 1 << 16
    sums = chunks * _summed(data, chunks)
    where = len(data) - -(-sums // section) * section
    struct.pack_into("<Q", data, tail + 8, _sum(_UNTRUSTED, bytes(data[where:where + sums])))
    struct.pack_into("<Q", data, tail, _sum_of_head(data, tail, chunk_size, chunks, _UNTRUSTED_TAIL))
    path.write_bytes(data)


def _summed(data, chunks):
    """Bytes that the sums of a chunk's pages take."""
    return 4 * next(arrays for arrays in range(4, 20) if any(
        _sum(_TODAY, bytes(data[len(data) - -(-4 * arrays * chunks // 65536) * 65536:][:4 * arrays * chunks])) == struct.unpack_from("<Q", data, at)[0]
        for at in range(64, 1024, 8)))


def _sum_of_head(data, at, chunk_size, chunks, tail):
    found = _sum(struct.unpack_from("<I", data, 8)[0], bytes(data[:at]))
    found = _sum(found, bytes(data[1 << 16:(1 << 16) + chunks * chunk_size]))
    return _sum(found, bytes(data[at + 8:at + 8 + tail]))


def test_an_older_cache_is_analyzed_again():
    """Once, with one message; the next time it is as any other."""
    obj, _ = linked_strays("old.ply")
    wanted = render()
    place = linked.source_of(obj, 1, []).kept
    built.CACHE.clear()
    make_older(place)
    again = render()
    check(sum("older version" in text for text in warnings()) == 1 and len(warnings()) == 1, f"{reports}")
    check(np.array_equal(again["Combined"], wanted["Combined"]), "the same picture")
    built.CACHE.clear()
    third = render()
    check(not warnings() and np.array_equal(third["Combined"], wanted["Combined"]), f"kept: {reports}")


def test_an_older_saved_cloud_is_analyzed_again():
    """The file stays as it is, the image is that of an analyzed one, and the message says how to keep the analysis."""
    obj, _ = linked_strays("named.ply")
    render()
    place = SCRATCH / "named.cloud"
    place.write_bytes(linked.source_of(obj, 1, []).kept.read_bytes())
    scene = new_scene(160, 120)
    scene.patina.surface = 'SPLATS'
    import_ply(place, link=True)
    wanted = render()
    check(not warnings() and wanted["Combined"][..., 3].any(), f"of today: {reports}")
    make_older(place)
    before = place.read_bytes()
    built.CACHE.clear()
    again = render()
    check_close(again["Combined"], wanted["Combined"], 1e-6, "the same image but for roundings")
    check(sum("older version" in text and "patina analyse" in text for text in warnings()) == 1, f"{reports}")
    render()
    check(not warnings(), f"told once: {reports}")
    check(place.read_bytes() == before, "the file is left alone")


def test_older_files_hid_strays():
    """What was hidden as stray is left out for its trust; what is no longer known is taken out of the file."""
    scene, obj = scene_with_strays()
    other = add_points(places()[0], name="other")
    stored = migrate._stored(obj)
    obj.patina.least_trust = other.patina.least_trust = 0.0
    stored["hide_stray"], stored["least_certainty"] = True, 0.3
    scene.patina.version = 1
    migrate.bring(scene)
    check(obj.patina.least_trust < 0.0 and other.patina.least_trust == 0.0, f"{obj.patina.least_trust}, {other.patina.least_trust}")
    check("hide_stray" not in migrate._stored(obj) and "least_certainty" not in migrate._stored(obj), "left behind")
