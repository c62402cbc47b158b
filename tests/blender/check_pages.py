# SPDX-License-Identifier: GPL-3.0-or-later
"""What was fetched of addresses and slow shares and is kept on the disk: fetched once, noticed where it changed or was cut, and never in the way."""

import os
import shutil
import subprocess
import time
from contextlib import contextmanager
from pathlib import Path
from types import SimpleNamespace
from unittest import mock

import bpy
from check_copc import in_a_hurry, made, open_address, see, server, stream_of
from check_ept import equal, shown, tiles
from check_preferences import enabled
from harness import SCRATCH, check, new_scene, render, reports
from patina import choices, preferences
from patina.operators import preferences as operators
from patina.read import programs
from patina.read.streaming import shelf
from patina.sync.points import addresses, built, cache
from range_server import NOTHING

FOLDER = SCRATCH / "pages kept"
POINTS = 3000  # ten nodes
PART = f"{0:032x}/{0:016x}"  # what folders of a shelf are called


@contextmanager
def keeping(what='ADDRESSES', folder=FOLDER):
    shutil.rmtree(FOLDER, ignore_errors=True)
    with enabled() as chosen, in_a_hurry():
        chosen.keep_pages, chosen.pages_folder = what, str(folder)
        yield chosen


def opened(address):
    """The picture of a new session."""
    built.CACHE.clear()
    new_scene()
    reports.clear()
    see([open_address(address)])
    return render()


def fetched(asked):
    """Bytes."""
    return sum(last + 1 - first for first, last in asked)


def kept_files():
    return sorted(path for path, _, _ in shelf.files(FOLDER))


def below_root(entries):
    """Kept pages but the root's, without which nothing opens. entries: of a COPC; none: an EPT's."""
    names = {f"{at}-{size}.kept" for (level, *_), at, size, _ in entries if level}
    return [place for place in kept_files() if place.name in names or not entries and place.name.startswith("ept-data_")
            and not place.name.startswith("ept-data_0-")]


def test_kept_pages_are_fetched_once():
    path, entries, _ = made("once.copc.laz", POINTS)
    for how, least in (("etag", 0), ("dated", 0), ("", 589)):
        with keeping(), server(path, how) as (address, asked):
            first = opened(address)
            before, size = len(asked), fetched(asked)
            check(len(kept_files()) == before, f"{how}: {len(kept_files())} of {before}")
            second = opened(address)
            new = asked[before:]
            check(len(new) == 1 and fetched(new) == least, f"{how}: {new}")
            check(not reports, f"{reports}")
            equal(first, second, how)
        print(f"  {how or 'bare'}: {before} answers, {size:,} bytes of {path.stat().st_size:,}; again 1 of {least} bytes")
        check(stream_of().arrived <= len(entries), "more than there is")


def test_kept_is_nothing_unless_wanted():
    path, _, _ = made("unwanted.copc.laz", 3000)
    for what, place in (('OFF', FOLDER), ('ADDRESSES', FOLDER)):
        with keeping(what, place), server(path, "etag") as (address, _):
            if what == 'OFF':
                opened(address)
            else:
                shown(path, 'ON')
            check(not FOLDER.exists(), f"{what}: {kept_files()}")
    with keeping('ALL'):
        first = shown(path, 'ON')
        held = kept_files()
        check(len(held) > 4, f"{held}")
        for place in held:
            os.utime(place, (0, 0))
        equal(first, shown(path, 'ON'), "of a file")
        check(all(place.stat().st_mtime > 0 for place in held), "it was not asked")


def test_changed_file_on_the_server():
    for how in ("etag", "dated", ""):
        path, _, _ = made("changes.copc.laz", POINTS)
        with keeping(), server(path, how) as (address, asked):
            first, old = opened(address), kept_files()
            made("changes.copc.laz", POINTS, seed=2)
            os.utime(path, (2e9, 2e9))
            before = len(asked)
            second, new = opened(address), kept_files()
            check(not reports and len(asked) > before + 4, f"{how}: {reports} {asked[before:]}")
            check(not any(place.exists() for place in old) and new, f"{how}: the old ones stay")
        built.CACHE.clear()
        equal(shown(path, 'ON'), second, how)
        check(any((pixels != second[name]).any() for name, pixels in first.items()), f"{how}: nothing changed")


def test_file_changes_while_it_is_shown():
    path, _, _ = made("while.copc.laz", POINTS)
    for how in ("etag", "dated"):
        made("while.copc.laz", POINTS)
        with keeping(), server(path, how) as (address, _):
            built.CACHE.clear()
            new_scene()
            reports.clear()
            see([open_address(address)])
            made("while.copc.laz", POINTS, seed=2)
            os.utime(path, (2e9, 2e9))
            render()
        said = " ".join(text for _, text in reports)
        check("has changed: open it again" in said and address in said, f"{how}: {said}")
        print(f"  {said}")


def test_torn_pages_are_fetched_again():
    path, _, _ = made("torn.copc.laz", POINTS)
    with keeping(), server(path, "etag") as (address, asked):
        first = opened(address)
        held = kept_files()
        for place, data in zip(held[::3], (b"", held[0].read_bytes()[:30], held[0].read_bytes()[:-1], held[-1].read_bytes()), strict=False):
            place.write_bytes(data)
        torn = min(len(held[::3]), 4)
        before = len(asked)
        second = opened(address)
        new = [part for part in asked[before:] if part != NOTHING]
        check(len(new) == torn and not reports, f"{torn} torn, {len(new)} fetched: {reports}")
        equal(first, second, "torn")
        before = len(asked)
        opened(address)
        check(asked[before:] == [NOTHING], f"not mended: {asked[before:]}")
        for text in ("", "{", "[]", '{"version": "../..", "total": 1, "etag": "", "modified": "", "head": ""}'):  # and what tells of them
            about = next(FOLDER.glob("*/about.json"))
            about.write_text(text)
            equal(first, opened(address), "about")
            check(not reports, f"{reports}")


def test_garbage_is_not_kept():
    """What a server sent, and was no good, is asked for again: a page, and what tells of pages."""
    path, entries, _ = made("garbage.copc.laz", POINTS)
    good = path.read_bytes()
    for at in (entries[3][1] + 20, len(good) - 40):
        with keeping(), server(path, "") as (address, _):
            path.write_bytes(good[:at] + b"\xff" * 30 + good[at + 30:])  # the head is the same, and nobody tells of a state
            try:
                opened(address)
            except RuntimeError as error:
                reports.append(("ERROR", str(error)))
            check(any(address in text for _, text in reports), "nothing was wrong")
            print(f"  {reports[-1][1].strip()}")
            path.write_bytes(good)
            found = opened(address)
            check(not reports, f"{reports}")
        built.CACHE.clear()
        equal(shown(path, 'ON'), found, "garbage")


def test_without_the_server():
    for folder, name in ((False, "gone.copc.laz"), (True, "gone")):
        path, entries = (tiles(name, POINTS)[0], []) if folder else made(name, POINTS)[:2]
        with keeping():
            with server(path, "etag") as (address, asked):
                address = address.replace("/gone", "/ept.json") if folder else address
                first = opened(address)
                before = len(asked)
                online, addresses.online = addresses.online, lambda: False
                try:
                    for _ in range(2):  # nothing is asked where nothing may be
                        equal(first, opened(address) if _ == 0 else render(), "offline")
                        said = " ".join(text for _, text in reports)
                        check("shown is what the cache holds" in said and "online" in said.lower() and address in said, said)
                        check(len(asked) == before, f"{asked[before:]}")
                finally:
                    addresses.online = online
                print(f"  {said}")
                before = len(asked)
                render()  # may be fetched again: a stream of its own
                check(len(asked) == before + 1 + (asked[-1] != NOTHING), f"{asked[before:]}")
            equal(first, opened(address), "without its server")
            said = " ".join(text for _, text in reports)
            check("shown is what the cache holds" in said and "connection" in said.lower(), said)
            print(f"  {said}")
            below_root(entries)[-1].unlink()
            opened(address)
            said = " ".join(text for _, text in reports)
            check("the cache does not hold it" in said and "page " in said, said)
            print(f"  {said}")
            shutil.rmtree(FOLDER)
            try:
                opened(address)
            except RuntimeError as error:
                check("the cache" not in str(error) and address in str(error), str(error))
            else:
                check(False, "shown out of nothing")


def test_no_room():
    """One message, and the same picture: a folder that cannot be one, a full disk."""
    path, _, _ = made("room.copc.laz", POINTS)
    wanted = shown(path, 'ON')
    occupied = SCRATCH / "occupied"
    occupied.write_text("mine")
    with keeping(folder=occupied), server(path, "etag") as (address, _):
        equal(wanted, opened(address), "no folder")
        said = [text for _, text in reports]
        check(len(said) == 1 and "nothing more is kept in" in said[0] and str(occupied) in said[0], f"{said}")
        check(occupied.read_text() == "mine", "it is gone")
        print(f"  {said[0]}")
    said, place = [], FOLDER / PART / "1.kept"
    for full in (OSError(28, "No space left on device"), PermissionError(13, "Permission denied"), OSError(30, "Read-only file system")):
        shutil.rmtree(FOLDER, ignore_errors=True)
        said.clear()
        keep = shelf.Shelf(FOLDER, 1 << 20, said.append)
        keep.put(place, "1", b"before")
        with mock.patch.object(Path, "write_bytes", side_effect=full):
            for _ in range(3):
                keep.put(FOLDER / PART / "2.kept", "2", b"after")
        check(len(said) == 1 and full.strerror in said[0], f"{said}")
        check(keep.take(place, "1") == b"before" and keep.take(FOLDER / PART / "2.kept", "2") is None, "what was there is lost")
        check(os.listdir(place.parent) == ["1.kept"], f"{os.listdir(place.parent)}")
    said.clear()
    shelf.Shelf(FOLDER, 1 << 20, said.append, least_free=1 << 60).put(place, "1", b"more")
    check(len(said) == 1 and "No space" in said[0] and place.read_bytes().endswith(b"before"), f"{said}")


def test_no_more_than_the_cap():
    path, _, _ = made("cap.copc.laz", POINTS)
    with keeping() as chosen, server(path, "etag") as (address, _):
        whole = opened(address)
        size = sum(size for _, size, _ in shelf.files(FOLDER))
        shutil.rmtree(FOLDER)
        with mock.patch.object(choices, "GIGA", size // 3):
            chosen.pages_limit = 1
            equal(whole, opened(address), "capped")
            held = sum(size for _, size, _ in shelf.files(FOLDER))
            check(size // 6 < held <= size // 3 and not reports, f"{held} of {size // 3} {reports}")
            print(f"  {size:,} bytes fetched, {held:,} kept of at most {size // 3:,}")
            equal(whole, opened(address), "again")
    keep, now = shelf.Shelf(FOLDER, 1000, print), time.time()
    shutil.rmtree(FOLDER, ignore_errors=True)
    places = [FOLDER / PART / f"{k}.kept" for k in range(5)]
    for k, place in enumerate(places[:4]):
        keep.put(place, str(k), bytes(200))
        os.utime(place, (now - 100 + k, now - 100 + k))
    keep.take(places[0], "0")
    half = FOLDER / PART / "1.kept.77-1.part"  # of one that was killed long ago
    half.write_text("")
    os.utime(half, (0, 0))
    keep.put(places[4], "4", bytes(200))
    check([place.exists() for place in places] == [True, False, True, True, True], f"{os.listdir(FOLDER / PART)}")
    check(not half.exists(), "half a file stays")
    keep.put(places[1], "1", bytes(2000))
    check(not places[1].exists(), "larger than all may be")


_WORK = """
import random, sys
sys.path.insert(0, sys.argv[1])
from pathlib import Path
import shelf
folder, chance, found = Path(sys.argv[2]), random.Random(int(sys.argv[3])), 0
keep = shelf.Shelf(folder, 40000, lambda text: sys.exit(text))
for _ in range(1500):
    key = str(chance.randrange(40))
    path, data = folder / ("0" * 32) / ("0" * 16) / (key + ".kept"), key.encode() * 1000
    got = keep.take(path, key)
    assert got in (None, data), key
    found += got is not None
    if got is None:
        keep.put(path, key, data)
    if chance.random() < 0.002:
        shelf.clear(folder)
print(found)
"""


def test_two_at_once():
    shutil.rmtree(FOLDER, ignore_errors=True)
    own = str(Path(shelf.__file__).parent)
    both = [subprocess.Popen([programs.python(), "-I", "-c", _WORK, own, str(FOLDER), str(seed)], stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                             text=True) for seed in (1, 2)]
    for one in both:
        said, wrong = one.communicate(timeout=60)
        check(one.returncode == 0 and int(said) > 100, f"{said} {wrong[-300:]}")
        print(f"  found {said.strip()} of 1500")
    held = sum(size for _, size, _ in shelf.files(FOLDER))
    check(held <= 40000 * (1 + 2 / 16) and not list(FOLDER.rglob("*.part")), f"{held}")


def test_what_is_not_ours_stays():
    """In a folder that holds other things: neither looking nor clearing nor the cap takes them."""
    shutil.rmtree(FOLDER, ignore_errors=True)
    theirs = [FOLDER / name for name in ("films/x/film.mkv.part", "site/about.json", "site/old/1.kept", f"{PART}/film.mkv.part", "notes.kept")]
    for place in theirs:
        place.parent.mkdir(parents=True, exist_ok=True)
        place.write_text("mine")
        os.utime(place, (0, 0))
    keep = shelf.Shelf(FOLDER, 1000, print)
    for k in range(6):
        keep.put(FOLDER / PART / f"{k}.kept", str(k), bytes(300))
    check(0 < len(kept_files()) < 6 and not set(kept_files()) & set(theirs), f"{kept_files()}")
    shelf.clear(FOLDER)
    check(all(place.read_text() == "mine" for place in theirs) and not kept_files(), f"{list(FOLDER.rglob('*'))}")


def test_the_cap_is_not_looked_after_at_each_part():
    shutil.rmtree(FOLDER, ignore_errors=True)
    keep = shelf.Shelf(FOLDER, 100_000, print)
    keep.last.append(FOLDER / PART / "0.kept")  # without it nothing can be shown
    with mock.patch.object(shelf, "files", wraps=shelf.files) as looked:
        for k in range(600):
            keep.put(FOLDER / PART / f"{k}.kept", str(k), bytes(1000))
    held = sum(size for _, size, _ in shelf.files(FOLDER))
    check(held <= 100_000 and (FOLDER / PART / "0.kept").exists(), f"{held}")
    check(looked.call_count < 150, f"looked through {looked.call_count} times for 600 parts")


def test_what_is_kept_shows_whatever_is_missing():
    """Without a server more parts are missing in a row than it is asked for: what is kept behind them shows all the same."""
    path, entries, _ = made("half.copc.laz", POINTS)
    with keeping():
        with server(path, "etag") as (address, _):
            opened(address)
        for place in below_root(entries)[:5]:
            place.unlink()
        opened(address)
        said = " ".join(text for _, text in reports)
        check("the cache does not hold it" in said, said)
        check(stream_of().arrived >= len(entries) - 5, f"{stream_of().arrived} of {len(entries)} arrived")


def test_preferences_say_what_is_kept():
    path, _, _ = made("button.copc.laz", POINTS)
    with keeping() as chosen, server(path, "etag") as (address, asked):
        first = opened(address)
        (FOLDER / "mine.txt").write_text("stays")
        held = sum(place.stat().st_size for place in kept_files())
        check(cache.pages_held() == (len(kept_files()), held), f"{cache.pages_held()}")
        operators._looked.clear()
        layout = mock.MagicMock()
        drawn = SimpleNamespace(layout=layout, bl_rna=chosen.bl_rna, **{name: getattr(chosen, name) for name in chosen.__annotations__})
        preferences.PatinaPreferences.draw(drawn, None)
        check(f"{len(kept_files()):,} parts of files kept, {held / 1e9:.2f} GB" in str(layout.mock_calls), f"{layout.mock_calls}")
        bpy.ops.patina.remove_caches(clouds=False)
        check([place.name for place in FOLDER.iterdir()] == ["mine.txt"] and cache.pages_held() == (0, 0), f"{list(FOLDER.rglob('*'))}")
        before = len(asked)
        equal(first, opened(address), "cleared")
        check(len(asked) > before + 4, "it is not fetched anew")
