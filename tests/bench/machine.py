# SPDX-License-Identifier: GPL-3.0-or-later
"""What the machine is and how fast its memory: the floor that times are held against."""

from __future__ import annotations

import os
import threading
import time
from pathlib import Path

import numpy as np


def processor() -> str:
    try:
        for line in Path("/proc/cpuinfo").read_text().splitlines():
            if line.startswith("model name"):
                return line.split(":", 1)[1].strip()
    except OSError:
        pass
    return "unknown processor"


def cores() -> int:
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def copy_bandwidth(threads: int, megabytes: int = 64, runs: int = 15) -> float:
    """GB/s of a plain copy (numpy.copyto, which releases the GIL), bytes read and written counted; best of runs."""
    pairs = [(np.zeros(megabytes << 18, np.float32), np.ones(megabytes << 18, np.float32)) for _ in range(threads)]
    best = 0.0
    for _ in range(runs):
        gate = threading.Barrier(threads + 1)

        def work(target: np.ndarray, source: np.ndarray) -> None:
            gate.wait()
            np.copyto(target, source)
            gate.wait()

        workers = [threading.Thread(target=work, args=pair) for pair in pairs]
        for worker in workers:
            worker.start()
        gate.wait()
        start = time.perf_counter()
        gate.wait()
        seconds = time.perf_counter() - start
        for worker in workers:
            worker.join()
        best = max(best, 2.0 * threads * (megabytes << 20) / seconds / 1e9)
    return best


def memory_now() -> float:
    """Resident MB of this process."""
    return _status("VmRSS")


def memory_peak() -> float:
    """Highest resident MB since the start or reset_peak()."""
    return _status("VmHWM")


def reset_peak() -> None:
    try:
        Path("/proc/self/clear_refs").write_text("5")
    except OSError:
        pass  # the peak then counts from the start


def _status(name: str) -> float:
    try:
        for line in Path("/proc/self/status").read_text().splitlines():
            if line.startswith(name + ":"):
                return int(line.split()[1]) / 1024.0
    except OSError:
        pass
    return 0.0


def memory_free() -> float:
    """MB that programs may still take; plenty where the system does not tell."""
    try:
        for line in Path("/proc/meminfo").read_text().splitlines():
            if line.startswith("MemAvailable:"):
                return int(line.split()[1]) / 1024.0
    except OSError:
        pass
    return float("inf")
