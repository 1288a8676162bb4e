"""Which learners of a sweep must not be used: the bare point mass does better elsewhere."""

from __future__ import annotations

import numpy as np
import pandas as pd

from unmodeled.pipeline.use_check import DO_NOT_USE, UNFIT_RATIO

__all__ = ["add_use"]

_RATIO = "extrapolation_over_point_mass"


def add_use(medians: pd.DataFrame, table: pd.DataFrame) -> pd.DataFrame:
    """Return the medians with ``over_point_mass`` and ``use``.

    ``over_point_mass`` is the median over the runs of the extrapolation error over that of the
    bare point mass, failed runs infinite; ``use`` is ``do not use`` above 2, ``passes`` below,
    and ``not known`` for runs of a version that did not compare.

    Parameters
    ----------
    medians : DataFrame
        With a column ``learner``.
    table : DataFrame
        From `sweep`.
    """
    ratios = []
    for learner in medians["learner"]:
        own = table[table["learner"] == learner]
        known = own.get(_RATIO, pd.Series(np.nan, index=own.index)).astype(float)
        known = known.where(own["failure"] == "", np.inf).dropna()
        # "lower" takes a value that is there: no inf - inf between failures.
        some = bool(np.isfinite(known).any()) or (len(known) == len(own) > 0)
        ratios.append(float(np.quantile(known, 0.5, method="lower")) if some else np.nan)
    words = [
        "not known" if np.isnan(r) else DO_NOT_USE if r > UNFIT_RATIO else "passes" for r in ratios
    ]
    return medians.assign(over_point_mass=ratios, use=words)
