"""Time scales: published offsets, leap seconds, and what is refused."""

import numpy as np
import pytest
from astropy.utils import iers

from unmodeled.core.errors import DataError, UnmodeledWarning
from unmodeled.core.time import (
    convert_epoch,
    elapsed_from_calendar,
    elapsed_from_dates,
    parse_epoch,
    seconds_between,
    terrestrial_time,
)


@pytest.mark.parametrize(
    ("scale", "date"),
    [
        # TAI - UTC = 36 s in 2016, GPS = TAI - 19 s, TT = TAI + 32.184 s.
        ("TAI", "2016-03-13T00:00:36 TAI"),
        ("GPS", "2016-03-13T00:00:17 GPS"),
        ("TT", "2016-03-13T00:01:08.184 TT"),
        ("UTC", "2016-03-13T00:00:00 UTC"),
    ],
)
def test_scales_differ_by_the_published_offsets(scale, date):
    assert convert_epoch("2016-03-13T00:00:00 UTC", scale) == date
    assert seconds_between("2016-03-13T00:00:00 UTC", date) == 0.0


def test_tdb_differs_from_tt_by_less_than_two_milliseconds():
    date = convert_epoch("2016-03-13T00:00:00 TT", "TDB").removesuffix(" TDB")
    offset = seconds_between(f"{date} TT", "2016-03-13T00:00:00 TT")
    assert 0 < abs(offset) < 2e-3


def test_a_leap_second_is_counted():
    assert seconds_between("2016-12-31T23:59:59 UTC", "2017-01-01T00:00:00 UTC") == 2.0
    rows = [[2016, 12, 31, 23, 59, 59], [2016, 12, 31, 23, 59, 60], [2017, 1, 1, 0, 0, 0]]
    epoch, times = elapsed_from_calendar(rows, "UTC")
    assert epoch == "2016-12-31T23:59:59 UTC"
    np.testing.assert_array_equal(times, [0, 1, 2])
    # GPS time knows no leap second: the same calendar step is one second shorter.
    _, gps = elapsed_from_calendar([rows[0], rows[2]], "GPS")
    np.testing.assert_array_equal(gps, [0, 1])


def test_dates_and_calendar_rows_agree():
    dates = [f"2016-03-13T00:{m:02d}:00Z" for m in range(0, 60, 2)]
    epoch, times = elapsed_from_dates(dates, "utc")
    rows = [[2016, 3, 13, 0, m, 0] for m in range(0, 60, 2)]
    assert elapsed_from_calendar(rows, "UTC")[0] == epoch
    np.testing.assert_array_equal(times, elapsed_from_calendar(rows, "UTC")[1])
    np.testing.assert_array_equal(times, np.arange(30) * 120.0)
    _, later = elapsed_from_dates(dates, "UTC", epoch="2016-03-12T00:00:00 UTC")
    np.testing.assert_array_equal(later, times + 86400)


def test_terrestrial_time_keeps_nanoseconds_over_a_century():
    start, end = terrestrial_time("2000-01-01T12:00:00 TT", [0.0, 3_155_760_000.000_000_5])
    assert (end - start).to_value("sec") == pytest.approx(3_155_760_000.000_000_5, rel=1e-16)


def test_tables_come_from_installed_packages_and_settings_stay():
    before = (iers.conf.auto_download, iers.conf.auto_max_age)
    with iers.conf.set_temp("iers_auto_url", "http://127.0.0.1:9/refused"):
        parse_epoch("2016-03-13T00:00:00 UTC")
    assert (iers.conf.auto_download, iers.conf.auto_max_age) == before


def test_a_date_beyond_the_leap_seconds_warns():
    with pytest.warns(UnmodeledWarning, match="beyond the installed table of leap seconds"):
        parse_epoch("2090-01-01T00:00:00 UTC")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("2016-03-13T00:00:00", 'epoch "2016-03-13T00:00:00" cannot be read'),
        ("yesterday UTC", 'epoch "yesterday UTC" cannot be read'),
        ("2016-13-13T00:00:00 UTC", 'epoch "2016-13-13T00:00:00 UTC" is not a date'),
        ("2016-03-13T00:00:00 UCT", 'time scale "UCT" is unknown.*did you mean "UTC"'),
        ("2016-03-13T00:00:00Z TAI", "ends in Z, which means UTC, but names TAI"),
        ("1960-01-01T00:00:00 UTC", "lies before 1972-01-01.*TAI or TT"),
    ],
)
def test_bad_epochs_are_refused(text, message):
    with pytest.raises(DataError, match=f"(?i){message}"):
        parse_epoch(text)


def test_bad_rows_are_refused():
    with pytest.raises(DataError, match="a date that does not exist"):
        elapsed_from_calendar([[2016, 2, 31, 0, 0, 0]], "UTC")
    with pytest.raises(DataError, match='date 2, "soon", cannot be read'):
        elapsed_from_dates(["2016-03-13T00:00:00", "soon"], "UTC")
