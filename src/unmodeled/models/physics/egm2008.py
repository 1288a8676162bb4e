"""The Earth's published gravity field EGM2008, as heyoka carries it."""

from __future__ import annotations

from heyoka import model

from unmodeled.core.errors import ConfigError
from unmodeled.models.physics.spherical_harmonics import coefficient_names

__all__ = ["egm2008_values"]

#: Highest degree of the published field.
TOP_DEGREE = 2190


def egm2008_values(degree: int, order: int | None = None, min_degree: int = 2) -> dict[str, float]:
    """Return the values of a `SphericalHarmonics` effect of the same degrees, SI.

    Fully normalised coefficients of EGM2008 [Pavlis2012], tide-free, with their GM (m3 s-2, of
    Terrestrial Time) and reference radius (m).

    Parameters
    ----------
    degree, order, min_degree : int
        As in `SphericalHarmonics`.

    Raises
    ------
    ConfigError
        If the degree is above 2190.

    Examples
    --------
    >>> values = egm2008_values(2)
    >>> values["C_2_0"], values["R_ref"]
    (-0.000484165143790815, 6378136.3)
    """
    if degree > TOP_DEGREE:
        raise ConfigError(f"degree {degree} of EGM2008", allowed=f"up to {TOP_DEGREE}")
    table = model.get_egm2008_CS()
    values = {"GM": float(model.get_egm2008_mu()), "R_ref": float(model.get_egm2008_a())}
    for name in coefficient_names(degree, order, min_degree):
        kind, n, m = name.split("_")
        if int(n) < 2:
            values[name] = 1.0 if name == "C_0_0" else 0.0
        else:
            # rows by degree, then order, from degree 2 on
            row = int(n) * (int(n) + 1) // 2 + int(m) - 3
            values[name] = float(table[row, "CS".index(kind)])
    return values
