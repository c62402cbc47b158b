# SPDX-License-Identifier: GPL-3.0-or-later
"""The 3D viewport shows a COPC that is read as it is wanted: at once, ever sharper, and without waiting for anybody."""

import subprocess
import time
from pathlib import Path

import numpy as np
from check_copc import import_copc, in_a_hurry, made, open_address
from check_formats import with_laspy
from harness import check
from mathutils import Quaternion
from patina.draw import viewport
from patina.read import programs
from patina.sync.points import built
from window import area, setup, shown, view


def there():
    """The viewport's engine, once it shows any picture."""
    found = viewport.of_area(area())
    return found if found and found.shown else None


def streams():
    found = there()
    return found._streams() if found else []


def quiet(least=1):
    return bool(shown()) and not any(stream.busy for stream in streams()) and not there()._fresh and streams()[0].arrived >= least


def test_copc_grows_sharper():
    with_laspy()
    start = time.perf_counter()
    path, entries, _ = made("window.copc.laz", 120000)
    print(f"  written in {time.perf_counter() - start:.1f} s")
    built.CACHE.clear()
    setup()
    view().view_distance = 60.0
    import_copc(path, 'ON')
    yield lambda: bool(shown()) and bool(streams())
    first = shown().pictures
    yield quiet
    stream, picture = streams()[0], shown().shown
    print(f"  {stream.arrived} of {len(entries)} pages, {shown().pictures - first} more pictures")
    check(0 < stream.arrived < len(entries), f"{stream.arrived} pages of {len(entries)}")  # finer ones than pixels are not asked for
    check("on their way" not in shown()._status(), shown()._status())
    check(np.isfinite(picture.depth).any(), "nothing is seen")
    before = stream.arrived
    view().view_distance = 6.0
    yield lambda: quiet(before + 1)
    check(streams()[0].arrived > before, "nearer it wants no more")


def test_copc_from_a_slow_server():
    """The line says what is on its way; moving waits for nothing."""
    with_laspy()
    path, _, _ = made("slow-window.copc.laz", 60000)
    built.CACHE.clear()
    server = subprocess.Popen([programs.python(), str(Path(__file__).with_name("range_server.py")), str(path), "slower"],
                              stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    try:
        address = f"http://127.0.0.1:{int(server.stdout.readline())}/{path.name}"
        with in_a_hurry():
            setup()
            open_address(address)
            yield lambda: bool(there()) and "on their way" in there()._status()
            said = there()._status()
            check("MB)" in said, said)
            took, turns = [], 0
            draw = viewport.Viewport.draw

            def timed(self, *arguments):
                start = time.perf_counter()
                found = draw(self, *arguments)
                took.append(time.perf_counter() - start)
                return found

            viewport.Viewport.draw = timed
            try:
                while turns < 30:
                    turns += 1
                    view().view_rotation = Quaternion((1.0, 0.0, 0.02 * turns, 0.01 * turns)).normalized()
                    yield lambda count=len(took): len(took) > count
            finally:
                viewport.Viewport.draw = draw
            print(f"  {said}; {len(took)} draws, {1e3 * np.median(took):.1f} ms, at most {1e3 * max(took):.1f} ms")
            check(np.median(took) < 0.1, f"{took}")
            yield quiet
            check("on their way" not in shown()._status() and not streams()[0].message, shown()._status())
    finally:
        server.stdin.close()
        server.wait(5)


def test_copc_of_a_server_that_goes_away():
    """One message that names the address and the page; the last good picture stays."""
    with_laspy()
    path, _, _ = made("gone-window.copc.laz", 60000)
    built.CACHE.clear()
    server = subprocess.Popen([programs.python(), str(Path(__file__).with_name("range_server.py")), str(path), "slower"],
                              stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    try:
        address = f"http://127.0.0.1:{int(server.stdout.readline())}/{path.name}"
        with in_a_hurry():
            setup()
            open_address(address)
            yield lambda: bool(streams()) and streams()[0].arrived > 4
            server.kill()
            yield lambda: bool(streams()) and bool(streams()[0].message) and not streams()[0].busy
            said = there()._status()
            print(f"  {said}")
            check(address in said and "page " in said, said)
            check(np.isfinite(there().shown.depth).any(), "the picture is gone")
            check(any(address in text for text in there().notices), f"{there().notices}")
    finally:
        server.stdin.close()
        server.wait(5)
