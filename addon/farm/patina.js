// SPDX-License-Identifier: GPL-3.0-or-later
// A job type of Flamenco 3: tasks of a folder that Patina has written. Goes into `scripts` beside flamenco-manager, as patina.js. Each task runs `python3 task.py ...`
// of that folder, which every worker must reach by the same path; the settings are what job.json says. Frames follow on what is converted; merging waits for all tiles, or all parts of its round.

const JOB_TYPE = {
    label: "Patina",
    settings: [
        {key: "folder", type: "string", subtype: "dir_path", required: true, description: "The job's folder, which Patina wrote"},
        {key: "kind", type: "string", required: true, choices: ["frames", "tiles", "parts"], default: "frames", description: "As job.json says"},
        {key: "frames", type: "string", default: "", description: "Of frames: which, as 1-24 or 1,5,9"},
        {key: "count", type: "int32", default: 0, description: "How many tiles or parts there are"},
        {key: "rounds", type: "int32", default: 1, description: "Of parts: how often they are merged at most, once for each layer of surface"},
        {key: "convert", type: "int32", default: 0, description: "How many files are converted first"},
        {key: "python", type: "string", default: "python3", description: "Python 3.8 or newer on the workers"},
    ],
};

function compileJob(job) {
    const settings = job.settings;
    const type = settings.kind === "parts" ? "misc" : "blender";
    check(settings);
    const converted = numbers(1, settings.convert).map(i => addTask(job, `convert-${i}`, "misc", ["convert", i], []));
    if (settings.kind === "frames") {
        for (const frame of frameNumbers(settings.frames))
            addTask(job, `frame-${frame}`, type, ["frame", frame], converted);
    } else if (settings.kind === "tiles") {
        const tiles = numbers(1, settings.count).map(i => addTask(job, `tile-${i}`, type, ["tile", i], converted));
        addTask(job, "merge", type, ["merge"], tiles);
    } else {
        let before = converted;
        for (let round = 1; round <= settings.rounds; round++) {
            const parts = numbers(1, settings.count).map(i => addTask(job, `part-${i}-round-${round}`, type, ["part", i, "--round", round], before));
            before = [addTask(job, `merge-round-${round}`, type, ["merge", "--round", round], parts)];
        }
    }
}

function check(settings) {
    if (!["frames", "tiles", "parts"].includes(settings.kind))
        throw new Error(`Patina: there are no jobs of '${settings.kind}'`);
    if (settings.kind !== "frames" && !(settings.count >= 1))
        throw new Error(`Patina: how many ${settings.kind} are there? Setting 'count'`);
    if (settings.kind === "parts" && !(settings.rounds >= 1))
        throw new Error("Patina: parts are merged once at least. Setting 'rounds'");
}

function addTask(job, name, type, args, dependencies) {
    const settings = job.settings;
    const task = author.Task(name, type);
    const script = `${settings.folder.replace(/[\\/]+$/, "")}/task.py`;
    task.addCommand(author.Command("exec", {exe: settings.python, args: [script].concat(args.map(String))}));
    for (const dependency of dependencies)
        task.addDependency(dependency);
    job.addTask(task);
    return task;
}

function numbers(first, last) {
    const found = [];
    for (let i = first; i <= last; i++)
        found.push(i);
    return found;
}

// "1-4,8" -> 1, 2, 3, 4, 8
function frameNumbers(text) {
    const found = [];
    for (const piece of text.split(",")) {
        const match = /^\s*(-?\d+)\s*(?:-\s*(-?\d+)\s*)?$/.exec(piece);
        if (!match)
            throw new Error(`Patina: '${piece}' names no frames: 1-24 or 1,5,9. Setting 'frames'`);
        const first = Number(match[1]), last = match[2] === undefined ? first : Number(match[2]);
        if (last < first)
            throw new Error(`Patina: frames ${piece} go backwards. Setting 'frames'`);
        found.push(...numbers(first, last));
    }
    return found;
}
