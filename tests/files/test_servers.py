# SPDX-License-Identifier: GPL-3.0-or-later
"""Servers and streamed files that lie: each case of the tables ends with the right bytes or a sentence, in time and in little memory.
Needs no Blender, and no network but loopback:

    PATINA_LIBRARY=... PYTHONPATH=(laspy, lazrs) python tests/files/test_servers.py [NAME ...]
"""

import gzip
import importlib
import json
import os
import shutil
import socket
import ssl
import struct
import subprocess
import sys
import tempfile
import threading
import time
import tracemalloc
from contextlib import contextmanager, suppress
from pathlib import Path
from unittest import mock

import numpy as np
import test_hostile
from runner import Skip, run_tests

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "addon/read/streaming"), str(ROOT / "addon/read/unpacking"), str(ROOT / "tests/blender")]
import copc  # noqa: E402
import copc_files  # noqa: E402
import ept_files  # noqa: E402
import source  # noqa: E402

streaming = importlib.import_module("patina.read.streaming")
SCRATCH = Path(tempfile.mkdtemp(prefix="patina-servers-"))
DATA = bytes(range(200)) * 5
IN_A_HURRY = {"timeout": 1.0, "wait": 0.01}

# ---- a server


def part(data=DATA, first=0, last=99, **headers):
    """An answer to a range."""
    lines = {"Content-Range": f"bytes {first}-{last}/{len(data)}", "Content-Length": str(last - first + 1)} | headers
    return b"HTTP/1.1 206 Partial\r\n" + "".join(f"{name}: {value}\r\n" for name, value in lines.items() if value).encode() + b"\r\n" + data[first:last + 1]


def moved(to, body=b""):
    return f"HTTP/1.1 302 Found\r\nLocation: {to}\r\n\r\n".encode() + body


def drip(data, pause=0.1):
    def send(connection, _):
        for byte in data:
            connection.sendall(bytes([byte]))
            time.sleep(pause)
    return send


def endless(start, more, seconds=8.0):
    def send(connection, _):
        connection.sendall(start)
        until = time.monotonic() + seconds
        while time.monotonic() < until:
            connection.sendall(more)
    return send


def in_turn(*answers):
    """Another answer each time; the last from then on."""
    left = list(answers)
    return lambda connection, _: connection.sendall(left.pop(0) if len(left) > 1 else left[0])


def silent(connection, _):
    connection.settimeout(8)
    with suppress(OSError):
        connection.recv(1)


@contextmanager
def server(answers, wrap=lambda connection: connection):
    """Answers by paths: bytes, or a function of the connection and the request's head. Yields its port."""
    listening = socket.create_server(("127.0.0.1", 0))

    def serve(connection):
        with suppress(OSError), connection:
            with wrap(connection) as safe:
                head = b""
                while b"\r\n\r\n" not in head:
                    got = safe.recv(4096)
                    if not got:
                        return
                    head += got
                path = head.split(b" ")[1].decode()
                answer = answers.get(path, answers.get("*", b"HTTP/1.1 404 None\r\n\r\n"))
                safe.sendall(answer) if isinstance(answer, bytes) else answer(safe, head)

    def accept():
        with suppress(OSError):
            while True:
                threading.Thread(target=serve, args=(listening.accept()[0],), daemon=True).start()

    threading.Thread(target=accept, daemon=True).start()
    try:
        yield listening.getsockname()[1]
    finally:
        listening.close()


ENDLESS = endless(moved("/good"), b"x" * 65536)
# What a server does: its answer, what reading the first 100 bytes gives (bytes, or part of the sentence), and seconds that it may take.
CASES = {
    "good": (part(), DATA[:100], 1),
    "redirect with an endless body": (ENDLESS, DATA[:100], 2),
    "redirect to ftp": (moved("ftp://127.0.0.1/x"), "an address of 'ftp', which is not opened", 1),
    "redirect to a file": (moved("file:///etc/passwd"), "an address of 'file', which is not opened", 1),
    "redirect to itself": (moved("*"), "from one address to the next, more than 5 times", 2),
    "redirect without a place": (b"HTTP/1.1 302 Found\r\n\r\n", "answers 302", 1),
    "endless body": (endless(part(**{"Content-Length": ""}), b"x" * 65536), "sent more than the 100 bytes", 2),
    "endless head": (endless(b"HTTP/1.1 206 Partial\r\n", b"A: b\r\n" * 1000), "the connection broke off", 2),
    "endless 100 Continue": (endless(b"", b"HTTP/1.1 100 Continue\r\n\r\n" * 100), "does not answer in time", 4),
    "one byte now and then": (drip(part()), "does not answer in time", 4),
    "one byte of the body now and then": (lambda connection, _: (connection.sendall(part()[:-100]), drip(DATA[:100])(connection, _)), " bytes in ", 4),
    "silence": (silent, "does not answer in time", 4),
    "cut": (part()[:-30], "cut the connection after 70 of 100 bytes", 1),
    "nothing": (b"", "the connection broke off", 1),
    "no HTTP": (b"\x00\x01\x02 hello\r\n\r\n", "the connection broke off", 1),
    "redirect to another, and on to ftp": (moved("/on"), "an address of 'ftp', which is not opened", 2),
    "Retry-After of a date": (in_turn(b"HTTP/1.1 503 Busy\r\nRetry-After: Wed, 21 Oct 2015 07:28:00 GMT\r\n\r\n", part()), DATA[:100], 2),
    "Retry-After of nonsense": (in_turn(b"HTTP/1.1 429 Busy\r\nRetry-After: -5e999 \x1b\r\n\r\n", part()), DATA[:100], 2),
    "100 Continue and then nothing": (endless(b"HTTP/1.1 100 Continue\r\n\r\n", b"", 6.0), "does not answer in time", 4),
    "5,000 digits of length": (part(**{"Content-Length": "9" * 5000}), DATA[:100], 2),
    "5,000 digits": (part(**{"Content-Range": f"bytes 0-99/{'9' * 5000}"}), "sent a different part", 1),
    "another part": (part(first=7, last=106), "sent a different part", 1),
    "gzip unasked": (part(**{"Content-Encoding": "gzip"}), "packed as 'gzip', which was not asked for", 1),
    "whole file": (b"HTTP/1.1 200 OK\r\nContent-Length: 1000\r\n\r\n" + DATA, "sends no parts of files", 1),
    "odd words": (b"HTTP/1.1 404 a\x1b[31m\r\n\r\n", "answers 404 a?[31m", 1),
    "busy for a second": (in_turn(b"HTTP/1.1 429 Slow\r\nRetry-After: 1\r\n\r\n", part()), DATA[:100], 3),
    "busy for an hour": (b"HTTP/1.1 503 Busy\r\nRetry-After: 3600\r\n\r\n", "answers 503 and asks to wait 3,600 seconds", 1),
    "busy": (b"HTTP/1.1 503 Busy\r\n\r\n", "answers 503, 3 times", 1),
}


def outcome(address, took_at_most):
    start = time.monotonic()
    try:
        found = source.source_of(address, **IN_A_HURRY).read(0, 100)
    except source.SourceError as error:
        found = str(error)
    took = time.monotonic() - start
    assert took < took_at_most + 5, f"took {took:.1f} s: {found}"  # on a loaded machine
    return found, took


def test_requests():
    for name, (answer, wanted, seconds) in CASES.items():
        with server({"*": answer, "/good": part(), "/on": moved("ftp://127.0.0.1/x")}) as port:
            found, took = outcome(f"http://127.0.0.1:{port}/case", seconds)
        good = found == wanted if isinstance(wanted, bytes) else isinstance(found, str) and wanted in found
        assert good, f"{name}: {found}"
        assert name != "busy for a second" or took >= 1, f"Retry-After was ignored: {took:.2f} s"


def test_proxy():
    with server({"http://patina.invalid/case": part()}) as port, mock.patch.dict(os.environ, {"http_proxy": f"http://127.0.0.1:{port}", "no_proxy": ""}):
        assert outcome("http://patina.invalid/case", 1)[0] == DATA[:100]


def test_encryption():
    """A certificate of nobody's is refused, one that is known is taken, and a handshake that never ends is ended."""
    if not shutil.which("openssl"):
        raise Skip("openssl is not installed, which makes a certificate")
    key, certificate = SCRATCH / "key.pem", SCRATCH / "certificate.pem"
    subprocess.run(["openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "2", "-subj", "/CN=localhost", "-addext",
                    "subjectAltName=DNS:localhost", "-keyout", key, "-out", certificate], capture_output=True, check=True)
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.load_cert_chain(certificate, key)
    with server({"*": part()}, lambda connection: context.wrap_socket(connection, server_side=True)) as port:
        assert "certificate" in outcome(f"https://localhost:{port}/case", 2)[0]
        with mock.patch.dict(os.environ, {"SSL_CERT_FILE": str(certificate)}):
            assert outcome(f"https://localhost:{port}/case", 2)[0] == DATA[:100]
    listening = socket.create_server(("127.0.0.1", 0))
    found, _ = outcome(f"https://127.0.0.1:{listening.getsockname()[1]}/case", 3)
    listening.close()
    assert "does not answer in time" in found, found


# ---- what is streamed


def streamed(place, pages=(), seconds=20.0, workers=4, **options):
    """What the reading process says of a place, and the most memory it took, in MB. options: further ones of the process."""
    folder = Path(tempfile.mkdtemp(dir=SCRATCH))
    process = subprocess.Popen([sys.executable, str(ROOT / "addon/read/streaming/reader.py"), str(folder)], stdin=subprocess.PIPE)
    try:
        process.stdin.write(json.dumps({"place": str(place), "workers": workers, **IN_A_HURRY, **options}).encode() + b"\n")
        process.stdin.flush()
        until, said = time.monotonic() + seconds, ""
        while not said and time.monotonic() < until and process.poll() is None:
            time.sleep(0.01)
            if (folder / "error").exists():
                said = (folder / "error").read_text("utf-8")
            elif (folder / "tree.json").exists():
                process.stdin.write(json.dumps({"pages": list(pages)}).encode() + b"\n")
                process.stdin.flush()
                while time.monotonic() < until and not all(any((folder / f"{page}.{kind}").exists() for kind in ("page", "bad")) for page in pages):
                    time.sleep(0.01)
                said = " ".join(["read", *((folder / f"{page}.bad").read_text("utf-8") for page in pages if (folder / f"{page}.bad").exists())])
        status = Path(f"/proc/{process.pid}/status")
        lines = status.read_text().splitlines() if status.exists() else []
        return said, next((int(line.split()[1]) / 1024 for line in lines if line.startswith("VmHWM")), 0)
    finally:
        process.kill()
        process.wait()


def refused(place, words, pages=(), most=250):
    said, memory = streamed(place, pages)
    assert words in said, f"{place}: {said}"
    assert memory < most, f"{place}: {memory:.0f} MB"


def copc_file(name, count=3000):
    test_hostile.needs("lazrs")
    path = SCRATCH / name
    records, _ = copc_files.points_of(count)
    return path, copc_files.write_copc(path, records)


def with_tree(path, to, rows, size=None):
    """The file again, with another hierarchy behind it: (key, offset, size, count) each. size: what its head says of it."""
    data = bytearray(path.read_bytes())
    body = b"".join(struct.pack("<4iQii", *key, offset, length, count) for key, offset, length, count in rows)
    struct.pack_into("<2Q", data, 469, len(data), len(body) if size is None else size)
    to.write_bytes(bytes(data) + body)
    return to


def test_good_files():
    path, entries = copc_file("good.copc.laz")
    said, memory = streamed(path, range(len(entries)))
    assert said == "read" and memory < 250, f"{said}, {memory} MB"
    test_hostile.needs("laspy")
    counts = ept_files.write_ept(SCRATCH / "good", copc_files.points_of(3000)[0], split=True, zipped=True)
    assert streamed(SCRATCH / "good/ept.json", range(len(counts)))[0] == "read"


def test_hierarchies_of_copc():
    path, entries = copc_file("tree.copc.laz")
    size = path.stat().st_size
    bad = SCRATCH / "bad.copc.laz"
    pages = np.zeros(1 << 21, copc.ENTRY)
    pages["count"], pages["size"], pages["offset"] = -1, 32, size
    data = bytearray(path.read_bytes())
    struct.pack_into("<2Q", data, 469, size, pages.nbytes)
    bad.write_bytes(bytes(data) + pages.tobytes())
    refused(bad, "more than 10,000 pages")
    wide = [((14, i, 0, 0), size + 32 * (10_100 + i), 32, -1) for i in range(10_100)]
    refused(with_tree(path, bad, wide), "more than 10,000 pages")
    for chain in ([((0, 0, 0, 0), size + 32 * (i + 1), 32, -1) for i in range(100)], [((i + 1, 0, 0, 0), size + 32 * (i + 1), 32, -1) for i in range(100)],
                  [((3, 1, 0, 0), size + 32, 32, -1), ((4, 0, 0, 0), size + 64, 32, -1)]):  # the same cube; too deep; beside
        refused(with_tree(path, bad, chain, 32), "leads to one that is not below it")
    refused(with_tree(path, bad, [((0, 0, 0, 0), size, 32, -1)]), "lies nowhere, or twice")
    refused(with_tree(path, bad, entries, 32 * ((1 << 21) + 1)), "lies nowhere")
    refused(with_tree(path, bad, entries, 32 << 20), "ends before byte")
    many = np.zeros((1 << 21) + 1, copc.ENTRY)
    many["count"], many["size"], many["key"][:, 0], many["key"][:, 1] = 1, 30, 22, np.arange(len(many))
    half = len(many) // 2
    data = bytearray(path.read_bytes())
    last = struct.pack("<4iQii", 1, 0, 0, 0, size + 32 * (half + 1), many[half:].nbytes, -1)
    struct.pack_into("<2Q", data, 469, size, 32 * (half + 1))
    bad.write_bytes(bytes(data) + many[:half].tobytes() + last + many[half:].tobytes())
    refused(bad, "more than 2,097,152 nodes", most=500)
    key, offset, length, count = entries[1]
    refused(with_tree(path, bad, [entries[0], (key, offset, (1 << 31) - 1, 50)]), "a node of 50 points takes 2,147,483,647 bytes")
    refused(with_tree(path, bad, [entries[0], (key, offset, length, 1 << 24)]), "MB of memory; at most 1,074 are taken", pages=[1])


def test_heads_of_copc():
    path, _ = copc_file("head.copc.laz")
    bad = SCRATCH / "bad.copc.laz"
    for offset in (374, 0, 1 << 31):
        data = bytearray(path.read_bytes())
        struct.pack_into("<I", data, 96, offset)
        with open(bad, "wb") as file:
            file.write(data)
            file.truncate(5 << 30)  # which takes no room
        refused(bad, f"points at byte {offset:,} lie nowhere")
    bad.unlink()


def test_large_trees():
    """A second for 300,000 nodes: the parents of all nodes, by arrays; the same as one by one."""
    levels = 7
    keys = np.concatenate([np.stack([np.full(8 ** level, level), *(axis.ravel() for axis in np.indices((1 << level,) * 3))], 1) for level in range(levels)])
    nodes = np.zeros(len(keys), copc.ENTRY)
    nodes["key"], nodes["count"] = keys, 1
    nodes = copc.in_order(nodes[np.random.default_rng(1).random(len(nodes)) < 0.9])
    began = time.process_time()
    parents, cubes, _ = copc.arrange(nodes, np.zeros(3), 1.0, 1.0)
    assert len(nodes) > 250_000 and time.process_time() - began < 3, time.process_time() - began
    places = {tuple(key): index for index, key in enumerate(nodes["key"].tolist())}
    for index in np.random.default_rng(2).integers(0, len(nodes), 2000):
        level, *at = nodes["key"][index].tolist()
        wanted = -1
        while level > 0 and wanted < 0:
            level, at = level - 1, [value >> 1 for value in at]
            wanted = places.get((level, *at), -1)
        assert parents[index] == wanted, f"node {index}: {parents[index]} in place of {wanted}"
    twice = np.concatenate([nodes[:1000], nodes[5:6]])
    try:
        copc.arrange(twice, np.zeros(3), 1.0, 1.0)
    except source.SourceError as error:
        assert "twice" in str(error)
    else:
        raise AssertionError("a node that is there twice was taken")


def ept_folder(name, **options):
    test_hostile.needs("laspy", "lazrs")
    counts = ept_files.write_ept(SCRATCH / name, copc_files.points_of(3000)[0], **options)
    return SCRATCH / name, counts


def test_hierarchies_of_ept():
    folder, counts = ept_folder("hierarchies", zipped=True)
    place = folder / "ept-hierarchy/0-0-0-0.json.gz"
    for count, words in ((33_000_000, "cut, or too large"), (9_000_000, "lists or objects among its numbers")):
        place.write_bytes(gzip.compress(b'{"0-0-0-0":[' + b"[]," * count + b"[]]}", 1))
        refused(folder / "ept.json", words, most=400)
    place.write_bytes(gzip.compress(json.dumps({f"14-{i}-0-0": -1 for i in range(10_100)}).encode()))
    refused(folder / "ept.json", "10,000 pages")
    place.write_bytes(gzip.compress(json.dumps({"0-0-0-0": 1 << 24}).encode()))
    refused(folder / "ept.json", "MB of memory; at most 1,074 are taken")


def test_chains_of_pages():
    """A server whose pages lead to the next one for ever is left after as many as an octree has levels; of a tree that is refused the cache
    holds nothing."""
    folder, _ = ept_folder("chains")
    asked = []

    def page(connection, head):
        depth, *place = map(int, head.split(b" ")[1].decode().rpartition("/")[2].partition(".")[0].split("-"))
        asked.append(depth)
        body = json.dumps({f"{depth + step}-{place[0]}-0-0": -1}).encode()
        connection.sendall(f"HTTP/1.1 200 OK\r\nContent-Length: {len(body)}\r\n\r\n".encode() + body)

    for step, most in ((1, 40), (0, 2)):
        keep = Path(tempfile.mkdtemp(dir=SCRATCH))
        asked.clear()
        with server({"/ept.json": whole(folder / "ept.json"), "*": page}) as port:
            said, _ = streamed(f"http://127.0.0.1:{port}/ept.json", keep={"folder": str(keep), "bytes": 1 << 30})
        assert "not below it" in said or "which was read before" in said, said
        assert 0 < len(asked) <= most, len(asked)
        left = [file for file in keep.rglob("*.kept")]
        assert not left, left[:3]


def test_files_in_folders_of_ept():
    """A file takes as much memory as it has bytes, whatever it may have at the most; a named pipe is no file."""
    folder, _ = ept_folder("memory")
    own = source.FolderSource(str(folder / "ept.json"))
    tracemalloc.start()
    try:
        assert own.file("ept.json") == (folder / "ept.json").read_bytes()
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert peak < 1 << 20, f"{peak:,} bytes for a small file"
    cases = [("ept.json", 5, "is larger than 5 bytes")]
    if os.name != "nt":
        os.mkfifo(folder / "pipe.bin")
        cases.append(("pipe.bin", 5, "is no file"))
    for name, most, words in cases:
        try:
            own.file(name, most)
        except source.SourceError as error:
            assert words in str(error), error
        else:
            raise AssertionError(f"{name} was read")


def test_limits_of_silence():
    """By the artist's settings, not the test's: how long a server that never answers, or answers a byte every three seconds, is waited for."""
    longest = source.TRIES * source.TIMEOUT + source.WAIT * (2 ** (source.TRIES - 1) - 1)
    assert longest < 35, longest
    import web
    assert web.TIMEOUTS * source.TIMEOUT <= 30 and web.PACE / source.TIMEOUT >= 2000


def test_nodes_of_ept():
    """LAZ files whose sizes lie, and one that never ends."""
    folder, counts = ept_folder("nodes")
    path = folder / "ept-data/0-0-0-0.laz"
    good = path.read_bytes()
    offset, = struct.unpack_from("<I", good, 96)
    table, = struct.unpack_from("<q", good, offset)
    for at, words in ((table + 4, "4,294,967,295 chunks"), (offset + 8 + 36 + 4, "announces layers of")):
        data = bytearray(good)
        struct.pack_into("<I", data, at, 0xFFFFFFFF)
        path.write_bytes(bytes(data))
        refused(folder / "ept.json", words)
    path.write_bytes(good)
    with server({"/ept.json": whole(folder / "ept.json"), "/ept-hierarchy/0-0-0-0.json": whole(folder / "ept-hierarchy/0-0-0-0.json"),
                 "*": endless(b"HTTP/1.1 200 OK\r\n\r\n", b"x" * 65536)}) as port:
        refused(f"http://127.0.0.1:{port}/ept.json", "is larger than")


def whole(path):
    data = path.read_bytes()
    return f"HTTP/1.1 200 OK\r\nContent-Length: {len(data)}\r\n\r\n".encode() + data


def test_slow_trees():
    """A chain of pages, each of which comes slowly, ends by the pace of all of them."""
    with mock.patch.multiple(source, TREE_SECONDS=0.1, PAGE_SECONDS=0.0):
        pace = source.Pace(100, 1 << 20)
        pace.add(32)
        time.sleep(0.15)
        try:
            pace.add(32)
        except source.SourceError as error:
            assert "too slow: 2 pages in 0 seconds" in str(error), error
        else:
            raise AssertionError("it goes on")
    pace = source.Pace(100, 1000)
    try:
        pace.add(1001)
    except source.SourceError as error:
        assert "larger than 1,000 bytes" in str(error), error
    else:
        raise AssertionError("more bytes than allowed were taken")


def test_workers_share_memory():
    """One waits for another; who wants more than there is gets a sentence."""
    budget, order = source.Budget(100), []

    def take():
        with budget.of(80):
            order.append("second")

    with budget.of(60):
        thread = threading.Thread(target=take)
        thread.start()
        time.sleep(0.1)
        order.append("first")
    thread.join()
    assert order == ["first", "second"], order
    try:
        with budget.of(101):
            raise AssertionError("it was taken")
    except source.SourceError as error:
        assert "MB of memory" in str(error)


def test_cancel():
    """A stream that waits for a server is closed within 0.2 s, and its process is gone. The best of three, for other programs run too."""
    took = []
    with server({"*": silent}) as port:
        for _ in range(3):
            stream = streaming.Stream(f"http://127.0.0.1:{port}/x.copc.laz")
            steps = stream.steps(lambda: None)
            until = time.monotonic() + 0.7
            while time.monotonic() < until:
                next(steps)
            process = stream._process
            began = time.monotonic()
            stream.close()
            took.append(time.monotonic() - began)
            assert process.poll() is not None
    assert min(took) < 0.2, took


if __name__ == "__main__":
    run_tests(globals(), SCRATCH, test_hostile.SCRATCH)
