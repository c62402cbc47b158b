#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""One task of a job, on one machine: task.py check | convert N | frame N | tile N | part N [--round R] | merge [--round R].

Lies in the job's folder, beside job.json. Before it begins it looks whether program, version and files are those of the job. What it makes is there whole or
not at all, with the same bytes wherever and however often it runs. Ends with 0, or says why not and ends with 1; as the program ended where that was killed.
PATINA_PROGRAM and PATINA_BLENDER name other programs than the job does. Python's own library only, from 3.8 on."""
import hashlib
import json
import os
import shutil
import socket
import stat
import subprocess
import sys
import time
from pathlib import Path

FOLDER = Path(__file__).resolve().parent
ENDS = 1 << 20  # bytes at either end of a file that tell whether it is the job's
LARGEST = 64 << 20  # bytes of a job.json
AGAIN = 3  # patina merge: another round is wanted
WRONG = 1
MOST = 1_000_000  # tasks
MOST_LETTERS = 4096  # of a name, a path or an argument
WRITES = {"-o", "--output", "--dump-planes", "--save-shadows"}  # options of patina render


class Wrong(Exception):
    pass


def look_of(path: Path) -> list:
    """Size and a sum of both ends of a file: enough to tell that a path leads to another one, and quick on a shared disk."""
    with path.open("rb") as file:
        size = os.fstat(file.fileno()).st_size
        digest = hashlib.blake2b(file.read(ENDS), digest_size=8)
        if size > ENDS:
            file.seek(max(ENDS, size - ENDS))
            digest.update(file.read(ENDS))
    return [size, digest.hexdigest()]


def read_job() -> dict:
    path = FOLDER / "job.json"
    try:
        if not stat.S_ISREG(path.stat().st_mode) or path.stat().st_size > LARGEST:
            raise Wrong(f"{path} is no file, or larger than any job")
        job = json.loads(path.read_text("utf-8"))
    except OSError as error:
        raise Wrong(f"{FOLDER}/job.json cannot be read: {error.strerror}") from error
    except ValueError as error:
        raise Wrong(f"{FOLDER}/job.json is damaged: {error}") from error
    except RecursionError:
        raise Wrong(f"{FOLDER}/job.json is damaged: lists in lists") from None
    if not isinstance(job, dict) or job.get("patina_job") != 1:
        raise Wrong(f"{FOLDER}/job.json is of another version")
    wrong = wrong_of(job)
    if wrong:
        raise Wrong(f"{FOLDER}/job.json is damaged: {wrong}")
    return job


def _is_text(value: object) -> bool:
    """One line without control characters: it becomes a part of scripts, logs and paths."""
    return isinstance(value, str) and len(value) <= MOST_LETTERS and not any(
        ord(letter) < 32 or 127 <= ord(letter) < 160 or 0xD800 <= ord(letter) < 0xE000 or letter in "\u2028\u2029" for letter in value)


def _are(kind: object, values: object, count: int = -1) -> bool:
    return isinstance(values, list) and all(kind(value) for value in values) and count in (-1, len(values))


def _is_count(value: object) -> bool:
    return type(value) is int and 1 <= value <= MOST


def _is_frame(value: object) -> bool:
    return type(value) is int and abs(value) <= 1 << 30


def _are_arguments(values: object) -> bool:
    """Of patina render, which draw and write nothing: where the image goes, the task says."""
    return _are(lambda word: _is_text(word) and word.split("=")[0] not in WRITES, values)


def _are_files(files: object) -> bool:
    return isinstance(files, dict) and all(_is_text(name) and _are(lambda part: isinstance(part, (int, str)), look, 2) for name, look in files.items())


def _is_converted(pair: object) -> bool:
    """Clouds are built within the job's folder."""
    return _are(_is_text, pair, 2) and pair[1].endswith(".cloud") and FOLDER in Path(os.path.abspath(FOLDER / pair[1])).parents


def wrong_of(job: dict) -> str:
    """What of a job's file is not as job.py writes it; "": nothing. Its content may be a stranger's: it must not become commands, nor
    make programs write anywhere but to the output."""
    rules = {"name": _is_text, "kind": lambda kind: kind in ("frames", "tiles", "parts"), "by": lambda by: by in ("patina", "blender"),
             "program": _is_text, "version": _is_text, "directory": _is_text, "files": _are_files, "rounds": _is_count,
             "output": lambda path: _is_text(path) and not Path(path).name.startswith(".")}
    if "convert" in job:
        rules["convert"] = lambda pairs: _are(_is_converted, pairs)
    if job.get("kind") == "frames":
        rules["frames"] = lambda frames: _are(_is_frame, frames) and 0 < len(frames) <= MOST
    elif job.get("kind") == "tiles":
        rules["tiles"] = lambda tiles: _are(_is_count, tiles, 2) and tiles[0] * tiles[1] <= MOST
    else:
        rules["parts"] = _is_count
    if job.get("by") == "patina":
        rules["arguments"] = _are_arguments
        if job.get("kind") == "frames":
            rules["options"] = lambda lines: _are(_are_arguments, lines, len(job["frames"]) if isinstance(job.get("frames"), list) else -1)
    return next((f"'{name}' is missing, or is not as jobs have it" for name, rule in rules.items() if not rule(job.get(name))), "")


def program_of(job: dict) -> str:
    named = os.environ.get("PATINA_BLENDER" if job["by"] == "blender" else "PATINA_PROGRAM") or job["program"]
    found = shutil.which(named)
    if not found:
        raise Wrong(f"'{named}' is not there, or no program; {'PATINA_BLENDER' if job['by'] == 'blender' else 'PATINA_PROGRAM'} names another")
    return found


def version_of(program: str) -> str:
    done = subprocess.run([program, "--version"], capture_output=True, text=True, check=False)
    if done.returncode:
        raise Wrong(f"'{program}' does not run here: {(done.stderr or done.stdout).strip()[:300] or f'it ends with {done.returncode}'}")
    return done.stdout.splitlines()[0].strip() if done.stdout.strip() else ""


def check(job: dict) -> None:
    version = version_of(program_of(job))
    if version != job["version"]:
        raise Wrong(f"the job was made for {job['version']}; here is {version}")
    if not Path(job["directory"]).is_dir():
        raise Wrong(f"the folder {job['directory']} is not there")
    for name, expected in job["files"].items():
        path = Path(job["directory"], name)
        try:
            found = look_of(path)
        except OSError as error:
            raise Wrong(f"{path} cannot be read: {error.strerror}") from error
        if found != expected:
            raise Wrong(f"{path} is not the file that the job was made with")


def run(job: dict, *arguments: object, allowed: tuple = (0,)) -> int:
    command = [program_of(job), *map(str, arguments)]
    print("patina job:", " ".join(command), flush=True)
    code = subprocess.run(command, cwd=job["directory"], check=False).returncode
    if code < 0 or code >= 128:  # killed: whoever runs the farm may try again
        say(f"the program was killed, by signal {-code if code < 0 else code - 128}")
        sys.exit(128 - code if code < 0 else code)
    if code not in allowed:
        raise Wrong(f"the program ended with {code}: see above")
    return code


def say(text: str) -> None:
    print(f"patina job: {text}", file=sys.stderr, flush=True)


def need(path: Path, task: str) -> Path:
    if not path.is_file():
        raise Wrong(f"{path} is missing: {task} has not run, or failed; see its log")
    return path


# ---- where things go -------------------------------------------------------------------------------------------------


def output_of(job: dict) -> Path:
    return Path(job["directory"], job["output"])


def frame_path(job: dict, frame: int) -> Path:
    """The name's last # are the frame's number, as Blender has it; none: it stands before the ending."""
    path = output_of(job)
    name = path.name if "#" in path.name else f"{path.stem}####{path.suffix}"
    end = name.rindex("#") + 1
    start = end - (len(name[:end]) - len(name[:end].rstrip("#")))
    return path.with_name(f"{name[:start]}{frame:0{end - start}d}{name[end:]}")


def tile_path(job: dict, tile: int) -> Path:
    return FOLDER / "tiles" / f"{tile:05d}{'.exr' if job['by'] == 'blender' else '.png'}"


def part_path(part: int, turn: int) -> Path:
    return FOLDER / "parts" / f"round{turn}-{part:05d}.keys"


def told_path(turn: int) -> Path:
    return FOLDER / "parts" / f"round{turn}.next"


def finished_path() -> Path:
    return FOLDER / "parts" / "finished"


# ---- tasks -----------------------------------------------------------------------------------------------------------


def in_blender(job: dict, *arguments: object) -> None:
    run(job, "-b", FOLDER / "scene.blend", "--python-exit-code", WRONG, "--python", FOLDER / "in_blender.py", "--", *arguments,
        "--patina-strict")  # a picture that lacks a cloud is none


def convert(job: dict, number: int) -> None:
    pairs = job.get("convert", [])
    if not 1 <= number <= len(pairs):
        raise Wrong(f"the job converts {len(pairs)} files")
    source, target = pairs[number - 1]
    Path(job["directory"], target).parent.mkdir(parents=True, exist_ok=True)
    run(job, "convert", source, target)


def frame(job: dict, number: int) -> None:
    if number not in job["frames"]:
        raise Wrong(f"the job has no frame {number}")
    path = frame_path(job, number)
    path.parent.mkdir(parents=True, exist_ok=True)
    if job["by"] == "blender":
        in_blender(job, "frame", number, path)
    else:
        run(job, "render", *job["arguments"], *job["options"][job["frames"].index(number)], "-o", path)


def tile(job: dict, number: int) -> None:
    columns, rows = job["tiles"]
    if not 1 <= number <= columns * rows:
        raise Wrong(f"the job has {columns} x {rows} tiles")
    path = tile_path(job, number)
    path.parent.mkdir(parents=True, exist_ok=True)
    if job["by"] == "blender":
        in_blender(job, "tile", number, columns, rows, path)
    else:
        run(job, "render", *job["arguments"], "--tiles", f"{columns}x{rows}", "--tile", number, "-o", path)


def part(job: dict, number: int, turn: int) -> None:
    if not 1 <= number <= job["parts"]:
        raise Wrong(f"the job has {job['parts']} parts")
    if turn > 1 and finished_path().is_file():
        print(f"patina job: nothing is left for round {turn}: the picture is done", flush=True)
        return
    behind = ["--behind", need(told_path(turn), f"merge --round {turn - 1}")] if turn > 1 else []
    path = part_path(number, turn)
    path.parent.mkdir(parents=True, exist_ok=True)
    run(job, "scatter", *job["arguments"], "--part", f"{number}/{job['parts']}", *behind, "-o", path)


def merge_parts(job: dict, turn: int) -> None:
    if turn > 1 and finished_path().is_file():
        print(f"patina job: nothing is left for round {turn}: the picture is done", flush=True)
        return
    keys = [need(part_path(number, before), f"part {number} of {job['parts']}{f' --round {before}' if before > 1 else ''}")
            for before in range(1, turn + 1) for number in range(1, job["parts"] + 1)]
    if turn == 1:
        finished_path().unlink(missing_ok=True)
    code = run(job, "merge", *keys, "-o", output_of(job), "--next", told_path(turn + 1), allowed=(0, AGAIN))
    if code == 0:
        finished_path().write_text("", encoding="ascii")
    elif turn >= job["rounds"]:
        raise Wrong(f"the picture has more layers than the job has rounds, {job['rounds']}: make it anew with --rounds {2 * job['rounds']}")


def merge(job: dict, turn: int) -> None:
    output_of(job).parent.mkdir(parents=True, exist_ok=True)
    if job["kind"] == "parts":
        merge_parts(job, turn)
        return
    columns, rows = job["tiles"]
    tiles = [need(tile_path(job, number), f"tile {number} of {columns} x {rows}") for number in range(1, columns * rows + 1)]
    if job["by"] == "blender":
        in_blender(job, "merge", columns, rows, output_of(job), *tiles)
    else:
        run(job, "merge", *tiles, "-o", output_of(job))


def main() -> int:
    arguments = sys.argv[1:]
    turn, name, start = 1, " ".join(arguments), time.monotonic()
    try:
        if "--round" in arguments:
            at = arguments.index("--round")
            turn = int(arguments[at + 1])
            del arguments[at:at + 2]
        kind, number = arguments[0], int(arguments[1]) if len(arguments) > 1 else 0
    except (IndexError, ValueError):
        print(__doc__, file=sys.stderr)
        return 2
    tasks = {"check": lambda job: None, "convert": lambda job: convert(job, number), "frame": lambda job: frame(job, number),
             "tile": lambda job: tile(job, number), "part": lambda job: part(job, number, turn), "merge": lambda job: merge(job, turn)}
    where = f"{name} on {os.environ.get('SLURMD_NODENAME') or socket.gethostname()}"
    try:
        job = read_job()
        known = {"check", "convert", job["kind"][:-1]} | ({"merge"} if job["kind"] != "frames" else set())
        if kind not in known:
            raise Wrong(f"a job of {job['kind']} has no such task: {', '.join(sorted(known))}")
        print(f"patina job: {job['name']}: {where}", flush=True)
        if kind != "convert":
            for target in ([] if kind == "check" else [pair[1] for pair in job.get("convert", [])]):
                need(Path(job["directory"], target), "convert")
        check(job)
        tasks[kind](job)
    except Wrong as error:
        say(f"{where}: {error}")
        return WRONG
    except OSError as error:
        say(f"{where}: {error.filename or FOLDER}: {error.strerror}")
        return WRONG
    print(f"patina job: {name}: done in {time.monotonic() - start:.1f} s", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
