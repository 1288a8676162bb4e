"""Answers to Figs. 10 and 11 of [Neamati2022]: two models at moderate data volume, no noise."""

from __future__ import annotations

import numpy as np

from unmodeled.core.arrays import Array
from unmodeled.core.errors import DataError
from unmodeled.pipeline.trends.log_fit import LogFit
from unmodeled.reports.figures.train_against_test import fits_of
from unmodeled.reports.numbers import number, seconds_text
from unmodeled.reports.reproduction.compared import Found
from unmodeled.reports.reproduction.published import PublishedFigure
from unmodeled.reports.sweep_view import SweepView

__all__ = ["answer_fig10", "answer_fig11", "pair_of", "slower"]

_HALF_DECADE = 10**0.5


def pair_of(view: SweepView) -> tuple[str, str]:
    """Return the labels of the exact GP and of the spectral network of a sweep.

    Raises
    ------
    DataError
        If the runs hold no such learners.
    """
    labels = []
    for kind in ("exact_gp", "spectral_mlp"):
        mine = view.table[view.table["kind"] == kind]["learner"]
        if mine.empty:
            raise DataError(
                f"{view.name} has no finished run of a learner of kind {kind}",
                do="finish the sweep, or give the folder of another with --store",
            )
        labels.append(str(mine.iloc[0]))
    return labels[0], labels[1]


def answer_fig10(view: SweepView, figure: PublishedFigure) -> dict[str, Found]:
    """Return what the head-to-head comparison says."""
    gp, network = pair_of(view)
    ratios = {
        name: _middle(view.errors(network, f"{name}_median"))
        / _middle(view.errors(gp, f"{name}_median"))
        for name in ("interpolation", "extrapolation")
    }
    low = figure.statements["outliers"].values["low"]
    high = {
        n: int(np.sum(view.errors(gp, f"{n}_median") > low)) for n in ("train", "interpolation")
    }
    failed = int((view.table[view.table["learner"] == gp]["failure"] != "").sum())
    count = int((view.table["learner"] == gp).sum())
    gaps = {x: _gap(view, x) for x in (gp, network)}
    span = figure.statements["gap"].values
    return {
        "comparable": Found(
            f"{network} over {gp}: median error ratio {number(ratios['interpolation'])} "
            f"(interpolation), {number(ratios['extrapolation'])} (extrapolation)",
            all(1 / _HALF_DECADE < r < _HALF_DECADE for r in ratios.values()),
            "Rule: within half a decade in both. "
            + (
                f"{gp} is trained to the optimum of its likelihood here, where the paper takes a "
                "fixed number of Adam steps."
                if ratios["interpolation"] > _HALF_DECADE
                else ""
            ),
        ),
        "outliers": Found(
            f"{high['train']} of {count} runs of {gp} have a training error above 10^-0.5, "
            f"{high['interpolation']} an interpolation error; {failed} fits failed",
            bool(high["train"] or high["interpolation"] or failed),
            "Double precision, stated noise floor, jitter only where the Cholesky factor needs it "
            "and reported. What caused the paper's outliers is not shown by their absence here.",
        ),
        "gap": Found(
            ", ".join(f"{x} {g:.1f} decades" for x, g in gaps.items()),
            all(span["low"] <= g <= span["high"] for g in gaps.values()),
            "Mean over runs of log10 (extrapolation / interpolation error). A larger gap comes "
            "from a smaller interpolation error: a model that has learned nothing elsewhere has an "
            "error of about 1 there."
            if any(g > span["high"] for g in gaps.values())
            else "Mean over runs of log10 (extrapolation / interpolation error).",
        ),
        "slower": slower(view, gp, network, None),
    }


def answer_fig11(view: SweepView, figure: PublishedFigure) -> dict[str, Found]:
    """Return what the fitted lines say."""
    found = {}
    for word, label in zip(("gp", "network"), pair_of(view), strict=True):
        fits = fits_of(view, label)
        train = view.errors(label, "train_median")
        kept = train[np.isfinite(train) & (train > 0)]
        span = float(np.log10(kept.max() / kept.min())) if len(kept) else 0.0
        for name in ("interpolation", "extrapolation"):
            key = f"{word}_{name}"
            values = dict(figure.statements[key].values)
            found[key] = _line(name, label, fits[name], values, span)
    return found


def slower(view: SweepView, gp: str, network: str, ratio: float | None) -> Found:
    """Compare times of training and evaluation; ``ratio`` is the paper's for training."""
    times = {}
    for name in ("cost_train_s", "cost_evaluate_one_s"):
        if name not in view.table:
            return Found("times are not in the table", None)
        times[name] = [
            float(view.table[view.table["learner"] == x][name].median()) for x in (gp, network)
        ]
    (gp_train, network_train), (gp_one, network_one) = times.values()
    ours = (
        f"training {seconds_text(gp_train)} ({gp}) and {seconds_text(network_train)} ({network}), "
        f"ratio {number(gp_train / network_train)}; one evaluation {seconds_text(gp_one)} and "
        f"{seconds_text(network_one)}"
    )
    remark = (
        "Wall times of this sweep's machine and optimisers: the Gaussian process by its likelihood "
        "with closed-form gradients to the optimum, the paper by Adam for a fixed number of epochs."
    )
    if ratio is not None:
        agrees = ratio / 2 < gp_train / network_train < 2 * ratio
        return Found(ours, agrees, f"Rule: within a factor of two. {remark}")
    return Found(ours, gp_train > network_train and gp_one > network_one, remark)


def _line(
    name: str, label: str, fit: LogFit | None, values: dict[str, float], span: float
) -> Found:
    if fit is None:
        return Found(f"{label}: fewer than three runs with different errors", None)
    ours = (
        f"{label}: slope {fit.slope:.4f} ± {fit.slope_sigma:.4f}, intercept {fit.intercept:.4f}, "
        f"R² = {fit.r_squared:.4f} ({fit.count} runs)"
    ).replace("-", "−")
    if name == "extrapolation":
        agrees = fit.r_squared < 0.5
        remark = "Rule: R² below one half, no correlation to use."
        if abs(fit.r_squared - values["r_squared"]) > 0.1:
            remark += (
                f" The paper's {values['r_squared']:g} goes with its outliers, as it says itself."
                if values["r_squared"] > 0.1
                else f" The paper has {values['r_squared']:g}; with {fit.count} runs R² of "
                f"uncorrelated errors scatters by about {1 / max(fit.count - 1, 1):.2g}."
            )
        return Found(ours, agrees, remark)
    near = abs(fit.slope - values["slope"]) < max(3 * fit.slope_sigma, 0.05)
    agrees = near and fit.r_squared > 0.98
    remark = "Rule: slope within three standard errors (or 0.05), R² above 0.98."
    if not agrees:
        remark += (
            f" Our training errors span {span:.1f} decades only; R² compares the scatter of the "
            "runs with that span, and a few outliers over several decades, as in the paper, "
            "bring both slope and R² to one."
        )
    return Found(ours, agrees, remark)


def _gap(view: SweepView, label: str) -> float:
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.log10(
            view.errors(label, "extrapolation_median") / view.errors(label, "interpolation_median")
        )
    return float(np.mean(ratio[np.isfinite(ratio)]))


def _middle(values: Array) -> float:
    return float(np.quantile(values, 0.5, method="lower"))
