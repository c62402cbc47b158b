#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Jobs on real farms: test_farms.py PATH_OF_PATINA FOLDER_OF_OPENJD [NAME...]. Slurm's daemons run here, openjd runs its templates, Flamenco's job
type runs in a JavaScript engine. Every picture is held against the one that one machine draws, byte by byte. Python's own library only."""
import json
import os
import shutil
import sys
import tempfile
import time
from pathlib import Path

from sites import run, write_site
from slurm_cluster import Cluster, missing

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))
from runs import Skip, run_tests  # noqa: E402

ROOT = Path(__file__).resolve().parent.parent.parent
PATINA = str(Path(sys.argv[1] if len(sys.argv) > 1 else "build/out/release/patina").resolve())
OPENJD = Path(sys.argv[2] if len(sys.argv) > 2 else "build/out/openjd").resolve() / "bin/openjd"
FOLDER = Path()
SITE = ["site.cloud", "--size", "160x120", "--lit", "--shadows"]
CLUSTER = None


def patina(*arguments, code=0):
    return run(PATINA, *arguments, code=code, cwd=FOLDER)


def make(name, *arguments, program=PATINA, code=0):
    """A job's folder."""
    run(sys.executable, ROOT / "addon/farm/job.py", name, "--patina", program, *arguments, code=code, cwd=FOLDER)
    return FOLDER / name


def task(job, *arguments, code=0, env=None):
    return run(sys.executable, job / "task.py", *arguments, code=code, env=env)


def same(a, b):
    return (FOLDER / a).read_bytes() == (FOLDER / b).read_bytes()


def animation(name, **options):
    """A job of four frames, and the pictures that it shall make."""
    (FOLDER / "turns.txt").write_text("".join(f"--camera {30 * i},40\n" for i in range(4)), encoding="ascii")
    job = make(name, "--frames", "turns.txt", "-o", f"{name}-##.png", *SITE, **options)
    for i in range(4):
        patina("render", *SITE, "--camera", f"{30 * i},40", "-o", f"whole-{i + 1:02d}.png")
    return job


def has_frames(name):
    return all(same(f"whole-{i:02d}.png", f"{name}-{i:02d}.png") for i in range(1, 5))


def stumbling(name, victim, once):
    """A program like Patina, which does `once` the first time that it is asked for what holds the word `victim`."""
    path = FOLDER / name
    path.write_text(f'#!/bin/sh\ncase "$*" in *{victim}*) if [ ! -e {path}.done ]; then touch {path}.done; {once}; fi;; esac\n'
                    f'exec {PATINA} "$@"\n', encoding="ascii")
    path.chmod(0o755)
    return str(path)


# ---- one task --------------------------------------------------------------------------------------------------------


def test_a_task_restarts_alone_with_the_same_bytes():
    job = make("alone", "--tiles", "2x1", "-o", "alone.png", *SITE)
    joined = make("joined", "--tiles=2x1", "-o", "alone.png", "site.cloud", "--size=160x120", "--lit", "--shadows")
    assert (joined / "job.json").read_bytes() == (job / "job.json").read_bytes(), "--NAME=VALUE is --NAME VALUE"
    task(job, "tile", 1)
    first = (job / "tiles/00001.png").read_bytes()
    (job / "tiles/00001.png").write_bytes(b"half")
    task(job, "tile", 1)
    assert (job / "tiles/00001.png").read_bytes() == first
    assert "tiles/00002.png is missing: tile 2 of 2 x 1" in task(job, "merge", code=1)
    task(job, "tile", 2)
    task(job, "merge")
    patina("render", *SITE, "-o", "whole.png")
    assert same("whole.png", "alone.png")


def test_a_task_says_what_it_lacks():
    shutil.copy(FOLDER / "site.cloud", FOLDER / "mine.cloud")
    job = make("lacking", "--parts", "2", "-o", "lacking.png", "mine.cloud", "--size", "60x40")
    task(job, "check")
    assert "no such task" in task(job, "frame", 1, code=1) and "the job has 2 parts" in task(job, "part", 3, code=1)
    assert "part 1 of 2 has not run" in task(job, "merge", code=1)
    assert "is not there, or no program" in task(job, "check", code=1, env=dict(os.environ, PATINA_PROGRAM="nowhere"))
    other = FOLDER / "other"
    other.write_text("#!/bin/sh\necho patina 0.0.1\n", encoding="ascii")
    other.chmod(0o755)
    assert "the job was made for patina" in task(job, "part", 1, code=1, env=dict(os.environ, PATINA_PROGRAM=str(other)))
    other.write_text("#!/bin/sh\necho libfoo.so is missing >&2; exit 127\n", encoding="ascii")
    assert "does not run here: libfoo.so" in task(job, "part", 1, code=1, env=dict(os.environ, PATINA_PROGRAM=str(other)))
    write_site(FOLDER / "mine.cloud", 100)
    assert "mine.cloud is not the file that the job was made with" in task(job, "part", 1, code=1)
    (FOLDER / "mine.cloud").unlink()
    assert "mine.cloud cannot be read" in task(job, "part", 1, code=1)
    (job / "job.json").write_text("{", encoding="ascii")
    assert "job.json is damaged" in task(job, "part", 1, code=1)
    make("no", "--tiles", "4", "-o", "no.png", *SITE, code=2)
    make("no", "--tiles", "2x2", "--parts", "2", "-o", "no.png", *SITE, code=2)
    make("no", "--tiles", "2x2", "-o", "no.png", "nowhere.ply", code=1)


def test_layers_by_tasks():
    """Rounds follow on each other until nothing lies behind; what is left has nothing to do."""
    glass = ["site.cloud", "--size", "80x60", "--opacity", "0.5", "--layers", "2"]
    job = make("glass", "--parts", "2", "--rounds", "3", "-o", "glass.png", *glass)
    for turn in (1, 2, 3):
        for part in (1, 2):
            told = task(job, "part", part, "--round", turn)
        told += task(job, "merge", "--round", turn)
    assert told.count("nothing is left for round 3") == 2
    patina("render", *glass, "-o", "whole.png")
    assert same("whole.png", "glass.png")
    few = make("few", "--parts", "1", "-o", "few.png", *glass)
    task(few, "part", 1)
    assert "make it anew with --rounds 2" in task(few, "merge", code=1)


# ---- Slurm -----------------------------------------------------------------------------------------------------------


def cluster():
    global CLUSTER
    if CLUSTER is None:
        folder = Path(tempfile.mkdtemp(prefix="patina-slurm-"))
        CLUSTER = Cluster(folder)
    return CLUSTER


def submit(job, *options):
    return run(sys.executable, job / "slurm.py", *options, env=cluster().env).split()[::2]


def test_slurm_draws():
    """An animation, a still of 4096 x 4096 in tiles, a cloud in four parts and its layers: all at once, on two nodes."""
    if missing():
        return missing()
    submit(animation("film"))
    large = ["site.cloud", "--size", "4096x4096", "--unlit"]
    submit(make("still", "--tiles", "4x2", "-o", "still.png", *large))
    submit(make("cloud", "--parts", "4", "-o", "cloud.png", "--convert", "site.ply", *SITE[1:], "--sun", "30,40,4", "--samples", "3"))
    glass = ["site.cloud", "--size", "80x60", "--opacity", "0.5", "--layers", "2"]
    submit(make("panes", "--parts", "2", "--rounds", "2", "-o", "panes.png", *glass))
    patina("render", *large, "-o", "whole-still.png", "--strip", "1024")
    patina("render", "site.ply", *SITE[1:], "--sun", "30,40,4", "--samples", "3", "-o", "whole-cloud.png")
    patina("render", *glass, "-o", "whole-panes.png")
    cluster().idle()
    assert has_frames("film") and same("whole-still.png", "still.png")
    assert same("whole-cloud.png", "cloud.png") and same("whole-panes.png", "panes.png")
    logs = "".join(path.read_text() for path in FOLDER.glob("*/logs/*.log"))
    assert " on one" in logs and " on two" in logs


def test_slurm_task_killed_node_down_part_missing():
    if missing():
        return missing()
    killed = make("killed", "--tiles", "2x2", "-o", "killed.png", *SITE, program=stumbling("stumbles", "'--tile 3'", "kill -9 $$"))
    submit(killed)
    submit(animation("down", program=stumbling("sleeps", "'--camera 30,'", "sleep 60")), "--nodelist=two")
    gone = make("gone", "--parts", "4", "-o", "gone.png", *SITE, program=stumbling("hangs", "'--part 3/4'", "sleep 60"))
    array, _ = submit(gone, "--exclude=two")
    cluster().wait(lambda: (FOLDER / "hangs.done").exists(), "part 3 does not begin")
    cluster().tell("scancel", f"{array}_3")
    cluster().wait(lambda: (FOLDER / "sleeps.done").exists(), "frame 2 does not begin")
    cluster().tell("scontrol", "update", "nodename=two", "state=down", "reason=test")
    time.sleep(1)
    cluster().ask("scontrol", "update", "nodename=two", "state=resume")  # unless it came back by itself
    cluster().idle()
    patina("render", *SITE, "-o", "whole.png")
    assert same("whole.png", "killed.png") and "killed: once more" in (killed / "logs/tile-3.log").read_text()
    assert has_frames("down"), (FOLDER / "down/logs/frame-2.log").read_text()
    assert (FOLDER / "down/logs/frame-2.log").read_text().count("frame 2 on two") == 2
    told = (gone / "logs/merge1.log").read_text()
    assert "round1-00003.keys is missing: part 3 of 4" in told and not (FOLDER / "gone.png").exists(), told
    task(gone, "part", 3)  # by hand
    task(gone, "merge")
    assert same("whole.png", "gone.png")


# ---- Open Job Description --------------------------------------------------------------------------------------------


def test_openjd_draws():
    if not OPENJD.exists():
        raise Skip(f"{OPENJD} is not there")
    jobs = {"jd-film": animation("jd-film"), "jd-still": make("jd-still", "--tiles", "2x2", "-o", "jd-still.png", *SITE),
            "jd-cloud": make("jd-cloud", "--parts", "2", "--rounds", "2", "-o", "jd-cloud.png", "--convert", "site.ply", *SITE[1:])}
    for job in jobs.values():
        assert "passes validation" in run(OPENJD, "check", job / "template.json")
        last = json.loads((job / "template.json").read_text())["steps"][-1]["name"]
        run(OPENJD, "run", job / "template.json", "--step", last, "--run-dependencies")
    patina("render", *SITE, "-o", "whole.png")
    assert has_frames("jd-film") and same("whole.png", "jd-still.png") and same("whole.png", "jd-cloud.png")
    (jobs["jd-still"] / "tiles/00002.png").unlink()
    told = run(OPENJD, "run", jobs["jd-still"] / "template.json", "--step", "Merge", code=1)
    assert "tile 2 of 2 x 2 has not run" in told, told


# ---- Flamenco --------------------------------------------------------------------------------------------------------

# What a job type finds there: print, author.Task, author.Command, job.settings, job.addTask; settings of the types that it may declare.
ENGINE = """
const fs = require("fs"), vm = require("vm");
const [script, given] = process.argv.slice(2);
const sandbox = {print: console.error, author: {
    Task(name, type) {
        if (typeof name !== "string" || !["blender", "ffmpeg", "file-management", "misc"].includes(type)) throw new TypeError("author.Task");
        return {name, type, commands: [], dependencies: [],
            addCommand(command) { if (!command.parameters) throw new TypeError("addCommand"); this.commands.push(command); },
            addDependency(task) { if (!task.commands) throw new TypeError("addDependency"); this.dependencies.push(task.name); }};
    },
    Command(name, parameters) {
        if (name !== "exec" || typeof parameters.exe !== "string" || !parameters.args.every(each => typeof each === "string"))
            throw new TypeError("author.Command");
        return {name, parameters};
    }}};
vm.createContext(sandbox);
vm.runInContext(fs.readFileSync(script, "utf8") + "\\nglobalThis.found = {JOB_TYPE, compileJob};", sandbox);
const {JOB_TYPE, compileJob} = sandbox.found, settings = {}, told = JSON.parse(given), tasks = [];
const kinds = {string: "string", int32: "number", float: "number", bool: "boolean"};
for (const each of JOB_TYPE.settings) {
    settings[each.key] = each.key in told ? told[each.key] : each.default;
    if (typeof settings[each.key] !== kinds[each.type]) throw new TypeError("setting " + each.key);
    if (each.choices && !each.choices.includes(each.default)) throw new TypeError("choices of " + each.key);
    delete told[each.key];
}
if (Object.keys(told).length) throw new Error("no settings: " + Object.keys(told));
compileJob({settings, name: "test", addTask(task) {
    if (tasks.some(each => each.name === task.name)) throw new Error("twice: " + task.name);
    if (!task.dependencies.every(name => tasks.some(each => each.name === name))) throw new Error("added before what it waits for");
    tasks.push(task);
}});
console.log(JSON.stringify({label: JOB_TYPE.label, tasks}));
"""


def compiled(job, code=0, **changed):
    (FOLDER / "engine.js").write_text(ENGINE, encoding="ascii")
    settings = {**json.loads((job / "flamenco.json").read_text()), **changed}
    told = run("node", FOLDER / "engine.js", job / "patina.js", json.dumps(settings), code=code)
    return told if code else json.loads(told.splitlines()[-1])["tasks"]


def run_all(tasks):
    """Each command as a worker runs it: in any order that the dependencies allow."""
    done = set()
    while len(done) < len(tasks):
        ready = [each for each in tasks if each["name"] not in done and done.issuperset(each["dependencies"])]
        assert ready, "tasks wait for each other"
        for each in reversed(ready):
            run(each["commands"][0]["parameters"]["exe"], *each["commands"][0]["parameters"]["args"])
            done.add(each["name"])


def test_flamenco_compiles_and_its_tasks_draw():
    if not shutil.which("node"):
        raise Skip("no JavaScript engine: nodejs")
    film = animation("fl-film")
    tasks = compiled(film)
    assert [each["name"] for each in tasks] == [f"frame-{i}" for i in range(1, 5)] and not any(each["dependencies"] for each in tasks)
    run_all(tasks)
    still = make("fl-still", "--tiles", "2x2", "-o", "fl-still.png", *SITE)
    tasks = compiled(still)
    assert tasks[-1]["name"] == "merge" and len(tasks[-1]["dependencies"]) == 4
    run_all(tasks)
    cloud = make("fl-cloud", "--parts", "2", "--rounds", "2", "-o", "fl-cloud.png", "--convert", "site.ply", *SITE[1:])
    tasks = compiled(cloud)
    assert tasks[0]["name"] == "convert-1" and tasks[1]["dependencies"] == ["convert-1"] and len(tasks) == 7
    run_all(tasks)
    patina("render", *SITE, "-o", "whole.png")
    assert has_frames("fl-film") and same("whole.png", "fl-still.png") and same("whole.png", "fl-cloud.png")
    assert [each["name"] for each in compiled(film, frames="3, 7-9,-2--1")] == [f"frame-{i}" for i in (3, 7, 8, 9, -2, -1)]
    for wrong in ({"frames": ""}, {"frames": "5-2"}, {"frames": "a"}, {"kind": "tiles"}, {"kind": "parts", "count": 0}):
        assert "Patina: " in compiled(film, code=1, **wrong)


def main():
    global FOLDER
    with tempfile.TemporaryDirectory() as folder:
        FOLDER = Path(folder)
        try:
            write_site(FOLDER / "site.ply", 12000)
            patina("convert", "site.ply", "site.cloud")
            return run_tests(globals(), sys.argv[3:])[1] != 0
        finally:
            if CLUSTER is not None:
                CLUSTER.close()
                shutil.rmtree(CLUSTER.folder, ignore_errors=True)


if __name__ == "__main__":
    sys.exit(main())
