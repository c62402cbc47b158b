# SPDX-License-Identifier: GPL-3.0-or-later
"""Trains the model of trust and writes its constants, native/scene/trust_constants.h.

    python tests/truth/scans/train_trust.py FOLDER [--check] [--report HELD_OUT_FOLDER]

FOLDER holds a file NAME.npz for each scene for tuning: `plain` (n, features) float32 as patina_analysis_desc.trust_features has them,
`known` likewise with stations (optional), and `wrong` (n,) bool. --check: compares with the constants and writes nothing. --report: files
of scenes that nobody trains on. Needs scikit-learn 1.9 and numpy; run it with OMP_NUM_THREADS=1, so that sums have one order."""

from __future__ import annotations

import argparse
import datetime
import re
import sys
from pathlib import Path

import numpy as np
from sklearn.ensemble import HistGradientBoostingClassifier
from sklearn.metrics import roc_auc_score

ROOT = Path(__file__).resolve().parents[3]
CONSTANTS = ROOT / "native/scene/trust_constants.h"
SCALE = 1024  # of scores: a step of the log odds
LEVELS = 16
RIGHT, WRONG = 60000, 12000  # samples of a scene, at most
SURE_AFTER = 10  # trees; most points need no more
SURE_LOST = 0.002  # of the wrong samples may be sure by then
MOST_BYTES = 65536


def names() -> list[str]:
    return re.findall(r"X\((\w+), \"", (ROOT / "native/scene/trust_features.h").read_text())


def parts(path: Path) -> list[tuple[str, np.ndarray, np.ndarray]]:
    with np.load(path) as arrays:
        return [(kind, arrays[kind], arrays["wrong"]) for kind in ("plain", "known") if kind in arrays.files]


def drawn(features: np.ndarray, wrong: np.ndarray, random: np.random.Generator) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Some of a scene's samples, and what each stands for."""
    chosen, weights = [], []
    for which, most in ((~wrong, RIGHT), (wrong, WRONG)):
        index = np.flatnonzero(which)
        some = np.sort(random.choice(index, min(most, len(index)), replace=False))
        chosen.append(some)
        weights.append(np.full(len(some), len(index) / max(len(some), 1)))
    index, weight = np.concatenate(chosen), np.concatenate(weights)
    return features[index], wrong[index], weight * 1e5 / weight.sum()


def train(paths: list[Path]) -> tuple[HistGradientBoostingClassifier, np.ndarray, np.ndarray]:
    random = np.random.default_rng(1)
    some = [drawn(features, wrong, random) for path in paths for _, features, wrong in parts(path)]
    features, wrong, weight = (np.concatenate(each) for each in zip(*some, strict=True))
    model = HistGradientBoostingClassifier(max_iter=120, max_leaf_nodes=15, learning_rate=0.12, min_samples_leaf=60, max_bins=63,
                                           l2_regularization=1.0, random_state=1, early_stopping=False)
    return model.fit(features, wrong, sample_weight=weight), features, wrong


def preorder(nodes: np.ndarray) -> list[tuple[float, int, int]]:
    """(most, value, feature) of a tree, as trust_model.c reads them; scores grow with trust."""
    out: list[tuple[float, int, int]] = []

    def add(at: int) -> None:
        node = nodes[at]
        if node["is_leaf"]:
            out.append((0.0, -int(np.rint(SCALE * node["value"])), 0xFFFF))
            return
        here = len(out)
        # a float32 feature goes left where it is at most the greatest float32 up to the threshold
        most = np.float32(node["num_threshold"])
        most = np.nextafter(most, np.float32(-np.inf)) if float(most) > node["num_threshold"] else most
        out.append((float(most), 0, int(node["feature_idx"])))
        add(node["left"])
        out[here] = (out[here][0], len(out) - here, out[here][2])
        add(node["right"])

    add(0)
    return out


class Model:
    """As trust_model.c computes it."""

    def __init__(self, model: HistGradientBoostingClassifier, features: np.ndarray, wrong: np.ndarray) -> None:
        self.trees = [preorder(tree[0].nodes) for tree in model._predictors]
        self.first = -int(np.rint(SCALE * float(np.ravel(model._baseline_prediction)[0])))
        trust = 1 - ((LEVELS - 1 - np.arange(LEVELS)) / (LEVELS - 1)) ** 2
        middle = 0.5 * (trust[1:] + trust[:-1])
        self.least = np.rint(SCALE * np.log(middle / (1 - middle))).astype(int)
        early = self.scores(features, SURE_AFTER)
        self.sure = int(np.ceil(np.quantile(early[wrong], 1 - SURE_LOST)))

    def scores(self, features: np.ndarray, count: int) -> np.ndarray:
        sums = np.full(len(features), self.first, np.int64)
        for tree in self.trees[:count]:
            at = np.zeros(len(features), np.int64)
            most, value, feature = (np.array(each) for each in zip(*tree, strict=True))
            most = most.astype(np.float32)
            for _ in range(len(tree)):
                inner = np.flatnonzero(feature[at] != 0xFFFF)
                if not len(inner):
                    break
                here = at[inner]
                left = features[inner, feature[here]] <= most[here]
                at[inner] = here + np.where(left, 1, value[here])
            sums += value[at]
        return sums

    def levels(self, features: np.ndarray) -> np.ndarray:
        early = self.scores(features, SURE_AFTER)
        found = np.searchsorted(self.least, self.scores(features, len(self.trees)), side="right")
        return np.where(early >= self.sure, LEVELS - 1, found)


def text(model: Model, told: str) -> str:
    nodes = [node for tree in model.trees for node in tree]
    roots = np.cumsum([0] + [len(tree) for tree in model.trees[:-1]])
    if 8 * len(nodes) + 2 * len(roots) > MOST_BYTES:
        raise SystemExit(f"{8 * len(nodes) + 2 * len(roots)} bytes of constants are more than {MOST_BYTES}")
    used = {feature for _, _, feature in nodes}
    comment = [told, "features: " + ", ".join(name.lower() for i, name in enumerate(names()) if i in used),
               f"calibration: log odds in steps of 1 / {SCALE}; levels meet halfway between what they stand for"]
    lines = ["// SPDX-License-Identifier: GPL-3.0-or-later", "// Written by tests/truth/scans/train_trust.py; trust_model.c reads it."]
    for one in comment:
        while one:
            cut = one if len(one) <= 120 else one[: one.rfind(" ", 0, 120)]
            lines.append("// " + cut)
            one = one[len(cut) :].strip()
    lines += ["// clang-format off",
              f"enum {{ TREES = {len(roots)}, FIRST_SCORE = {model.first}, SURE_AFTER = {SURE_AFTER}, SURE_SCORE = {model.sure} }};"]

    def block(head: str, items: list[str], width: int) -> None:
        lines.append(head + " = {")
        lines.extend("    " + " ".join(items[i : i + width]) for i in range(0, len(items), width))
        lines.append("};")

    block(f"static const int32_t least_scores[{LEVELS - 1}]", [f"{v}," for v in model.least], 15)
    block("static const uint16_t roots[TREES]", [f"{v}," for v in roots], 16)
    block("static const struct node nodes[]", [f"{{{most!r}f, {value}, {feature}}}," for most, value, feature in
                                               ((float(f"{m:.9g}"), v, f) for m, v, f in nodes)], 5)
    return "\n".join([*lines, "// clang-format on", ""])


def report(model: Model, paths: list[Path], held_out: bool) -> None:
    trust = 1 - ((LEVELS - 1 - np.arange(LEVELS)) / (LEVELS - 1)) ** 2
    for path in paths:
        for kind, features, wrong in parts(path):
            some = np.random.default_rng(2).permutation(len(wrong))[:300000]
            features, wrong = features[some], wrong[some]
            levels = model.levels(features)
            outs = [f"{t:.2f}: {100 * (levels[~wrong] < l).mean():.2f}/{100 * (levels[wrong] < l).mean():.0f}"
                    for l, t in enumerate(trust) if l in (4, 6, 7, 8, 9, 10, 11, 12, 13)]
            curve = [f"{t:.2f}={(~wrong)[levels == l].mean():.2f}" for l, t in enumerate(trust) if (levels == l).sum() > 50]
            print(f"{path.stem} {kind}{' (held out)' * held_out}: wrong {100 * wrong.mean():.2f} %, AUC "
                  f"{roc_auc_score(wrong, -model.scores(features, len(model.trees))):.3f}; % of right/wrong below {', '.join(outs)}; "
                  f"trust=right {' '.join(curve)}; sure early {100 * (model.scores(features, SURE_AFTER) >= model.sure).mean():.0f} %")


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--check", action="store_true")
    parser.add_argument("--report", type=Path)
    options = parser.parse_args()
    paths = sorted(options.folder.glob("*.npz"))
    model = Model(*train(paths))
    report(model, paths, False)
    if options.report:
        report(model, sorted(options.report.glob("*.npz")), True)
    scenes = ", ".join(path.stem for path in paths)
    date = datetime.date.today().isoformat()
    known = CONSTANTS.read_text() if CONSTANTS.is_file() else ""
    if options.check:
        date = (re.search(r"on (\d{4}-\d\d-\d\d)", known) or [None, date])[1]
    made = text(model, f"trained on {date} with the scenes {scenes}")
    if options.check:
        return int(made != known)
    CONSTANTS.write_text(made)
    return 0


if __name__ == "__main__":
    sys.exit(main())
