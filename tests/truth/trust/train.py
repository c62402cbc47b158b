# SPDX-License-Identifier: GPL-3.0-or-later
"""Trains the trees that tell wrong samples from right ones, and writes them as C.

    build/out/venv/bin/python tests/truth/trust/train.py FOLDER [--trees 100] [--scenes trained] [--out FILE.h] [--report FILE.md]
    build/out/venv/bin/python tests/truth/trust/train.py [FOLDER] --check

FOLDER has NAME.f32 of each scene and NAME.known.f32 of those whose stations are known, as measure.py writes them: the library's
features, raw float32 (points, F). `plain` in its place: those of features.py. FILE.h is native/scene/analysis/trust_constants.h by default;
native/scene/analysis/trust_model.c reads it. Scenes that split.json holds out are refused. The trees are trained on all scenes; their
calibration and the default threshold come from trees that were trained on other scenes than they are judged on. The same input gives
the same bytes.

--check: whether the file was made from today's scenes, scanners and trainer, and from the features that the library computes today, by
the sums in its head (a second); with a folder also whether training again gives its bytes (minutes)."""

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
from truth.trust import boost, constants, features, report, samples  # noqa: E402

TREES = 100
SURE_AFTER = 10  # trees, after which most points need no more
SURE_LOST = 0.002  # of the wrong samples may count as sure then
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
    sum_, date = re.search(r"^// Sum: (\w+)", text, re.M), re.search(r"train\.py on ([\d-]+);", text)
    lists = [re.search(rf"^// {title}:\n((?://   .*\n)+)", text, re.M) for title in ("Features", "Scenes")]
    if not (sum_ and date and all(lists)):
        raise ValueError("no file that train.py wrote")
    words = [re.findall(r"[\w-]+", one[1].replace("//", "")) for one in lists]
    return sum_[1], date[1], words[0], words[1]


def features_of(text: str) -> str:
    """The sum over features that a written file was trained on; "": it does not say."""
    found = re.search(r"^// Features' sum: (\w+)", text, re.M)
    return found[1] if found else ""


def complaint(text: str) -> str:
    """What a written file was made from that is different today; "": nothing."""
    sum_, _, names, scenes = told(text)
    if sum_ != made_from(names, samples.checked(scenes)):
        return "was made from other scenes, scanners or trainer"
    native = constants.library()
    if native is None:
        return "may be of other features: there is no library to compute them"
    was, now = features_of(text), constants.sum_of_features(native)
    return "" if was == now else f"was made from other features: their sum was {was or 'not written'} and is {now}"


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
    """The greatest level below which at most LOST of the right samples of each scene lie."""
    most = boost.LEVELS - 1
    for name, score in scores.items():
        one = all_[name]
        level = calibration.level(score)[one.right]
        below = np.cumsum(np.bincount(level, one.weight[one.right], boost.LEVELS)) / one.weight[one.right].sum()
        most = min(most, int(np.searchsorted(below, LOST, side="right")))
    return most


def model(all_: dict[str, samples.Samples], trees: int) -> tuple[boost.Forest, boost.Calibration, int, dict[str, np.ndarray]]:
    """The trees, their calibration, the default level, and the scores by trees of other scenes that both come from."""
    scores = crossed(all_, trees)
    calibration = calibrated(all_, scores)
    limit = threshold(all_, scores, calibration)
    values, right, weight = joined(all_, list(all_))
    forest = boost.train(values, right, weight, trees)
    early = forest.score(boost.binned(values[~right], forest.edges), SURE_AFTER)
    calibration.after, calibration.sure = SURE_AFTER, int(np.ceil(np.quantile(early, 1.0 - SURE_LOST)))
    return forest, calibration, limit, scores


def names_of_features(folder: str) -> list[str]:
    return list(features.NAMES) if folder == "plain" else re.findall(r"X\((\w+), \"", constants.FEATURES.read_text())


def as_c(forest: boost.Forest, calibration: boost.Calibration, limit: int, names: list[str], scenes: list[str], date: str,
         features_sum: str) -> str:
    trees = [forest.nodes(k) for k in range(len(forest.leaf))]
    nodes = [node for tree in trees for node in tree]
    roots = np.cumsum([0] + [len(tree) for tree in trees[:-1]])
    curve = ", ".join(f"{score} = {0.5 * (a + b):.3f}" for score, a, b in zip(calibration.least, boost.TRUST, boost.TRUST[1:]))
    head = ["// SPDX-License-Identifier: GPL-3.0-or-later",
            f"// Written by tests/truth/trust/train.py on {date}; trust_model.c reads it. Do not edit: train again.",
            f"// Sum: {made_from(names, scenes)} of what it was made from",
            f"// Features' sum: {features_sum}"]
    for title, words in (("Scenes", ", ".join(scenes)), ("Features", ", ".join(names)),
                         ("Calibration, score = share that is right", curve)):
        head += [f"// {title}:", *("//   " + line for line in _wrapped(words, 120))]
    head.append(f"// At most {100 * LOST:g} % of the right samples of each scene are below level {limit}, trust {boost.TRUST[limit]:.3f}.")
    return "\n".join([
        *head, "// clang-format off",
        f"enum {{ TREES = {len(trees)}, FIRST_SCORE = 0, SURE_AFTER = {calibration.after}, SURE_SCORE = {calibration.sure} }};",
        f"static const int32_t least_scores[{boost.LEVELS - 1}] = {{",
        "    " + " ".join(f"{v}," for v in calibration.least), "};",
        "static const uint16_t roots[TREES] = {", *_rows([f"{v}," for v in roots], 16), "};",
        "static const struct node nodes[] = {",
        *_rows([f"{{{number(most)}, {value}, {feature}}}," for most, value, feature in nodes], 5), "};", "// clang-format on", ""])


def _rows(items: list[str], width: int) -> list[str]:
    return ["    " + " ".join(items[k : k + width]) for k in range(0, len(items), width)]


def number(value: float) -> str:
    """A float32 as C reads it exactly: nine digits do."""
    text = f"{value:.9g}"
    return f"{text}f" if any(c in text for c in ".e") else f"{text}.0f"


def _wrapped(text: str, width: int) -> list[str]:
    lines, line = [], ""
    for word in text.split(" "):
        if line and len(line) + len(word) + 1 > width:
            lines.append(line)
            line = ""
        line += (" " if line else "") + word
    return [*lines, line]


def size_of(forest: boost.Forest) -> int:
    """Bytes of its constants in C."""
    return sum(8 * len(forest.nodes(k)) + 2 for k in range(len(forest.leaf))) + 4 * (boost.LEVELS - 1)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", nargs="?", default="", help="of features, or plain")
    parser.add_argument("--scenes", default="trained")
    parser.add_argument("--trees", type=int, default=TREES)
    parser.add_argument("--out", type=Path, default=constants.CONSTANTS)
    parser.add_argument("--report", type=Path, help="the tables of report.py, of scores by trees trained on other scenes")
    parser.add_argument("--check", action="store_true")
    parser.add_argument("--date", default=datetime.date.today().isoformat(), help="written into the file")
    options = parser.parse_args()
    scenes = samples.checked([one.name for one in campaigns.group(options.scenes)])
    if options.check:
        _, options.date, _, scenes = told(options.out.read_text())
        if problem := complaint(options.out.read_text()):
            print(f"{options.out} {problem}. Run tests/truth/trust/train.py.", file=sys.stderr)
            return 1
    if not options.folder:
        return 0 if options.check else parser.error("which folder has the features?")
    names = names_of_features(options.folder)
    all_ = samples.load_all(scenes, None if options.folder == "plain" else Path(options.folder), len(names))
    forest, calibration, limit, scores = model(all_, options.trees)
    if size_of(forest) > MOST_BYTES:
        print(f"The model needs {size_of(forest)} bytes; {MOST_BYTES} are allowed. Train fewer trees.", file=sys.stderr)
        return 1
    native = None if options.folder == "plain" else constants.library()
    features_sum = constants.sum_of_features(native) if native else "plain"
    text = as_c(forest, calibration, limit, names, scenes, options.date, features_sum)
    if options.check:
        same = text == options.out.read_text()
        print(f"{options.out}: training again gives {'the same' if same else 'other'} bytes")
        return 0 if same else 1
    tables = report.tables(all_, scores, calibration, limit)
    print(tables)
    if options.report:
        options.report.write_text(tables + "\n")
    options.out.write_text(text)
    print(f"{options.out}: {options.trees} trees, {size_of(forest):,} bytes of constants, default trust {boost.TRUST[limit]:.3f}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
