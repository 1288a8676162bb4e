"""Print the tables of the hidden-effect suite from its results.

python benchmarks/hidden_effects/summary.py [results.jsonl] [--out summary.md]
"""

from __future__ import annotations

import argparse
import json
from collections import Counter
from pathlib import Path

import numpy as np
import scipy.stats

HERE = Path(__file__).parent


def main() -> None:
    """Read, count, print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("results", type=Path, nargs="?", default=HERE / "results.jsonl")
    parser.add_argument("--out", type=Path)
    args = parser.parse_args()
    rows = [json.loads(line) for line in args.results.read_text().splitlines() if line]
    text = report(rows)
    print(text)
    if args.out:
        args.out.write_text(text + "\n")


def report(rows: list[dict]) -> str:
    """Return all tables as Markdown."""
    failed = [r for r in rows if "failure" in r]
    good = [r for r in rows if "failure" not in r]
    parts = [f"# Hidden-effect suite: {len(rows)} cases, {len(failed)} failures", ""]
    for r in failed:
        parts.append(f"- {r['key']}: {r['failure'][:160]}")
    parts += ["", *false_alarms(good), "", *strengths(good), "", *coverage(good), ""]
    parts += [
        *several(good),
        "",
        *held_out(good),
        "",
        *others(good),
        "",
        *floors(good),
        "",
        *sizes(good),
        "",
    ]
    parts += [*confusion(good), "", *times(good)]
    return "\n".join(parts)


def false_alarms(rows: list[dict]) -> list[str]:
    """Count findings where nothing is missing, with the binomial interval of the set level."""
    out = ["## Nothing hidden", "", "| noise as stated | cases | named an effect | remainder only |"
           " allowed at 1 % (99 % of draws) |", "|---|---|---|---|---|"]  # fmt: skip
    for factor in (1.0, 2.0):
        some = [r for r in rows if r["kind"] == "none" and r["noise_factor"] == factor]
        if not some:
            continue
        named = sum(bool(r["found"]) for r in some)
        only = sum(not r["found"] and r["verdict"] != "nothing missing" for r in some)
        limit = int(scipy.stats.binom.ppf(0.995, len(some), 0.01))
        out.append(f"| times {factor:g} | {len(some)} | {named} | {only} | 0 to {limit} |")
    return out


def strengths(rows: list[dict]) -> list[str]:
    """One hidden effect: detection beside the optimum, label right."""
    out = ["## One effect hidden", "",
           "| lambda | noise | cases | detected | optimum | first | ideal first |"
           " first or in its class | right of those detected | nothing else named |",
           "|---|---|---|---|---|---|---|---|---|---|"]  # fmt: skip
    one = [r for r in rows if r["kind"] == "one"]
    for strength, factor in sorted({(r["strengths"][0], r["noise_factor"]) for r in one}):
        some = [r for r in one if (r["strengths"][0], r["noise_factor"]) == (strength, factor)]
        n = len(some)
        detected = [bool(r["found"]) for r in some]
        first = [right_first(r) for r in some]
        inside = [right_class(r) for r in some]
        alone = [len(r["found"]) == 1 for r in some]
        optimum = np.mean([best_power(r) for r in some])
        given = sum(inside) / max(sum(detected), 1)
        out.append(
            f"| {strength:g} | times {factor:g} | {n} | {np.mean(detected):.3f} | {optimum:.3f} |"
            f" {np.mean(first):.3f} | {best_choice(some)} | {np.mean(inside):.3f} | {given:.3f} |"
            f" {np.mean(alone):.3f} |"
        )
    return out


def best_choice(rows: list[dict]) -> str:
    """Return the mean chance of the best possible choice of the label (`ideal` of the suite)."""
    known = [r["ideal"] for r in rows if r.get("ideal") is not None]
    return f"{np.mean(known):.3f}" if known else "-"


def best_power(r: dict) -> float:
    """Power of the test of the true effect alone at the threshold of the whole set."""
    name = next(iter(r["truth"]))
    k = r["sizes"].get(name, 1)
    limit = scipy.stats.chi2.isf(np.exp(r["log_p_limit"]), k)
    strength = r["strengths"][0] / r["noise_factor"] ** 2
    return float(scipy.stats.ncx2.sf(limit, k, strength))


def right_first(r: dict) -> bool:
    """Say whether the first finding is the hidden effect."""
    return bool(r["found"]) and r["found"][0]["name"] == next(iter(r["truth"]))


def right_class(r: dict) -> bool:
    """Say whether the hidden effect is in the class of the first finding."""
    return bool(r["found"]) and next(iter(r["truth"])) in r["found"][0]["class"]


def coverage(rows: list[dict]) -> list[str]:
    """Estimated parameters within three sigma of the truth."""
    pulls = []
    for r in rows:
        if r["kind"] not in ("one", "two", "three"):
            continue
        if {f["name"] for f in r["found"]} != set(r["truth"]):
            continue
        for f in r["found"]:
            for name, (value, sigma) in f["estimates"].items():
                pulls.append((value - r["truth"][f["name"]][name]) / sigma)
    pulls = np.array(pulls)
    if not len(pulls):
        return []
    return ["## Parameters (cases with the exact set)", "",
            f"{len(pulls)} parameters: {np.mean(np.abs(pulls) < 3):.4f} within 3 sigma, "
            f"{np.mean(np.abs(pulls) < 1):.3f} within 1 sigma (normal: 0.9973 and 0.683); "
            f"RMS pull {np.sqrt(np.mean(pulls**2)):.2f}"]  # fmt: skip


def several(rows: list[dict]) -> list[str]:
    """Two and three hidden effects at once."""
    out = ["## Several effects hidden (each lambda >= 100)", "",
           "| hidden | cases | exact set | ideal | exact up to classes |"
           " exact, or among the sets reported as good |", "|---|---|---|---|---|---|"]  # fmt: skip
    for kind in ("two", "three"):
        some = [r for r in rows if r["kind"] == kind]
        if not some:
            continue
        exact = [{f["name"] for f in r["found"]} == set(r["truth"]) for r in some]
        classes = [up_to_classes(r) for r in some]
        listed = [up_to_classes(r) or among_alternatives(r) for r in some]
        out.append(f"| {kind} | {len(some)} | {np.mean(exact):.3f} | {best_choice(some)} |"
                   f" {np.mean(classes):.3f} | {np.mean(listed):.3f} |")  # fmt: skip
    sets = [len(r.get("alternatives", ())) for r in rows if r["kind"] in ("two", "three")]
    if sets:
        out += [
            "",
            f"Other sets reported: median {np.median(sets):.0f}, at most {max(sets)}. Ideal: the "
            "chance that the true set fits best among exchanges of one effect.",
        ]
    return out


def up_to_classes(r: dict) -> bool:
    """Each finding's class holds another one of the hidden effects, and none is left."""
    import itertools

    truth, found = list(r["truth"]), r["found"]
    if len(truth) != len(found):
        return False
    return any(
        all(t in f["class"] for t, f in zip(order, found, strict=True))
        for order in itertools.permutations(truth)
    )


def among_alternatives(r: dict) -> bool:
    """Say whether the hidden set is one of those that are reported to explain as much."""
    return any(set(a) == set(r["truth"]) for a in r.get("alternatives", ()))


def held_out(rows: list[dict]) -> list[str]:
    """Residuals of arcs on other orbits, beside what the covariance foretells."""
    some = [r for r in rows if r.get("forecast") and r["found"]]
    right = [r for r in some if {f["name"] for f in r["found"]} == set(r["truth"])]
    if not right:
        return []
    out = [
        "## Held-out arcs on another orbit",
        "",
        "| cases | number | after: RMS / foretold, median (5 % to 95 %) |"
        " larger than foretold at 1 % | before: RMS / foretold |",
        "|---|---|---|---|---|",
    ]
    for label, part in (("exact set", right), ("all with a finding", some)):
        after = np.array([r["held_out"][1] / r["forecast"][1] for r in part])
        before = np.array([r["held_out"][0] / r["forecast"][0] for r in part])
        low, high = np.quantile(after, [0.05, 0.95])
        beyond = np.mean([r["forecast"][2] is not None and r["forecast"][2] < -2 for r in part])
        out.append(f"| {label} | {len(part)} | {np.median(after):.3f} ({low:.3f} to {high:.3f}) |"
                   f" {beyond:.3f} | {np.median(before):.3f} |")  # fmt: skip
    return out


def others(rows: list[dict]) -> list[str]:
    """Effects outside the catalogue, and instruments."""
    out = ["## Outside the catalogue, and instruments", ""]
    some = [r for r in rows if r["kind"] == "outside"]
    if some:
        says = [r["verdict"] == "outside the catalogue" for r in some]
        named = [bool(r["found"]) for r in some]
        out.append(f"- outside: {np.mean(says):.3f} of {len(some)} cases say so; an effect of the "
                   f"catalogue is also named in {np.mean(named):.3f}")  # fmt: skip
    some = [r for r in rows if r["kind"] == "instrument"]
    if some:
        out.append(f"- instruments: {np.mean([right_first(r) for r in some]):.3f} of {len(some)} "
                   f"named first, {np.mean([right_class(r) for r in some]):.3f} first or in its "
                   "class")  # fmt: skip
    return out


def floors(rows: list[dict]) -> list[str]:
    """Residual RMS after the additions against the noise."""
    some = [r for r in rows if r["found"] and r["verdict"] in ("found", "ambiguous")]
    ratio = np.array([r["rms"][-1] / r["noise_factor"] for r in some])
    if not len(ratio):
        return []
    return ["## Residuals after what was found is added", "",
            f"{len(ratio)} cases: RMS / true noise from {ratio.min():.3f} to {ratio.max():.3f}; "
            f"{np.mean(np.abs(ratio - 1) < 0.05):.3f} within 5 %"]  # fmt: skip


def sizes(rows: list[dict]) -> list[str]:
    """How large the classes are."""
    counts = Counter(len(f["class"]) for r in rows for f in r["found"] if r["kind"] == "one")
    cells = ", ".join(f"{k}: {n}" for k, n in sorted(counts.items()))
    return ["## Sizes of the classes (one effect hidden)", "", cells]


def confusion(rows: list[dict]) -> list[str]:
    """Count what was named for what was hidden."""
    out = ["## Confusion (one effect hidden, detected): hidden -> named first", "",
           "| hidden | cases | right first | right class | named instead, class wrong |",
           "|---|---|---|---|---|"]  # fmt: skip
    by: dict[str, list[dict]] = {}
    for r in rows:
        if r["kind"] in ("one", "instrument") and r["found"]:
            by.setdefault(next(iter(r["truth"])), []).append(r)
    for name, some in sorted(by.items()):
        wrong = Counter(r["found"][0]["name"] for r in some if not right_class(r))
        text = ", ".join(f"{k} ({n})" for k, n in wrong.most_common())
        out.append(f"| {name} | {len(some)} | {sum(map(right_first, some))} |"
                   f" {sum(map(right_class, some))} | {text} |")  # fmt: skip
    return out


def times(rows: list[dict]) -> list[str]:
    """Wall time a case."""
    out = ["## Time of a diagnosis, s (compilations included)", "",
           "| scenario | cases | median | largest |", "|---|---|---|---|"]  # fmt: skip
    for name in sorted({r["scenario"] for r in rows}):
        t = [r["diagnose_s"] for r in rows if r["scenario"] == name]
        out.append(f"| {name} | {len(t)} | {np.median(t):.1f} | {max(t):.1f} |")
    return out


if __name__ == "__main__":
    main()
