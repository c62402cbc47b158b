# SPDX-License-Identifier: GPL-3.0-or-later
"""All that a machine with a graphics processor is borrowed for, the most important first, within a given time. build/carry packs it
with the programs that it runs; there:

    ./carried/run [--seconds 300] [--out FOLDER] [--small] [--device NAME] [PART...]

Parts, in order: first (one frame's passes, one image on both devices), kernels (each against the reference and the processor), images
(the same of whole frames), frames (1, 10, 100 million points in three sizes; layers, shadows, discs, soft points, range images), threads
(the processor from one thread to all), rest (hard input, other scenes), large (a billion points, or as many as memory holds).

Three files go into FOLDER (carried/out): bench.json, which `build/bench --from` reads; report.txt; logs.tar.gz, what the programs said. They are written
after each row and each part, so a run that is cut off keeps what it has. --small: a thousandth of the points and a quarter of the width:
to try it."""

from __future__ import annotations

import argparse
import datetime
import json
import os
import subprocess
import sys
import tarfile
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

sys.path[:0] = [str(Path(__file__).resolve().parents[2] / "addon"), str(Path(__file__).resolve().parent)]

import gpu  # noqa: E402
import machine  # noqa: E402
import rows as kept  # noqa: E402

import native  # noqa: E402

ROOT = Path(__file__).resolve().parents[2]
BUILD = ROOT / "build/out/release"
LOGS = ROOT / "logs"
SHARES = {"first": 0.15, "kernels": 0.2, "images": 0.2, "frames": 0.4, "threads": 0.15, "rest": 0.25, "large": 1.0}  # of all time, at most
BYTES_A_POINT = 120  # while a bare cloud of a billion is made
IMAGES = ("test_parity", "test_frame", "test_transparency", "test_shadow", "test_soft", "test_ranges", "test_disc_layers", "test_effects")
BEHIND = 5.0  # seconds that a program which was told to end in time has beyond


@dataclass
class Run:
    """One run: when it ends, what it found, where that goes."""

    options: argparse.Namespace
    end: float
    result: dict[str, Any]
    lines: list[str] = field(default_factory=list)

    def left(self, part: str) -> float:
        return min(self.end - time.monotonic(), SHARES[part] * self.options.seconds)

    def say(self, line: str) -> None:
        self.lines.append(f"{self.options.seconds - (self.end - time.monotonic()):6.1f} s  {line}")
        print(self.lines[-1], flush=True)
        self.write()

    def write(self) -> None:
        out = self.options.out
        kept.write(self.result, out)
        text = "\n".join(self.lines) + "\n\n" + gpu.markdown(self.result) + "\n"
        partial = out / "report.txt.part"
        partial.write_text(text)
        partial.replace(out / "report.txt")


# ---- rows ----------------------------------------------------------------------------------------------------------------------------


def _say_row(run: Run, row: dict[str, Any]) -> None:
    kept.add(run.result, row)
    if "unavailable" in row:
        run.say(f"not measured: {row['scene']}, {row['mode']}, {row['points']:,} points: {row['unavailable']}")
        return
    threads = f", {row['threads']} threads" if row["threads"] else ""
    same = "" if "same" not in row else ", same as cpu" if row["same"] else (
        f", DIFFERS from cpu: {row['keys_differ']} keys, colors by {row['colors_differ']:.1e}")
    counts = ", ".join(f"{row['gl'][name]} {name}" for name in gpu.COUNTS) if "gl" in row else ""
    run.say(f"{row['group']}: {row['device']}{threads}, {row['points']:,} points, {row['width']} x {row['height']}, {row['what']}: "
            f"{row['ms_median']:.2f} ms ({row['ms_min']:.2f} to {row['ms_max']:.2f}){same}{', ' * bool(counts)}{counts}")


def _measure(run: Run, seconds: float, points: int, *words: str, sizes: tuple[str, ...] = ()) -> None:
    """Rows of gpu.py, as they come; it is ended where it takes longer than it may."""
    if seconds < 2.0:
        run.say(f"no time for {points:,} points")
        return
    if run.options.small:
        points, sizes = max(points // 1000, 1000), tuple("x".join(str(int(side) // 4) for side in size.split("x")) for size in sizes)
    log = LOGS / "gpu.log"
    command = [sys.executable, str(ROOT / "tests/bench/gpu.py"), str(points), "--device", run.options.device, "--seconds", f"{seconds - 1.0:.0f}",
               *words, *(word for size in sizes for word in ("--size", size))]
    with log.open("a") as said, subprocess.Popen(command, stdout=subprocess.PIPE, stderr=said, text=True) as process:
        with ThreadPoolExecutor(1) as watch:
            watch.submit(_end_late, process, seconds + BEHIND)
            for line in process.stdout:
                if line.startswith("{"):
                    _say_row(run, json.loads(line))
    if process.returncode:
        run.say(f"gpu.py {points} {' '.join(words)} ended with {process.returncode}: {log.read_text()[-300:].strip()}")


def _end_late(process: subprocess.Popen[str], seconds: float) -> None:
    try:
        process.wait(seconds)
    except subprocess.TimeoutExpired:
        process.kill()


# ---- programs ------------------------------------------------------------------------------------------------------------------------


def _program(run: Run, program: Path, end: float) -> tuple[str, int | None]:
    """Its name, and how it ended; None: there was no time for it, or not enough."""
    name = f"{program.parent.name}-{program.name}"
    seconds = end - time.monotonic()
    if seconds < 1.0:
        return name, None
    with (LOGS / f"{name}.log").open("w") as log:
        try:
            devices = ["--device", "cpu", "--device", run.options.device] if program.parent.name != "hard" else []
            return name, subprocess.run([str(program), *devices], stdout=log, stderr=subprocess.STDOUT, timeout=seconds, check=False).returncode
        except (subprocess.TimeoutExpired, OSError):
            return name, None


def _sum(text: str, word: str) -> int:
    """Of a log of cmocka: "[  PASSED  ] 5 test(s)."."""
    words = [line.split() for line in text.splitlines() if line.startswith(f"[  {word}")]
    return sum(int(some[3]) for some in words if len(some) > 4 and some[3].isdigit() and some[4].startswith("test"))


def _programs(run: Run, part: str, programs: list[Path]) -> None:
    """All of them, so many at a time as there are cores."""
    if run.options.small:
        programs = programs[:3]
    end = time.monotonic() + run.left(part)
    with ThreadPoolExecutor(machine.cores()) as pool:
        ended = list(pool.map(lambda program: _program(run, program, end), programs))
    logs = {name: LOGS / f"{name}.log" for name, _ in ended}
    texts = {name: log.read_text(errors="replace") if log.is_file() else "" for name, log in logs.items()}
    sums = {word: sum(_sum(text, word) for text in texts.values()) for word in ("PASSED", "FAILED", "SKIPPED")}
    late = [name for name, code in ended if code is None]
    failed = {name: code for name, code in ended if code}
    run.result["parts"][part] = {"title": part.capitalize(), "text": f"{sums['PASSED']} passed, {sums['FAILED']} failed, {sums['SKIPPED']} skipped."}
    run.say(f"{part}: {len(ended)} programs, {sums['PASSED']} tests passed, {sums['FAILED']} failed, {sums['SKIPPED']} skipped; "
            f"no time for {len(late)}{': ' * bool(late)}{', '.join(late)}")
    for name, code in failed.items():
        why = [line for line in texts[name].splitlines() if "ERROR" in line or "FAILED" in line or " key at " in line or "differ" in line]
        run.say(f"FAILED {name} (exit {code}): {' / '.join(why[:3])[:400]}")


def _tests(folder: str) -> list[Path]:
    return sorted((BUILD / "tests" / folder).glob("test_*"))


# ---- parts ---------------------------------------------------------------------------------------------------------------------------


def first(run: Run) -> None:
    run.result["gpu_bandwidth"] = gpu.bandwidth(run.options.device, BUILD, 16 if run.options.small else 1024)
    run.say(f"{run.options.device} writes {run.result['gpu_bandwidth']:.0f} GB/s")
    _measure(run, run.left("first"), 1_000_000, sizes=("1024x1024",))


def kernels(run: Run) -> None:
    _programs(run, "kernels", _tests("kernels"))


def images(run: Run) -> None:
    _programs(run, "images", [program for name in IMAGES for program in _tests("scenes") if program.name == name])


def frames(run: Run) -> None:
    sizes, until = tuple(gpu.SIZES), time.monotonic() + run.left("frames")
    for points, whats, share in ((1_000_000, gpu.WHATS, 0.4), (10_000_000, ("surface",), 0.4), (100_000_000, ("surface",), 1.0)):
        _measure(run, share * (until - time.monotonic()), points, *(word for what in whats for word in ("--what", what)), sizes=sizes)


def threads(run: Run) -> None:
    until = time.monotonic() + run.left("threads")
    _measure(run, 0.75 * (until - time.monotonic()), 10_000_000, "--threads", "--frames", "5", sizes=("1024x1024", "4096x4096"))
    _measure(run, until - time.monotonic(), 1_000_000, "--threads", "--frames", "7", sizes=("1024x1024",))


def rest(run: Run) -> None:
    others = [program for program in _tests("scenes") if program.name not in IMAGES and program.name not in ("test_builder", "test_pages", "test_lost")]  # of files
    _programs(run, "rest", [*_tests("hard"), *others])


def large(run: Run) -> None:
    points = min(1_000_000_000, int(machine.memory_free() * 2**20 / BYTES_A_POINT) // 100_000_000 * 100_000_000)
    seconds = run.left("large")
    if seconds < 60.0 and not run.options.small:
        run.say(f"no time for {points:,} points: {seconds:.0f} s are left")
    elif points <= 100_000_000:
        run.say("memory holds no more than 100 million points")
    else:
        _measure(run, seconds, points, "--frames", "5", sizes=("1024x1024", "4096x4096"))


PARTS = {part.__name__: part for part in (first, kernels, images, frames, threads, rest, large)}


def pack(run: Run) -> None:
    partial = run.options.out / "logs.tar.gz.part"
    with tarfile.open(partial, "w:gz") as archive:
        archive.add(LOGS, "logs")
    partial.replace(run.options.out / "logs.tar.gz")


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("parts", nargs="*", choices=[*PARTS, []], help="these alone; default: all")
    parser.add_argument("--seconds", type=float, default=300.0)
    parser.add_argument("--out", type=Path, default=ROOT / "out")
    parser.add_argument("--device", default="gl-egl")
    parser.add_argument("--small", action="store_true")
    options = parser.parse_args()
    LOGS.mkdir(parents=True, exist_ok=True)
    options.out.mkdir(parents=True, exist_ok=True)
    run = Run(options, time.monotonic() + options.seconds, kept.begin(native.library().patina_version().decode()))
    run.result["carried"] = {"date": datetime.datetime.now(datetime.timezone.utc).isoformat(timespec="seconds"), "seconds": options.seconds}
    run.say(f"{run.result['processor']}, {run.result['cores']} cores, {machine.memory_free() / 1024:.0f} GB free, a copy moves "
            f"{run.result['bandwidth']:.0f} GB/s; Patina {run.result['version']}")
    for name, part in PARTS.items():
        if options.parts and name not in options.parts:
            continue
        try:
            part(run)
        except Exception as error:  # what one part meets says nothing of the others
            run.say(f"{name} ended early: {type(error).__name__}: {error}")
        pack(run)
    run.say("done")
    return 0


if __name__ == "__main__":
    os.environ.setdefault("PATINA_LIBRARY", str(BUILD / "libpatina.so"))
    sys.exit(main())
