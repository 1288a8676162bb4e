"""Equations of motion as filters use them: rates and Jacobians in numpy, batched over runs.

An effect (`unmodeled.models.physics`) is a force as symbols, and compiled code makes orbits of it.
A filter steps a hundred runs at once through thousands of epochs; for that these few closed forms
are faster, and each is tested against the symbols.
"""

from unmodeled.models.physics.motion.central_body import CentralBody
from unmodeled.models.physics.motion.clohessy_wiltshire import ClohessyWiltshire
from unmodeled.models.physics.motion.measured_reference import MeasuredReference
from unmodeled.models.physics.motion.reference_orbit import ReferenceOrbit, reference_variables
from unmodeled.models.physics.motion.three_body import RestrictedThreeBody
from unmodeled.models.physics.motion.xu_wang import XuWang

__all__ = [
    "CentralBody",
    "ClohessyWiltshire",
    "MeasuredReference",
    "ReferenceOrbit",
    "RestrictedThreeBody",
    "XuWang",
    "reference_variables",
]
