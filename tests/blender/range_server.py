# SPDX-License-Identifier: GPL-3.0-or-later
"""A server of one file's ranges on loopback, which does something wrong if asked to: range_server.py FILE [HOW] prints its port and runs until
its input ends. Knows no Blender."""

import http.server
import re
import sys
import threading
import time
from contextlib import suppress
from functools import partial
from pathlib import Path

SLOW = {"slow": 0.02, "slower": 0.1}  # seconds before each answer


class Server(http.server.BaseHTTPRequestHandler):
    """Parts of files, as they are asked for. how: what it does wrong; asked: ranges so far."""

    protocol_version = "HTTP/1.1"

    def __init__(self, path, how, asked, *arguments):
        self._file, self._how, self._asked = path, how, asked
        super().__init__(*arguments)

    def log_message(self, *_):
        pass

    def do_GET(self):
        data, how = Path(self._file).read_bytes(), self._how
        first, last = map(int, re.fullmatch(r"bytes=(\d+)-(\d+)", self.headers["Range"]).groups())
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
        whole = how == "whole"
        self.send_response(200 if whole else 206)
        if how == "garbage" and not head:
            part = bytes(len(part))
        shift = 7 if how == "other" and not head else 0
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
