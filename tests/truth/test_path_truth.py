"""Air, gravity and antennas on a signal's way, against values that others published."""

import erfa
import numpy as np
import pytest

from unmodeled.datasets.measurements import Measurements
from unmodeled.datasets.refraction import Refraction
from unmodeled.datasets.relativistic_delay import RelativisticDelay
from unmodeled.datasets.station import Station
from unmodeled.datasets.troposphere import Troposphere

EPOCH, TIME = "2009-08-12T00:00:00 UTC", np.zeros(1)
STATION = Station.from_geodetic("GBT", 38.437847, -79.835820, 844.715)


def seen(elevation, distance, kind="range"):
    """One measurement from the station at an elevation (degrees), and its state."""
    columns = 1 if kind == "range" else 2
    m = Measurements(kind, TIME, np.zeros((1, columns)), 1.0, "one", STATION, EPOCH)
    north, _, up = m.track.north_east_up[0]
    e = np.radians(elevation)
    line = distance * (np.cos(e) * north + np.sin(e) * up)
    return m, np.concatenate([m.track.positions[0] + line, [1e3, 2e3, 3e3]])[None]


def added(effect, elevation, distance, kind="range"):
    m, state = seen(elevation, distance, kind)
    values = {effect.parameters[0].name: 1.0}
    return float((effect.applied(m, values).predicted(state) - m.predicted(state))[0, -1])


def test_mapping_function():
    """The test case of the IERS Conventions' GMF.F and VMF1.F: hydrostatic part, Green Bank."""
    elevation = 90.0 - np.degrees(1.278564131)
    got = added(Troposphere(), elevation, 2e7)
    assert got == pytest.approx(3.425245519339138678, rel=0.003)  # GMF
    assert got == pytest.approx(3.424342122738070593, rel=0.003)  # VMF1
    assert got == pytest.approx(3.449589116182419257, rel=0.005)  # GMF, wet
    assert added(Troposphere(), 90.0, 2e7) == pytest.approx(1.0, abs=1e-6)


@pytest.mark.parametrize("elevation", [5.0, 10.0, 20.0, 45.0, 70.0])
def test_refraction(elevation):
    """SOFA's refco: 1010 hPa, 10 C, dry, 0.574 micrometres, good to a few arc seconds here."""
    a, b = erfa.refco(1010.0, 10.0, 0.0, 0.574)
    true = np.radians(90.0 - elevation)
    apparent = true
    for _ in range(50):
        apparent = true - (a * np.tan(apparent) + b * np.tan(apparent) ** 3)
    got = added(Refraction(), elevation, 2e9, "azimuth_elevation")
    assert got == pytest.approx(true - apparent, rel=0.055)  # the formula's own offset
    # The formula as it is published, [Meeus1998] Eq. 16.4; the soft floor moves it by 0.3 %.
    plain = 1.02 / 60 / np.tan(np.radians(elevation + 10.3 / (elevation + 5.11)))
    assert got == pytest.approx(np.radians(plain), rel=0.003)


def test_relativistic_delay():
    """Less than 2 cm for GPS [Ashby2003]; overhead it is the integral of 2 GM / (c^2 r)."""
    radius = float(np.linalg.norm(STATION.position))
    gps = 2.656e7
    overhead = added(RelativisticDelay(), 90.0, gps - radius)
    schwarzschild = 0.008870056  # m, diameter 2 GM / c^2 of the Earth
    assert overhead == pytest.approx(schwarzschild * np.log(gps / radius), rel=1e-4)
    low = added(RelativisticDelay(), 5.0, 2.5e7)
    assert overhead < low
    assert 0.017 < low < 0.02
    moon = added(RelativisticDelay(), 30.0, 3.844e8)
    lageos = [added(RelativisticDelay(), e, d) for e, d in ((90.0, 5.85e6), (10.0, 8.9e6))]
    print(f"LAGEOS {1e3 * lageos[0]:.1f} to {1e3 * lageos[1]:.1f} mm, Moon {1e3 * moon:.1f} mm")
    assert 0.035 < moon < 0.045
