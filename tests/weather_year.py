"""A year of hourly weather made up by a few laws, as a station would report it: for sweeps to run over.

Run as a program, ``python tests/weather_year.py year.csv`` writes its 8,760 rows.
"""

from __future__ import annotations

import csv
import datetime as dt
import io
import sys
from pathlib import Path

import numpy as np

_START = dt.datetime(2025, 1, 1)  # noqa: DTZ001 - as a station writes it, in its own time
HOURS = 8760
HEADS = ("time", "wind_speed (kn)", "wind_direction (°)", "wind_gust (kn)", "temperature (°C)")


def weather_year(*, every: int = 1) -> str:
    """Return the year as CSV: every so many-th hour of it.

    Winds follow Weibull's law of shape 2 about a mean of 4.5 m/s, a third more in winter, less at night,
    and last for hours; they come mostly from the south-west.  As stations do, it rounds to knots, tens of
    degrees and whole degrees Celsius.
    """
    random = np.random.default_rng(2025)
    hours = np.arange(HOURS)
    winter = np.cos(2.0 * np.pi * hours / HOURS)
    day = np.cos(2.0 * np.pi * (hours - 14) / 24)
    smooth = np.convolve(random.standard_normal(HOURS + 47), np.ones(48) / np.sqrt(48), "valid")
    # Rayleigh's law is Weibull's of shape 2; a normal deviate turns into its quantile.
    rank = 0.5 * (1.0 + np.tanh(0.8 * smooth))
    mean_m_s = 4.5 * (1.0 + 0.33 * winter) * (1.0 + 0.15 * day)
    speed_m_s = mean_m_s / np.sqrt(np.pi / 4.0) * np.sqrt(-np.log1p(-rank))
    turn = np.convolve(random.standard_normal(HOURS + 47), np.ones(48) / np.sqrt(48), "valid")
    from_deg = 10.0 * np.round((225.0 + 60.0 * turn) / 10.0) % 360.0
    speed_kn = np.round(speed_m_s * 3600.0 / 1852.0)
    gust_kn = np.maximum(np.round(1.5 * speed_kn + random.normal(0.0, 2.0, HOURS)), speed_kn)
    air_c = np.round(9.0 - 9.0 * winter + 4.0 * day + 3.0 * smooth)
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(HEADS)
    for hour in hours[::every].tolist():
        time = (_START + dt.timedelta(hours=hour)).isoformat(timespec="minutes")
        columns = (speed_kn, from_deg, gust_kn, air_c)
        writer.writerow([time, *(f"{column[hour] + 0.0:.0f}" for column in columns)])
    return text.getvalue()


if __name__ == "__main__":
    Path(sys.argv[1]).write_text(weather_year(), encoding="utf-8")
