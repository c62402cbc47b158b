# SPDX-License-Identifier: GPL-3.0-or-later
"""Trains the trees that tell wrong samples from right ones, and writes them as C.

    build/out/venv/bin/python tests/truth/trust/train.py --out FILE.c [--features FOLDER --names FILE] [--trees 160]
        [--scenes trained] [--report FILE.md]
    build/out/venv/bin/python tests/truth/trust/train.py --check FILE.c [--features FOLDER --names FILE]

FOLDER has NAME.f32 of each scene: raw float32 (points, F), points in the order of the scan, as the library writes them; FILE has
the features' names, one a line. Without a folder the features are those of features.py. Scenes that split.json holds out are
refused. The trees are trained on all scenes; their calibration and the default threshold come from trees that were trained on
other scenes than they are judged on. The same input gives the same bytes.

--check: whether a file was made from today's scenes, scanners and trainer, by the sum in its head (a second); with --features also
whether training again gives its bytes (minutes)."""

from __future__ import annotations

import argparse
import datetime
import hashlib
import re
import sys
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[3]
sys.path.insert(0, str(ROOT / "tests"))

from truth.scans import campaigns, exact  # noqa: E402
from truth.scans.scanner import CAUSES  # noqa: E402
from truth.trust import boost, features, report, samples  # noqa: E402

TREES = 160
LOST = 0.01  # of the right samples of each scene: at most so many fall below the default threshold
FAR = 0.05  # metres: what is off by more counts twice
LEFT_OUT = ("passer", "mirrored")  # whole things that are somewhere else: no neighborhood shows that
MOST_BYTES = 64 * 1024


def made_from(names: list[str], scenes: list[str]) -> str:
    """A sum over all that a model is made from, but for the features' own sources."""
    here = Path(__file__).resolve().parent
    digest = hashlib.sha256(exact._sources().encode())
    for name in ("boost", "samples", "train"):
        digest.update(exact.meaning(here / f"{name}.py").encode())
    digest.update(repr((names, [(one.name, one.survey, one.seed) for one in map(campaigns.named, scenes)])).encode())
    return digest.hexdigest()[:16]


def told(text: str) -> tuple[str, str, list[str], list[str]]:
    """What the head of a written file says: its sum, date, features and scenes."""
    sum_, date = re.search(r"^// Sum: (\w+)", text, re.M), re.search(r"train\.py on ([\d-]+)\.", text)
    scenes = re.search(r"^// Scenes:\n((?://   .*\n)+)", text, re.M)
    if not (sum_ and date and scenes):
        raise ValueError("no file that train.py wrote")
    features_ = re.findall(r"^//   +\d+ (\S+)$", text, re.M)
    return sum_[1], date[1], features_, re.findall(r"[\w-]+", scenes[1].replace("//", ""))


def joined(all_: dict[str, samples.Samples], names: list[str]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Values, right and weights for training. In training wrong samples are as many as the sampling gives, whatever their
    share; the calibration makes up for that."""
    values, right, weight = [], [], []
    for name in names:
        one = all_[name]
        keep = one.right | ~np.isin(one.cause, [CAUSES.index(kind) for kind in LEFT_OUT])
        values.append(one.values[keep])
        right.append(one.right[keep])
        weight.append(np.where(~one.right & (one.off > FAR), 2, 1)[keep])
    return np.concatenate(values), np.concatenate(right), np.concatenate(weight)


def crossed(all_: dict[str, samples.Samples], trees: int) -> dict[str, np.ndarray]:
    """The score of every sample by trees that were trained on the other groups of scenes."""
    out: dict[str, np.ndarray] = {}
    for group in samples.groups(list(all_)):
        others = [name for name in all_ if name not in group]
        if group and others:
            forest = boost.train(*joined(all_, others), trees)
            out |= {name: forest.score(boost.binned(all_[name].values, forest.edges)) for name in group}
    return out


def calibrated(all_: dict[str, samples.Samples], scores: dict[str, np.ndarray]) -> boost.Calibration:
    """Scenes count alike, and within each its wrong samples as often as they are there."""
    weight = [all_[name].weight / all_[name].weight.sum() for name in scores]
    return boost.calibrate(np.concatenate(list(scores.values())), np.concatenate([all_[name].right for name in scores]),
                           np.concatenate(weight))


def threshold(all_: dict[str, samples.Samples], scores: dict[str, np.ndarray], calibration: boost.Calibration) -> int:
    """The greatest trust (of 255) below which at most LOST of the right samples of each scene lie."""
    most = 255
    for name, score in scores.items():
        one = all_[name]
        trust = calibration.trust(score)[one.right]
        below = np.cumsum(np.bincount(trust, one.weight[one.right], 256)) / one.weight[one.right].sum()
        most = min(most, int(np.searchsorted(below, LOST, side="right")))
    return most


def _rows(values: list[str], width: int = 120) -> str:
    lines, line = [], "   "
    for value in values:
        if len(line) + len(value) + 2 > width:
            lines.append(line)
            line = "   "
        line += f" {value},"
    return "\n".join([*lines, line])


def number(value: float) -> str:
    """A float32 as C writes it exactly."""
    return "INFINITY" if np.isinf(value) else f"{float(value).hex()}f"


def as_c(forest: boost.Forest, calibration: boost.Calibration, limit: int, names: list[str], scenes: list[str], date: str) -> str:
    count, wanted = len(forest.leaf), len(names)
    nodes = 2**boost.DEPTH - 1
    trees = [f"{f}, {b}" for feature, at in zip(forest.feature, forest.bin) for f, b in zip(feature, at)]
    listed = "\n".join(f"//   {k:2} {name}" for k, name in enumerate(names))
    curve = ", ".join(f"{calibration.lowest + (k << calibration.shift)}: {calibration.table[k] / 255:.3f}"
                      for k in range(0, 256, 16))
    wrapped = "\n".join("//   " + line for line in _wrapped(", ".join(scenes), 110))
    return f"""// SPDX-License-Identifier: GPL-3.0-or-later
// Written by tests/truth/trust/train.py on {date}. Do not edit: train again.
// Sum: {made_from(names, scenes)} of what it was made from
// Scenes:
{wrapped}
// Features:
{listed}
// Calibration, score: trust:
{chr(10).join("//   " + line for line in _wrapped(curve, 110))}
#include "trust_model.h"

#include <math.h>

// The bin of a feature is the number of its thresholds that are at most the value, 0 for NaN.
const float trust_thresholds[TRUST_FEATURES][TRUST_BINS - 1] = {{
{chr(10).join("    {" + _rows([number(v) for v in row]).strip().rstrip(",") + "}," for row in forest.edges)}
}};
// Feature and bin of {nodes} nodes a tree, breadth first. A point goes right (2 i + 2) if its bin is at least the node's.
const uint8_t trust_nodes[TRUST_TREES][{nodes}][2] = {{
{chr(10).join("    {" + ", ".join("{" + one + "}" for one in trees[k * nodes:(k + 1) * nodes]) + "}," for k in range(count))}
}};
const int16_t trust_leaves[TRUST_TREES][{nodes + 1}] = {{
{chr(10).join("    {" + ", ".join(str(v) for v in row) + "}," for row in forest.leaf)}
}};
// trust = trust_table[clamp((score - trust_lowest) >> trust_shift, 0, 255)] / 255; score: the sum of a leaf of each tree.
const int32_t trust_lowest = {calibration.lowest}, trust_shift = {calibration.shift};
const uint8_t trust_table[256] = {{
{_rows([str(v) for v in calibration.table])}
}};
// At most {100 * LOST:g} % of the right samples of any scene above have less trust than this, of 255.
const uint8_t trust_default = {limit};
_Static_assert(TRUST_TREES == {count} && TRUST_FEATURES == {wanted} && TRUST_BINS == {boost.BINS}, "another model");
"""


def _wrapped(text: str, width: int) -> list[str]:
    lines, line = [], ""
    for word in text.split(" "):
        if line and len(line) + len(word) + 1 > width:
            lines.append(line)
            line = ""
        line += (" " if line else "") + word
    return [*lines, line]


def size_of(forest: boost.Forest) -> int:
    """Bytes of its constants."""
    return 4 * forest.edges.size + forest.feature.size + forest.bin.size + 2 * forest.leaf.size + 256


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--features", type=Path)
    parser.add_argument("--names", type=Path)
    parser.add_argument("--scenes", default="trained")
    parser.add_argument("--trees", type=int, default=TREES)
    parser.add_argument("--out", type=Path)
    parser.add_argument("--report", type=Path, help="the tables of report.py, of scores by trees trained on other scenes")
    parser.add_argument("--check", type=Path, metavar="FILE")
    parser.add_argument("--date", default=datetime.date.today().isoformat(), help="written into the file")
    options = parser.parse_args()
    names = options.names.read_text().split() if options.names else list(features.NAMES)
    scenes = samples.checked([one.name for one in campaigns.group(options.scenes)])
    if options.check:
        sum_, options.date, names, scenes = told(options.check.read_text())
        if sum_ != made_from(names, samples.checked(scenes)):
            print(f"{options.check} was made from other scenes, scanners or trainer. Run tests/truth/trust/train.py.", file=sys.stderr)
            return 1
        if not options.features:
            return 0
    all_ = {name: samples.load(name, options.features, len(names)) for name in scenes}
    scores = crossed(all_, options.trees)
    calibration = calibrated(all_, scores)
    limit = threshold(all_, scores, calibration)
    text = report.tables(all_, scores, calibration, limit)
    print(text)
    if options.report:
        options.report.write_text(text + "\n")
    if options.check:
        forest = boost.train(*joined(all_, scenes), options.trees)
        same = as_c(forest, calibration, limit, names, scenes, options.date) == options.check.read_text()
        print(f"{options.check}: training again gives {'the same' if same else 'other'} bytes")
        return 0 if same else 1
    if options.out:
        forest = boost.train(*joined(all_, scenes), options.trees)
        if size_of(forest) > MOST_BYTES:
            print(f"The model needs {size_of(forest)} bytes; {MOST_BYTES} are allowed. Train fewer trees.", file=sys.stderr)
            return 1
        options.out.write_text(as_c(forest, calibration, limit, names, scenes, options.date))
        print(f"{options.out}: {options.trees} trees, {size_of(forest):,} bytes of constants")
    return 0


if __name__ == "__main__":
    sys.exit(main())
