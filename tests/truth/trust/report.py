# SPDX-License-Identifier: GPL-3.0-or-later
"""How far trust carries: tables per scene and per cause, and the reliability curve.

    build/out/venv/bin/python tests/truth/trust/report.py FOLDER [--scenes unseen] [--trees 100 | --in-force]

Trains on the scenes for training and judges others, held out ones by default. --in-force: judges with the constants that the library is
built with. FOLDER: as train.py's. As a module: tables() of given
scores."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[3]
sys.path.insert(0, str(ROOT / "tests"))

from truth.trust import boost, constants, samples  # noqa: E402

LOSSES = (0.01, 0.003)  # of the right samples
STEPS = (0, 2, 4, 6, 8, 10, 11, 12, 13, 14, 15, 16)  # of levels, for the reliability curve


def share(of: np.ndarray, weight: np.ndarray) -> float:
    return float((weight * of).sum() / weight.sum()) if weight.sum() else float("nan")


def found(one: samples.Samples, score: np.ndarray, lost: float) -> np.ndarray:
    """Which samples lie below the score that costs `lost` of the right ones."""
    right = np.sort(score[one.right])
    return score < right[min(int(lost * len(right)), len(right) - 1)]


def percent(value: float) -> str:
    return "–" if not np.isfinite(value) else f"{100.0 * value:.1f}"


def scene_row(name: str, one: samples.Samples, score: np.ndarray, level: np.ndarray, limit: int) -> list[str]:
    out, wrong = level < limit, ~one.right
    precision = share(wrong[out], one.weight[out]) if out.any() else float("nan")
    row = [name, percent(share(wrong, one.weight)), f"{boost.auc(score, one.right, one.weight):.3f}"]
    row += [percent(share(found(one, score, loss)[wrong], one.weight[wrong])) for loss in LOSSES]
    far = wrong & (one.off > 0.05)
    row += [percent(share(found(one, score, LOSSES[0])[far], one.weight[far]))]
    return row + [percent(share(out[one.right], one.weight[one.right])), percent(precision),
                  percent(share(out[wrong], one.weight[wrong]))]


def table(head: list[str], rows: list[list[str]]) -> str:
    return "\n".join("| " + " | ".join(row) + " |" for row in [head, ["---"] * len(head), *rows])


def tables(all_: dict[str, samples.Samples], scores: dict[str, np.ndarray], calibration: boost.Calibration, limit: int) -> str:
    """Markdown. scores: of the samples of scenes; limit: the least level that counts as right."""
    level = {name: calibration.level(score) for name, score in scores.items()}
    names = list(scores)
    rows = [scene_row(name, all_[name], scores[name], level[name], limit) for name in names]
    first = table(["scene", "wrong %", "AUC", "found % at 1 % of right lost", "at 0.3 %", "at 1 %, off > 5 cm",
                   f"trust < {boost.TRUST[limit]:.2f}: right lost %", "precision %", "recall %"], rows)
    rows = []
    for kind in samples.KINDS:
        mine = [(name, ~all_[name].right & samples.kind_of(all_[name], kind)) for name in names]
        if not any(of.any() for _, of in mine):
            continue
        weight = np.concatenate([all_[name].weight[of] for name, of in mine])
        row = [kind, f"{weight.sum():,.0f}"]
        for loss in LOSSES:
            row.append(percent(share(np.concatenate([found(all_[name], scores[name], loss)[of] for name, of in mine]), weight)))
        row.append(percent(share(np.concatenate([level[name][of] < limit for name, of in mine]), weight)))
        areas = [(boost.auc(scores[name][keep], all_[name].right[keep], all_[name].weight[keep]), of.sum())
                 for name, of in mine if of.any() for keep in [of | all_[name].right]]
        row.append(f"{np.average([a for a, _ in areas], weights=[n for _, n in areas]):.3f}")
        rows.append(row)
    second = table(["cause", "samples", "found % at 1 % of right lost", "at 0.3 %", "recall %", "AUC"], rows)
    every = np.concatenate([level[name] for name in names])
    right = np.concatenate([all_[name].right for name in names])
    weight = np.concatenate([all_[name].weight / all_[name].weight.sum() for name in names])
    rows = []
    for low, high in zip(STEPS[:-1], STEPS[1:]):
        some = (every >= low) & (every < high)
        if some.any():
            trust = boost.TRUST[every[some]]
            rows.append([f"{boost.TRUST[low]:.3f}" + (f" to {boost.TRUST[high - 1]:.3f}" if high > low + 1 else ""),
                         f"{100.0 * weight[some].sum() / len(names):.2f}", f"{share(trust, weight[some]):.3f}",
                         f"{share(right[some], weight[some]):.3f}"])
    third = table(["trust", "of samples %", "mean trust", "share that is right"], rows)
    return "\n\n".join((first, second, third))


def main() -> int:
    from truth.scans import campaigns
    from truth.trust import train
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", help="of features, or plain")
    parser.add_argument("--scenes", default="unseen")
    parser.add_argument("--trees", type=int, default=train.TREES)
    parser.add_argument("--in-force", action="store_true")
    options = parser.parse_args()
    folder, names = None if options.folder == "plain" else Path(options.folder), train.names_of_features(options.folder)
    if options.in_force:
        model = constants.read(constants.CONSTANTS.read_text())
        others = samples.load_all([one.name for one in campaigns.group(options.scenes)], folder, len(names))
        print(tables(others, {name: model.judged(one.values) for name, one in others.items()}, model.calibration, model.limit))
        return 0
    known = samples.load_all(samples.checked([one.name for one in campaigns.group("trained")]), folder, len(names))
    forest, calibration, limit, _ = train.model(known, options.trees)
    others = samples.load_all([one.name for one in campaigns.group(options.scenes)], folder, len(names))
    print(tables(others, {name: forest.score(boost.binned(one.values, forest.edges)) for name, one in others.items()},
                 calibration, limit))
    return 0


if __name__ == "__main__":
    sys.exit(main())
