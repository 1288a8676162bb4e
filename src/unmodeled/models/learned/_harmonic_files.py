"""A learned field as a published one (`GravityField`, SI), and back."""

from __future__ import annotations

import numpy as np

from unmodeled.core.errors import InputError
from unmodeled.core.units import NormalisedUnits
from unmodeled.models.learned._harmonic_field import UncertainField
from unmodeled.models.physics.exterior_harmonics import column_names
from unmodeled.models.physics.gravity_file import GravityField

__all__ = ["from_published", "to_published"]


def to_published(
    learner: str, own: UncertainField, units: NormalisedUnits, baseline_gm: float
) -> GravityField:
    """Return a field with formal errors; arguments as `HarmonicGP.gravity_field`."""
    mean, root = own.mean.copy(), own.root
    mean[0] += baseline_gm / own.gm
    if mean[0] <= 0:
        raise InputError(
            f"{learner}: the mass found is {mean[0]:.3g} of the reference",
            allowed="a positive mass",
            do="give the point mass that was taken off the samples as baseline_gm",
        )
    ratios = mean / mean[0]
    errors = (root - ratios[:, None] * root[0]) / mean[0]
    errors[0] = root[0] / mean[0]
    names = column_names(own.degree)
    return GravityField(
        gm=mean[0] * own.gm * units.length**3 / units.time**2,
        radius=own.radius * units.length,
        coefficients=dict(zip(names, map(float, ratios), strict=True)),
        errors=dict(zip(names, map(float, np.linalg.norm(errors, axis=1)), strict=True)),
    )


def from_published(field: GravityField, units: NormalisedUnits) -> UncertainField:
    """Return a published field in units of samples; its errors are independent."""
    degree = max(1, *(int(name.split("_")[1]) for name in field.coefficients))
    names = column_names(degree)
    values = {"C_0_0": 1.0} | field.coefficients
    return UncertainField(
        degree,
        field.gm * units.time**2 / units.length**3,
        field.radius / units.length,
        np.array([values.get(name, 0.0) for name in names]),
        np.diag([field.errors.get(name, 0.0) for name in names]),
    )
