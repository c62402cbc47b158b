#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Submits a job to Slurm: slurm.py [--dry] [OPTIONS OF sbatch...]. Lies in the job's folder.

Frames, tiles and parts are arrays; what must wait (parts for what is converted, merging for all of them, a round for the one before) depends on what it waits for.
A task on a node that fails is run again by Slurm; one that was killed puts itself in the queue again, twice at most. Merging begins when all tasks have ended, well or not, and names
what is missing. --dry writes the scripts alone. Python's own library only."""
import shlex
import subprocess
import sys
from pathlib import Path

FOLDER = Path(__file__).resolve().parent
RETRIES = 2

SCRIPT = """#!/bin/sh
#SBATCH --job-name={name}
#SBATCH --output={log}
#SBATCH --open-mode=append
#SBATCH --requeue
{array}python3 {task} {arguments} &
wait $!
code=$?
if [ $code -ge 128 ] && [ "${{SLURM_RESTART_COUNT:-0}}" -lt {retries} ]; then
    echo "patina job: killed: once more" >&2
    scontrol requeue "{self}" && sleep 60
fi
exit $code
"""


def steps_of(job: dict) -> list:
    """(name, arguments of task.py, array or None), each waiting for the one before. One array is one entry of Slurm's queue."""
    steps = []
    if job.get("convert"):
        steps.append(("convert", "convert", f"1-{len(job['convert'])}"))
    if job["kind"] == "frames":
        steps.append(("frame", "frame", ",".join(map(str, job["frames"]))))
    if job["kind"] == "tiles":
        steps += [("tile", "tile", f"1-{job['tiles'][0] * job['tiles'][1]}"), ("merge", "merge", None)]
    for turn in range(1, job["rounds"] + 1) if job["kind"] == "parts" else ():
        more = f" --round {turn}" if turn > 1 else ""
        steps += [(f"part{turn}", f"part{{}}{more}", f"1-{job['parts']}"), (f"merge{turn}", f"merge{more}", None)]
    return steps


def script_of(job: dict, name: str, arguments: str, array: "str | None") -> str:
    number = ' "$SLURM_ARRAY_TASK_ID"' if array else ""
    arguments = arguments.replace("{}", number) if "{}" in arguments else arguments + number
    log = FOLDER / "logs" / (f"{name}-%a.log" if array else f"{name}.log")
    return SCRIPT.format(name=shlex.quote(f"{job['name']}-{name}"), log=log, array=f"#SBATCH --array={array}\n" if array else "",
                         task=shlex.quote(str(FOLDER / "task.py")), arguments=arguments, retries=RETRIES,
                         self="${SLURM_ARRAY_JOB_ID}_${SLURM_ARRAY_TASK_ID}" if array else "$SLURM_JOB_ID")


def main() -> int:
    options = sys.argv[1:]
    dry = "--dry" in options
    options = [option for option in options if option != "--dry"]
    sys.dont_write_bytecode = True
    import task
    try:
        job = task.read_job()
    except task.Wrong as error:
        print(f"patina job: {error}", file=sys.stderr)
        return task.WRONG
    (FOLDER / "logs").mkdir(exist_ok=True)
    (FOLDER / "slurm").mkdir(exist_ok=True)
    before = ""
    for name, arguments, array in steps_of(job):
        path = FOLDER / "slurm" / f"{name}.sh"
        path.write_text(script_of(job, name, arguments, array), encoding="utf-8")
        if dry:
            print(path)
            continue
        waits = [f"--dependency=afterany:{before}"] if before else []
        done = subprocess.run(["sbatch", "--parsable", *waits, *options, str(path)], stdout=subprocess.PIPE, text=True, check=False)
        if done.returncode:
            print(f"patina job: sbatch ended with {done.returncode}; nothing behind {name} was submitted", file=sys.stderr)
            return 1
        before = done.stdout.strip().split(";")[0]
        print(f"{before} {name}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
