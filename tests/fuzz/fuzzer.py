# SPDX-License-Identifier: GPL-3.0-or-later
"""Tries changed inputs on readers. A reader may give a result or one of its own errors, soon and in little memory. All else is a failure,
whose input is kept.

    SCRIPT [--seconds S] [--runs N] [--seed N] [--keep FOLDER] [READER ...]

Before that, it tries the inputs of tests/fuzz/corpus/READER as they are: those that failed once.
"""

from __future__ import annotations

import argparse
import contextlib
import hashlib
import io
import os
import random
import resource
import signal
import sys
import time
import traceback
import unicodedata
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

CORPUS = Path(__file__).resolve().parent / "corpus"
SECONDS = 5.0  # of a processor, that an input may take
WAIT = 60  # seconds after which an input is ended
MEMORY = 6 << 30  # bytes of addresses that the process may take
os.environ["PATINA_POISON_PLANES"] = "1"  # of all devices of this process and of those that it starts: who reads what no pass wrote draws noise, or ends


@dataclass
class Reader:
    seeds: Callable[[], list[bytes]]
    change: Callable[[bytes, random.Random, list[bytes]], bytes]
    read: Callable[[bytes], object]
    errors: tuple[type[BaseException], ...]
    weight: float = 1.0  # share of the runs, for those that start a process for each input
    needs: Callable[[], None] = lambda: None  # raises where something is missing


@dataclass
class Count:
    tried: int = 0
    refused: int = 0
    said: str = ""  # by the last that was
    failed: list[str] = field(default_factory=list)


class Late(BaseException):
    pass


class Refused(Exception):
    """What a reader raises that has no error of its own."""


def controls(text: str) -> bool:
    """Whether text has control characters, which a terminal may obey, or halves of characters."""
    return any(unicodedata.category(letter) in {"Cc", "Cs"} and letter not in "\n\t" for letter in text)


def _late(_signal: int, _frame: object) -> None:
    raise Late


def attempt(reader: Reader, data: bytes, count: Count) -> str:
    """Why it failed; "": it did not."""
    count.tried += 1
    began = time.process_time()
    signal.alarm(WAIT)
    try:
        with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
            reader.read(data)
    except reader.errors as error:
        count.refused, count.said = count.refused + 1, str(error)[:200]
        if not str(error).strip():
            return f"{type(error).__name__} without a sentence"
        if controls(str(error)):
            return f"control characters in {str(error)[:200]!r}"
        if len(str(error)) > 5000:
            return f"a sentence of {len(str(error)):,} letters"
    except Late:
        return f"took longer than {WAIT} s"
    except Exception as error:
        where = traceback.extract_tb(error.__traceback__)[-1]
        return f"{type(error).__name__}: {str(error)[:200]} ({Path(where.filename).name}:{where.lineno})"
    finally:
        signal.alarm(0)
    took = time.process_time() - began
    return f"took {took:.1f} s of a processor" if took > SECONDS else ""


def fuzz(name: str, reader: Reader, runs: int, seconds: float, seed: int, keep: Path | None) -> Count:
    """runs: inputs at most, beside the seeds and the corpus."""
    count, chance = Count(), random.Random(f"{name} {seed}")
    seeds = reader.seeds()
    kept = [path.read_bytes() for path in sorted((CORPUS / name).glob("*"))] if (CORPUS / name).is_dir() else []
    for data in seeds:
        why = attempt(reader, data, count)
        if why or count.refused:
            count.failed.append(f"a good input: {why or f'was refused: {count.said}'}")
            return count
    known: set[str] = set()
    until = time.monotonic() + seconds if seconds else float("inf")
    done = 0
    waiting = list(kept)
    while waiting or done < runs and time.monotonic() < until:
        if waiting:
            data = waiting.pop(0)
        else:
            data = reader.change(chance.choice([*seeds, *kept]), chance, seeds)
            done += 1
        why = attempt(reader, data, count)
        kind = why.partition("(")[2] or why[:40]
        if why and kind not in known:
            known.add(kind)
            count.failed.append(why)
            print(f"FAIL {name}: {why}", flush=True)
            if keep:
                (keep / name).mkdir(parents=True, exist_ok=True)
                (keep / name / hashlib.sha1(data).hexdigest()[:12]).write_bytes(data)
    return count


def main(readers: dict[str, Reader], arguments: list[str]) -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=0.0, help="of each reader; 0: as long as its runs take")
    parser.add_argument("--runs", type=int, default=0, help="changed inputs of each reader; 0 with --seconds: any number")
    parser.add_argument("--seed", type=int, default=49)
    parser.add_argument("--keep", type=Path, help="a folder for inputs that fail")
    parser.add_argument("readers", nargs="*", choices=[*readers, []], metavar="READER")
    options = parser.parse_args(arguments)
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, resource.getrlimit(resource.RLIMIT_AS)[1]))
    signal.signal(signal.SIGALRM, _late)
    passed = failed = skipped = 0
    for name, reader in readers.items():
        if options.readers and name not in options.readers:
            continue
        try:
            reader.needs()
        except Exception as reason:
            skipped += 1
            print(f"skip fuzz/{name}: {reason}", flush=True)
            continue
        runs = max(1, int(options.runs * reader.weight)) if options.runs else 1 << 60 if options.seconds else 0
        began = time.monotonic()
        count = fuzz(name, reader, runs, options.seconds, options.seed, options.keep)
        passed, failed = passed + (not count.failed), failed + bool(count.failed)
        print(f"{'FAIL' if count.failed else 'ok'} fuzz/{name}: {count.tried:,} inputs, {count.refused:,} refused, "
              f"{len(count.failed)} kinds of failures{''.join(f'; {why}' for why in count.failed[:3])} ({time.monotonic() - began:.0f} s)", flush=True)
    print(f"{passed} passed, {failed} failed, {skipped} skipped", flush=True)
    sys.stdout.flush()
    return int(failed > 0 or not passed)
