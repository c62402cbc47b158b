# SPDX-License-Identifier: GPL-3.0-or-later
"""A server of one file's ranges, or of a folder's files, on loopback, which does something wrong if asked to: range_server.py FILE [HOW]
prints its port and runs until its input ends. Knows no Blender."""

import email.utils
import hashlib
import http.server
import re
import sys
import threading
import time
from contextlib import suppress
from functools import partial
from pathlib import Path

SLOW = {"slow": 0.02, "slower": 0.1}  # seconds before each answer


NOTHING = (0, -1)  # among what was asked for: it is as the asker knows it


class Server(http.server.BaseHTTPRequestHandler):
    """Parts of files, as they are asked for. how: what it does wrong, or what it tells of a file's state; asked: ranges so far, (first, last)."""

    protocol_version = "HTTP/1.1"

    def __init__(self, path, how, asked, *arguments):
        self._file, self._how, self._asked = path, how, asked
        super().__init__(*arguments)

    def log_message(self, *_):
        pass

    def _state(self, path, data):
        if self._how == "etag":
            return {"ETag": f'"{hashlib.blake2b(data, digest_size=8).hexdigest()}"'}
        return {"Last-Modified": email.utils.formatdate(path.stat().st_mtime, usegmt=True)} if self._how == "dated" else {}

    def do_GET(self):
        path, how = Path(self._file), self._how
        path = path / self.path.partition("?")[0].lstrip("/") if path.is_dir() else path
        if not path.is_file():
            self.send_error(404)
            return
        data = path.read_bytes()
        told = self._state(path, data)
        if told and (self.headers["If-None-Match"] or self.headers["If-Modified-Since"]) in told.values():
            self._asked.append(NOTHING)
            self.send_response(304)
            self.end_headers()
            return
        parts = re.fullmatch(r"bytes=(\d+)-(\d+)", self.headers["Range"] or "")
        first, last = map(int, parts.groups()) if parts else (0, len(data) - 1)
        self._asked.append((first, last))
        new = self._asked.count((first, last)) == 1
        part, head = data[first:last + 1], len(self._asked) <= 4  # the octree comes as it should
        if how in SLOW or how == "hangs" and not head:
            time.sleep(SLOW.get(how, 30))
        if how == "refuses":
            self.send_error(404)
            return
        if how == "busy" and new:
            self.send_error(503)
            return
        whole = how == "whole" or not parts
        self.send_response(200 if whole else 206)
        if how == "garbage" and not head:
            part = bytes(len(part))
        shift = 7 if how == "other" and not head else 0
        for name, value in told.items():
            self.send_header(name, value)
        if parts:
            self.send_header("Content-Range", f"bytes {first + shift}-{last + shift}/{len(data)}")
        self.send_header("Content-Length", str(len(data) if whole else len(part)))
        self.end_headers()
        if how == "cut" and not head:
            self.wfile.write(part[:len(part) // 2])
            self.close_connection = True
            return
        if how == "flaky" and new:
            self.close_connection = True
            return
        with suppress(ConnectionError):  # nobody waits for the rest
            self.wfile.write(data if whole else part)


def main():
    running = http.server.ThreadingHTTPServer(("127.0.0.1", 0), partial(Server, sys.argv[1], sys.argv[2] if len(sys.argv) > 2 else "", []))
    running.daemon_threads = True
    threading.Thread(target=running.serve_forever, daemon=True).start()
    print(running.server_address[1], flush=True)
    sys.stdin.read()


if __name__ == "__main__":
    main()
