"""Where over the body the model fails: longitude and latitude."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from unmodeled.core.arrays import Array
from unmodeled.pipeline.comparison.result import Comparison
from unmodeled.reports.numbers import engineering
from unmodeled.reports.style import figure_style, new_figure

__all__ = ["comparison_place"]


def comparison_place(comparison: Comparison) -> Figure:
    """Draw the orbit over the body; colour is how large residual and acceleration are.

    The upper panel has the size of the residuals at each epoch in sigmas (root mean square of its
    components), the lower one that of the reconstructed acceleration, where there is one.
    """
    used = comparison.residuals[comparison.residuals["used"]]
    keys = ["arc", "t_s"]
    epochs = used.groupby(keys, sort=False)[["longitude", "latitude"]].first()
    size = np.sqrt((used.assign(s=used["normalised"] ** 2)).groupby(keys, sort=False)["s"].mean())
    force = comparison.force
    panels: list[tuple[Array, Array, Array, str]] = [
        (
            epochs["longitude"].to_numpy(),
            epochs["latitude"].to_numpy(),
            size.to_numpy(),
            "residual, sigmas",
        )
    ]
    if force.prior_sigma > 0:
        table = force.table
        total = np.linalg.norm(table[list("RTN")].to_numpy(), axis=1)
        factor, prefix = engineering(float(total.max()))
        longitude, latitude = table["longitude"].to_numpy(), table["latitude"].to_numpy()
        panels.append((longitude, latitude, total * factor, f"acceleration, {prefix}m/s²"))
    with figure_style():
        figure = new_figure(0.3 + 2.4 * len(panels))
        axes = figure.subplots(len(panels), sharex=True, squeeze=False)[:, 0]
        for a, (longitude, latitude, colour, label) in zip(axes, panels, strict=True):
            order = np.argsort(colour)
            points = a.scatter(
                np.degrees(longitude)[order],
                np.degrees(latitude)[order],
                c=colour[order],
                s=10 if len(colour) > 200 else 26,
                cmap="viridis",
                vmin=0.0,
                vmax=float(np.quantile(colour, 0.99)) or 1.0,
                linewidths=0,
                rasterized=True,
            )
            figure.colorbar(points, ax=a, label=label, extend="max", pad=0.02)
            a.set_xlim(0, 360)
            a.set_ylim(-90, 90)
            a.set_xticks(range(0, 361, 60))
            a.set_yticks(range(-90, 91, 45))
            a.set_ylabel("latitude, °")
        turned = "body-fixed" if np.isfinite(comparison.spin_period) else "inertial"
        axes[-1].set_xlabel(f"{turned} longitude, °")
    return figure
