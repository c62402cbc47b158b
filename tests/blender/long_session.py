# SPDX-License-Identifier: GPL-3.0-or-later
"""A long session in a real window: memory must stay flat, the console clean.

    /usr/bin/python3 tests/blender/long_session.py [--minutes N] [--artist] [--seed N]

Runs session_rounds.py in Blender under Xvfb, looks at the resident memory of the process every second, and draws it. --artist: artist.py in its
place, whose actions follow the seed; handles, threads and temporary files then grow by nothing, either. PATINA_LIBRARY names the library.
"""

import argparse
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path
from statistics import median

HERE = Path(__file__).resolve().parent
LEAST_ROUNDS = 8  # of an artist, two a quarter: of one alone, what a single round takes would count as growth
MOST_GROWTH = 30.0  # MB between the second and the last quarter of a session; one round moves it by some 20
COLUMNS, ROWS = 72, 12

# What a console must not say. Blender's own report of our warnings counts as well; its reports of what it did do not.
BAD = re.compile(r"error|warning|traceback|exception|fail|abort|segmentation|violation|not freed|leak", re.IGNORECASE)

# The artist makes scans soft that have no classes, or not the attribute of a style: a render that says so is right.
GOOD = re.compile(r"Info: |Warning: Patina: 'artist-\S+' has no (classes|(point )?attribute '\w+') to be soft by$|"
                  r"Warning: Patina: 'artist-\S+': its file has no attribute '\w+' to take as scalar$|\d+ passed, 0 failed, 0 skipped$")


def resident(process: int) -> float:
    """MB; 0 when the process has ended."""
    try:
        status = Path(f"/proc/{process}/status").read_text()
    except OSError:
        return 0.0
    found = re.search(r"VmRSS:\s+(\d+) kB", status)
    return int(found[1]) * 1024 / 1e6 if found else 0.0


def plot(samples: list[tuple[float, float]]) -> str:
    """(seconds, MB) as text: the most of each column."""
    last, top = samples[-1][0], max(value for _, value in samples)
    bottom = 0.8 * min(value for _, value in samples)
    columns = [0.0] * COLUMNS
    for when, value in samples:
        at = min(int(when / last * COLUMNS), COLUMNS - 1)
        columns[at] = max(columns[at], value)
    for at in range(1, COLUMNS):
        columns[at] = columns[at] or columns[at - 1]
    lines = []
    for row in range(ROWS, 0, -1):
        level = bottom + (top - bottom) * (row - 0.5) / ROWS
        lines.append(f"{level:6.0f} MB |" + "".join("#" if value >= level else " " for value in columns))
    return "\n".join([*lines, f"{'':10}0{last / 60:>{COLUMNS - 1}.1f} min"])


def growth(samples: list[tuple[float, float]]) -> float:
    """MB between the middles of the second and the last quarter."""
    last = samples[-1][0]
    second, end = ([value for when, value in samples if low <= when / last <= high] for low, high in ((0.25, 0.5), (0.75, 1)))
    return median(end) - median(second)


def held(lines: list[str]) -> list[list[float]]:
    """What the process held after each round of artist.py: MB, handles, threads, files."""
    found = [re.search(r"holds ([\d.]+) MB (\d+) handles (\d+) threads (\d+) files", line) for line in lines]
    return [[float(part) for part in each.groups()] for each in found if each]


def grown_of(rounds: list[list[float]]) -> list[str]:
    """What grew by more than 1 %: the least of the last quarter of the rounds above the most of the second; of memory by more than MOST_GROWTH, too."""
    quarter = max(len(rounds) // 4, 1)
    found = []
    for which, name in enumerate(("memory", "handles", "threads", "files")):
        before, after = max(row[which] for row in rounds[quarter:2 * quarter] or rounds), min(row[which] for row in rounds[-quarter:])
        print(f"{name}: {before:g} at the most in the second quarter, {after:g} at the least in the last")
        if after > 1.01 * before + (MOST_GROWTH if name == "memory" else 0):
            found.append(name)
    return found


def run(minutes: float, artist: bool, seed: int) -> tuple[list[str], list[tuple[float, float]], int]:
    """Console, samples, exit code."""
    command = ["xvfb-run", "-a", "-s", "-screen 0 1280x800x24", "blender", "--factory-startup", "--python",
               str(HERE / "test_window.py"), "--", "artist" if artist else "long_session"]
    own = tempfile.mkdtemp(prefix="patina-session-")
    environment = {**os.environ, "TMPDIR": own, "PATINA_SESSION_MINUTES": str(minutes), "PATINA_SESSION_SEED": str(seed)}
    blender = subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                               errors="replace", start_new_session=True)
    lines: list[str] = []

    def read() -> None:
        for line in blender.stdout:
            lines.append(line.rstrip("\n"))
            print(f"{time.monotonic() - start:7.1f} s  {lines[-1]}", flush=True)

    start = time.monotonic()
    reader = threading.Thread(target=read, daemon=True)
    reader.start()
    samples, process = [], 0
    while blender.poll() is None:
        time.sleep(1.0)
        if time.monotonic() - start > 90.0 * minutes + 180.0:
            lines.append("session: an error: it did not come to its end")
            os.killpg(blender.pid, signal.SIGKILL)
            break
        if not process:
            process = next((int(line.split()[-1]) for line in list(lines) if line.startswith("session: process")), 0)
        value = resident(process) if process else 0.0
        if value:
            samples.append((time.monotonic() - start, value))
    reader.join()
    shutil.rmtree(own, ignore_errors=True)
    return lines, samples, blender.wait()


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--minutes", type=float, default=1.0)
    parser.add_argument("--artist", action="store_true")
    parser.add_argument("--seed", type=int, default=49)
    options = parser.parse_args()
    lines, samples, code = run(options.minutes, options.artist, options.seed)
    rounds = sum(line.startswith("session: round") for line in lines)
    said = [line for line in lines if BAD.search(line) and not GOOD.match(line)]
    if len(samples) < 8:
        print("\n".join(lines[-20:]))
        print("0 passed, 1 failed, 0 skipped")
        return 1
    grown = growth(samples)
    print(plot(samples))
    print(f"{rounds} rounds in {samples[-1][0] / 60:.1f} minutes, memory {grown:+.1f} MB from the second quarter to the last, "
          f"{max(value for _, value in samples):.0f} MB at the most; {len(lines)} lines on the console, {len(said)} of them bad")
    print("\n".join(said[:20]))
    few = options.artist and rounds < LEAST_ROUNDS
    more = grown_of(held(lines)) if options.artist and not few else []
    failed = more + [name for name, bad in (("session", code != 0), ("console", bool(said)), ("growth", grown > MOST_GROWTH)) if bad]
    for name in failed:
        print(f"FAIL {name}")
    if few:
        print(f"skip growth after rounds: {rounds} of them are too few to tell, {LEAST_ROUNDS} are needed")
    print(f"{(7 if options.artist and not few else 3) - len(failed)} passed, {len(failed)} failed, {4 if few else 0} skipped")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
