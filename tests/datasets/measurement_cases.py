"""One measurement of every kind of an orbit that is known in closed form."""

from dataclasses import replace

import numpy as np

from unmodeled.datasets.measurements import Measurements
from unmodeled.datasets.refraction import Refraction
from unmodeled.datasets.relativistic_delay import RelativisticDelay
from unmodeled.datasets.station import Station, UniformRotation
from unmodeled.datasets.troposphere import Troposphere

GM = 3.986004418e14
EPOCH = "2016-03-13T06:00:00 UTC"
TIMES = np.linspace(0.0, 900.0, 7)
STATION = Station.from_geodetic("YARL", -29.05, 115.35, 241.0)
BODY = Station("rover", np.array([2e6, 1e6, -3e6]), UniformRotation(7e-5, 0.3))


def orbit(times):
    """States and accelerations on an inclined circle of 8000 km."""
    r, n = 8.0e6, np.sqrt(GM / 8.0e6**3)
    u = n * np.asarray(times) + 0.4
    p, q = np.array([0.2, 0.9, -0.3]), np.array([0.5, 0.1, 0.8])
    p = p / np.linalg.norm(p)
    q = q - p * (p @ q)
    q = q / np.linalg.norm(q)
    c, s = np.cos(u)[:, None], np.sin(u)[:, None]
    position = r * (c * p + s * q)
    return np.hstack([position, r * n * (c * q - s * p)]), -(n**2) * position


SIGMA = {
    "position": 1.0,
    "position_velocity": [1.0, 1e-3],
    "range": 1.0,
    "range_rate": 1e-3,
    "right_ascension_declination": 1e-5,
    "azimuth_elevation": 1e-5,
}
COLUMNS = {"position": 3, "position_velocity": 6, "range": 1, "range_rate": 1}
_R, _A = {"ways": 2}, "right_ascension_declination"
FAR = (6e4, -4e4, 7e4)
AIR = ((Troposphere().correction, 3e3), (RelativisticDelay().correction, 1e6))
#: name -> (kind, settings).
CASES = {
    "position": ("position", {}),
    "position, ITRF": ("position", {"axes": "earth_fixed", "rotation": (1e-3, -2e-3, 3e-3)}),
    "state": ("position_velocity", {"rotation": (0.1, -0.2, 0.3), "scale": 1.1}),
    "state, ITRF": ("position_velocity", {"axes": "earth_fixed"}),
    "range": ("range", {"station": STATION}),
    "range, light": ("range", {"station": STATION, "light_time": True, "gm": GM, "scale": 1.01}),
    "range, two ways": ("range", {"station": STATION, "light_time": True, "gm": GM, **_R}),
    "range, other body": ("range", {"station": BODY, "light_time": True}),
    "rate": ("range_rate", {"station": STATION}),
    "rate, light": ("range_rate", {"station": STATION, "light_time": True, "gm": GM}),
    "rate, two ways": ("range_rate", {"station": STATION, "light_time": True, "gm": GM, **_R}),
    "rate, some light": ("range_rate", {"station": BODY, "light_time": 0.3, "gm": GM}),
    "radec, centre": (_A, {"rotation": (0.1, 0.2, -0.1)}),
    "radec": (_A, {"station": STATION, "light_time": True, "gm": GM, "astrometric": True}),
    "azel": ("azimuth_elevation", {"station": STATION}),
    # An antenna on a mast of 100 km and air a thousand times too thick, or they would not be seen.
    "position, antenna": ("position", {"antenna": FAR, "rotation": (0.1, 0.2, 0.3)}),
    "state, antenna": ("position_velocity", {"antenna": FAR}),
    "radec, antenna": (_A, {"station": STATION, "light_time": True, "gm": GM, "antenna": FAR}),
    "range, air": ("range", {"station": STATION, "corrections": AIR, "antenna": FAR}),
    "rate, air": ("range_rate", {"station": STATION, "corrections": AIR, "light_time": True}),
    "azel, air": (
        "azimuth_elevation",
        {"station": STATION, "corrections": ((Refraction().correction, 30.0),), "antenna": FAR},
    ),
    "azel, light": ("azimuth_elevation", {"station": BODY, "light_time": 0.5, "gm": GM}),
}


def measurement(name, times=TIMES):
    kind, settings = CASES[name]
    values = np.zeros((len(times), COLUMNS.get(kind, 2)))
    m = Measurements(kind, times, values, SIGMA[kind], name, epoch=EPOCH, **settings)
    return replace(m, values=m.observed(orbit(times)[0]))
