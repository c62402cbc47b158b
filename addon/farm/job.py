#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes the folder of a job, from which Slurm, Open Job Description and Flamenco run its tasks.

    job.py FOLDER --frames FILE   -o PICTURE####.png FILES... [OPTIONS OF patina render]   FILE: a line of further options a frame
    job.py FOLDER --tiles 4x4     -o PICTURE.png FILES... [OPTIONS]
    job.py FOLDER --parts 4       -o PICTURE.png FILES... [OPTIONS]   --rounds R: surfaces behind each other that show, at most (1)
    --patina PROGRAM   that the machines run (patina)       --convert   scans are built and analysed once, before all else
    --name NAME        in the farm's lists

Run it where relative paths of the files start. The folder must be reached by the same path on every machine. Python's own library only, from 3.8 on."""
import json
import os
import shlex
import shutil
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
COPIED = ("task.py", "slurm.py", "patina.js", "in_blender.py")


ABOUT = """Every machine needs this folder, and the files that job.json names, by the same paths, Python 3.8 or newer, and the same version of the program:
the one that job.json names, or the one that PATINA_PROGRAM (PATINA_BLENDER) names there. Any task may be run again: python3 task.py tells how.
"""


class Wrong(Exception):
    pass


def ranges_of(numbers: list) -> str:
    """1, 2, 3, 7 -> 1-3,7"""
    pieces = []
    for number in numbers:
        if pieces and number == pieces[-1][1] + 1:
            pieces[-1][1] = number
        else:
            pieces.append([number, number])
    return ",".join(str(first) if first == last else f"{first}-{last}" for first, last in pieces)


def template_of(job: dict) -> dict:
    """The job as a template of Open Job Description, 2023-09."""
    steps = []

    def add(name: str, arguments: list, numbers: str = "", after: str = "") -> str:
        step = {"name": name}
        if after:
            step["dependencies"] = [{"dependsOn": after}]
        if numbers:
            step["parameterSpace"] = {"taskParameterDefinitions": [{"name": "Number", "type": "INT", "range": numbers}]}
        step["script"] = {"actions": {"onRun": {"command": "{{Param.Python}}", "args": ["{{Param.Folder}}/task.py", *arguments]}}}
        steps.append(step)
        return name

    number = "{{Task.Param.Number}}"
    before = add("Convert", ["convert", number], f"1-{len(job['convert'])}") if job.get("convert") else ""
    if job["kind"] == "frames":
        add("Frames", ["frame", number], ranges_of(job["frames"]), before)
    elif job["kind"] == "tiles":
        before = add("Tiles", ["tile", number], f"1-{job['tiles'][0] * job['tiles'][1]}", before)
        add("Merge", ["merge"], "", before)
    for turn in range(1, job["rounds"] + 1) if job["kind"] == "parts" else ():
        more = ["--round", str(turn)]
        before = add(f"Parts {turn}", ["part", number, *more], f"1-{job['parts']}", before)
        before = add(f"Merge {turn}", ["merge", *more], "", before)
    return {"specificationVersion": "jobtemplate-2023-09", "name": job["name"],
            "parameterDefinitions": [{"name": "Folder", "type": "PATH", "objectType": "DIRECTORY", "dataFlow": "INOUT", "default": ".",
                                      "description": "The job's folder"},
                                     {"name": "Python", "type": "STRING", "default": "python3", "description": "Python 3.8 or newer"}],
            "steps": steps}


def flamenco_of(job: dict, folder: Path) -> dict:
    """What the job type of patina.js is to be told."""
    count = job["tiles"][0] * job["tiles"][1] if job["kind"] == "tiles" else job.get("parts", 0)
    return {"folder": folder.as_posix(), "kind": job["kind"], "frames": ranges_of(job.get("frames", [])), "count": count,
            "rounds": job["rounds"], "convert": len(job.get("convert", []))}


def write(folder: Path, job: dict) -> None:
    """The folder of a job; job: as task.py reads it, without what is found here. OSError where it cannot be written."""
    folder.mkdir(parents=True, exist_ok=True)
    job = {"patina_job": 1, "rounds": 1, "arguments": [], "files": {}, **job}
    job["name"] = "".join(letter if letter.isprintable() else "_" for letter in job["name"])[:200]  # it becomes a part of scripts
    for name in COPIED:
        shutil.copyfile(HERE / name, folder / name)
    for name, content in (("template.json", template_of(job)), ("flamenco.json", flamenco_of(job, folder)), ("job.json", job)):
        beside = folder / f"{name}.part"
        beside.write_text(json.dumps(content, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
        os.replace(beside, folder / name)
    lines = [f"{farm}:\n    {command}\n" for farm, command in commands_of(folder, job).items()]
    (folder / "README.txt").write_text(f"A job of Patina: {job['name']}, {job['kind']}\n\n{''.join(lines)}\n{ABOUT}", encoding="utf-8")


def commands_of(folder: Path, job: dict) -> dict:
    """How each farm is told; what there is to say."""
    last = template_of(job)["steps"][-1]["name"]
    return {"Slurm": f"python3 {shlex.quote(str(folder / 'slurm.py'))}",
            "Open Job Description": f"openjd run {shlex.quote(str(folder / 'template.json'))} --step '{last}' --run-dependencies",
            "Flamenco": f"job type patina.js, settings of {folder / 'flamenco.json'}",
            "this machine": f"python3 {shlex.quote(str(folder / 'task.py'))} check"}


# ---- of the command line ---------------------------------------------------------------------------------------------


def parse(arguments: list) -> "tuple[Path, dict]":
    import task
    if not arguments or arguments[0].startswith("-"):
        raise Wrong(__doc__)
    arguments = [part for word in arguments for part in (word.split("=", 1) if word.startswith("--") and "=" in word else [word])]  # --NAME=VALUE
    folder, rest, own = Path(arguments[0]).resolve(), [], {"patina": "patina", "rounds": "1", "name": "", "convert": ""}
    valued = {"--frames", "--tiles", "--parts", "--rounds", "--patina", "--name", "-o"}
    at = 1
    while at < len(arguments):
        name = arguments[at]
        if name == "--convert":
            own["convert"] = "yes"
        elif name in valued:
            if at + 1 == len(arguments):
                raise Wrong(f"option '{name}' lacks its value")
            at += 1
            own[name.lstrip("-")] = arguments[at]
        else:
            rest.append(name)
        at += 1
    kinds = [kind for kind in ("frames", "tiles", "parts") if kind in own]
    if len(kinds) != 1 or "o" not in own:
        raise Wrong("one of --frames, --tiles and --parts, and -o PICTURE.png, please")
    count = next((i for i, name in enumerate(rest) if name.startswith("-")), len(rest))
    if not count:
        raise Wrong("name the clouds before the options")
    program = shutil.which(own["patina"])
    if not program:
        raise Wrong(f"'{own['patina']}' is not there, or no program: --patina names it")
    job = {"name": own["name"] or Path(own["o"]).stem.strip("#") or "patina", "kind": kinds[0], "by": "patina", "program": str(Path(program).absolute()),
           "version": task.version_of(program), "directory": os.getcwd(), "output": own["o"], "rounds": _number(own["rounds"], "--rounds"), "convert": []}
    clouds = rest[:count]
    meshes = [rest[i + 1] for i, name in enumerate(rest[:-1]) if name == "--mesh"]
    job["files"] = {name: task.look_of(Path(name)) for name in [*clouds, *meshes]}
    if own["convert"]:
        for i, name in enumerate(clouds):
            if not name.endswith(".cloud"):
                clouds[i] = str(folder / "clouds" / f"{i + 1}-{Path(name).stem}.cloud")
                job["convert"].append([name, clouds[i]])
    job["arguments"] = [*clouds, *rest[count:]]
    if kinds[0] == "frames":
        lines = Path(own["frames"]).read_text("utf-8").splitlines()
        job["options"] = [shlex.split(line) for line in lines if line.strip()]
        job["frames"] = list(range(1, len(job["options"]) + 1))
        if not job["frames"]:
            raise Wrong(f"{own['frames']} has no line of options")
    elif kinds[0] == "tiles":
        job["tiles"] = [_number(text, "--tiles") for text in own["tiles"].split("x")]
        if len(job["tiles"]) != 2:
            raise Wrong("--tiles: columns x rows, as 4x4")
    else:
        job["parts"] = _number(own["parts"], "--parts")
    return folder, job


def _number(text: str, name: str) -> int:
    if not text.isascii() or not text.isdigit() or not int(text):
        raise Wrong(f"'{text}' is no value for option '{name}'")
    return int(text)


def main() -> int:
    sys.dont_write_bytecode = True
    import task
    try:
        folder, job = parse(sys.argv[1:])
        write(folder, job)
    except (Wrong, task.Wrong) as error:
        print(f"patina job: {error}", file=sys.stderr)
        return 2
    except OSError as error:
        print(f"patina job: {error.filename}: {error.strerror}", file=sys.stderr)
        return 1
    for farm, command in commands_of(folder, job).items():
        print(f"{farm}: {command}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
