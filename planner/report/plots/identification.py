"""Pictures of an identification, as the article's 3 to 9: what was flown beside what the model says."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from planner.identify.calibration import OF_FLIGHTS
from planner.identify.manoeuvres import simulated_answers
from planner.identify.power import predicted_powers_w
from planner.report.plots.picture_files import BLUE, GREY, Chart, inline_rows, load_altair, styled

if TYPE_CHECKING:
    from collections.abc import Sequence

    import altair as alt

    from planner.arrays import FloatArray
    from planner.identify.assembly import Identification
    from planner.identify.battery import BatteryFit
    from planner.identify.calibration import Calibration
    from planner.identify.responses import ResponseEvidence
    from planner.identify.segments import MeasuredPower
    from planner.identify.verification import Verification
    from planner.logs.record import FlightRecord
    from planner.report.tables import Row
    from planner.vehicle.model import VehicleModel


WIDTH, HEIGHT = 640, 360
"""Of a picture. [px]"""
RESIDUAL_HEIGHT = 140
"""Of what is left below it. [px]"""
_BAND = 0.15
"""Opacity."""
_LABELS = {
    "altitude": "Altitude above rest [m]",
    "speed": "Speed above rest [m/s]",
    "climb_power": "Power above hover [W]",
    "descent_power": "Power above hover [W]",
    "brake_power": "Power above hover [W]",
}
_MOST_CURVES = 12
"""Manoeuvres drawn in one picture: more hide each other."""
_MOST_SAMPLES = 400
"""Of each manoeuvre."""
_CURVE_POINTS = 100
_95_PERCENT = 1.96
"""Standard deviations either side of a mean. [-]"""
_LEVEL_M_S = 0.3
"""A flight that climbs more slowly is level. [m s⁻¹]"""
_UPRIGHT_M_S = 1.0
"""A flight of less airspeed climbs or descends upright. [m s⁻¹]"""
_FLOWN, _MODEL, _PREDICTED, _LEFT = "flown", "model", "predicted", "left"
_CURVES = {_FLOWN: (GREY, [1, 0]), _MODEL: (BLUE, [6, 2])}


def identification_figures(found: Identification) -> dict[str, Chart]:
    """Return the pictures of an identification by name, only those there are data for.

    Below what was flown and the model stands what is left between them.
    """
    alt = load_altair()
    evidence, model = found.evidence, found.model
    figures = {response.name: _response(response) for response in evidence.responses}
    if evidence.steady:
        figures["power_over_speed"] = _power_over_speed(evidence.steady, model)
        if any(abs(one.climb_rate_m_s) > _LEVEL_M_S for one in evidence.steady):
            figures["power_over_climb"] = _power_over_climb(evidence.steady, model)
    if evidence.hovers:
        figures["hover"] = _hover(evidence.hovers, model)
    if evidence.battery is not None:
        figures["battery"] = _battery(evidence.battery)
    sizes = {"width": WIDTH, "height": HEIGHT}, {"width": WIDTH, "height": RESIDUAL_HEIGHT}
    return {
        name: alt.vconcat(
            *(panel.properties(**size) for panel, size in zip(panels, sizes, strict=False)),
            title=f"{model.name}: {name.replace('_', ' ')}",
        )
        for name, panels in figures.items()
    }


def _response(response: ResponseEvidence) -> list[Chart]:
    """Figures 3 to 7: each manoeuvre from its command on, and the model's answer."""
    alt = load_altair()
    chosen = response.manoeuvres[:_MOST_CURVES]
    system = response.transfer_function
    answers = simulated_answers(system.modes, system.delay_s, chosen)
    rows: list[Row] = []
    left: list[FloatArray] = []
    for number, (manoeuvre, answer) in enumerate(zip(chosen, answers, strict=True)):
        since_s = manoeuvre.time_s - manoeuvre.command_s
        step = max(1, len(since_s) // _MOST_SAMPLES)
        flown = manoeuvre.answer - manoeuvre.answer_before
        left.append(flown - answer)
        for what, values in ((_FLOWN, flown), (_MODEL, answer), (_LEFT, left[-1])):
            rows += [
                {"manoeuvre": number, "what": what, "time_s": round(t, 3), "answer": round(v, 4)}
                for t, v in zip(since_s[::step].tolist(), values[::step].tolist(), strict=True)
            ]
    x_axis = alt.X("time_s:Q").title("Time after the command [s]").scale(nice=False)
    layers = [
        alt.Chart(inline_rows([row for row in rows if row["what"] != _LEFT]))
        .mark_line(strokeWidth=1.2)
        .encode(
            x=x_axis,
            y=alt.Y("answer:Q").title(_LABELS[response.name]),
            detail=alt.Detail("manoeuvre:N"),
            **styled("what:N", "Curve", _CURVES),
        )
    ]
    if response.window_s is not None:
        rule = alt.Chart(inline_rows([{"time_s": response.window_s}])).encode(x=alt.X("time_s:Q"))
        layers += [
            rule.mark_rule(strokeDash=[2, 3]),
            rule.mark_text(align="right", dx=-4, baseline="top").encode(
                y=alt.YValue(4), text=alt.TextValue("end of the window")
            ),
        ]
    band = _95_PERCENT * float(np.sqrt(np.mean(np.square(np.concatenate(left)))))
    unit = _LABELS[response.name].rpartition(" ")[2]
    y_axis = alt.Y("answer:Q").title(f"Flown − model {unit}")
    residuals = [
        alt.Chart(inline_rows([{"low": -band, "high": band}]))
        .mark_rect(color=BLUE, opacity=_BAND)
        .encode(y=alt.Y("low:Q").title(f"Flown − model {unit}"), y2=alt.Y2("high:Q")),
        alt.Chart(inline_rows([row for row in rows if row["what"] == _LEFT]))
        .mark_line(strokeWidth=1.0, color=GREY)
        .encode(x=x_axis, y=y_axis, detail=alt.Detail("manoeuvre:N")),
    ]
    return [alt.layer(*layers), alt.layer(*residuals)]


class _Law(NamedTuple):
    """A law as a line."""

    at: FloatArray
    value: FloatArray
    deviation: FloatArray | None = None
    """How far the law itself may be off, a standard deviation; ``None``: it is not known."""


def _hover(hovers: Sequence[MeasuredPower], model: VehicleModel) -> list[Chart]:
    """Figure 8: mean power at each level and the law over height."""
    from planner.vehicle.power import AltitudeLaw, hover_power_w

    heights_m = np.array([hover.height_above_home_m for hover in hovers])
    law = None
    if isinstance(model.hover, AltitudeLaw):
        at_m = np.linspace(max(1.0, 0.8 * heights_m.min()), 1.1 * heights_m.max(), _CURVE_POINTS)
        power_w = hover_power_w(
            model.hover, height_above_home_m=at_m, mass_kg=None, air_density_kg_m3=1.0
        )
        law = _Law(at_m, power_w)
    return _points_and_law(
        [(h.height_above_home_m, h.power_w, h.error_w) for h in hovers],
        law,
        predicted_powers_w(model, hovers),
        titles=("Height above home [m]", "Power [W]"),
    )


def _power_over_speed(steady: Sequence[MeasuredPower], model: VehicleModel) -> list[Chart]:
    """Figure 9: power of level flight over airspeed, and the law at the mean mass and density."""
    level = [one for one in steady if abs(one.climb_rate_m_s) < _LEVEL_M_S]
    law = None
    if level:
        at_m_s = np.linspace(0.0, max(one.airspeed_m_s for one in level), _CURVE_POINTS)
        law = _law_line(model, level, at_m_s, np.zeros(at_m_s.size), at=at_m_s)
    return _points_and_law(
        [(one.airspeed_m_s, one.power_w, one.error_w) for one in level],
        law,
        predicted_powers_w(model, level),
        titles=("Airspeed [m/s]", "Power [W]"),
    )


def _power_over_climb(steady: Sequence[MeasuredPower], model: VehicleModel) -> list[Chart]:
    """Power of vertical flight over climb rate, and the law at the mean airspeed, mass and density."""
    upright = [one for one in steady if one.airspeed_m_s < _UPRIGHT_M_S]
    law = None
    if upright:
        rates = [one.climb_rate_m_s for one in upright]
        at_m_s = np.linspace(min(rates), max(rates), _CURVE_POINTS)
        speed_m_s = np.full(at_m_s.size, np.mean([one.airspeed_m_s for one in upright]))
        law = _law_line(model, upright, speed_m_s, at_m_s, at=at_m_s)
    return _points_and_law(
        [(one.climb_rate_m_s, one.power_w, one.error_w) for one in upright],
        law,
        predicted_powers_w(model, upright),
        titles=("Climb rate [m/s]", "Power [W]"),
    )


def _law_line(
    model: VehicleModel,
    flights: Sequence[MeasuredPower],
    airspeed_m_s: FloatArray,
    climb_rate_m_s: FloatArray,
    *,
    at: FloatArray,
) -> _Law | None:
    """Return the law of a model in the mean air and with the mean mass of flights, and its deviation."""
    from planner.physics.rotor import Rotor
    from planner.values import field_values
    from planner.vehicle.law_factors import LawSpread, is_narrowable, power_deviations
    from planner.vehicle.power import WholeLaw, whole_power_w

    law = model.cruise
    if not isinstance(law, WholeLaw):
        return None
    mass_kg = float(np.mean([one.mass_kg or 0.0 for one in flights]))
    density = float(np.mean([one.air_density_kg_m3 or 0.0 for one in flights]))
    avionics_w = 0.0 if model.loads is None else model.loads.avionics_w
    power_w = avionics_w + whole_power_w(
        law,
        airspeed_m_s=airspeed_m_s,
        climb_rate_m_s=climb_rate_m_s,
        mass_kg=mass_kg,
        air_density_kg_m3=density,
    )
    if not is_narrowable(model) or model.spread is None:
        return _Law(at, power_w)
    fractions = power_deviations(
        Rotor(**field_values(law)),
        LawSpread.of_model(model.spread),
        airspeed_m_s,
        climb_rate_m_s,
        mass_kg=mass_kg,
        air_density_kg_m3=density,
        avionics_w=avionics_w,
    )
    return _Law(at, power_w, fractions * power_w)


def _battery(battery: BatteryFit) -> list[Chart]:
    """Open-circuit voltage over the charge that is left."""
    return _points_and_law(
        list(zip(battery.ocv_soc, battery.ocv_v, battery.ocv_error_v, strict=True)),
        _Law(np.array(battery.ocv_soc), np.array(battery.ocv_v)),
        None,
        titles=("State of charge [-]", "Open-circuit voltage [V]"),
    )


def _points_and_law(
    points: Sequence[tuple[float, float, float]],
    law: _Law | None,
    predicted: FloatArray | None,
    *,
    titles: tuple[str, str],
) -> list[Chart]:
    """Return what was flown as points with their 95 % range, and a law as a line with its own.

    Below them each point less what is predicted for it, with its own mass and air.
    """
    alt = load_altair()
    x_axis = alt.X("x:Q").title(titles[0]).scale(zero=False)
    y_axis = alt.Y("y:Q").title(titles[1]).scale(zero=False)
    layers = _points(points, x_axis, y_axis)
    if law is not None:
        deviation = np.zeros(law.at.size) if law.deviation is None else law.deviation
        columns = (law.at, law.value, _95_PERCENT * deviation)
        line = [
            {"x": round(x, 5), "y": round(y, 5), "low": y - d, "high": y + d, "what": _MODEL}
            for x, y, d in zip(*(column.tolist() for column in columns), strict=True)
        ]
        of_law = alt.Chart(inline_rows(line))
        if law.deviation is not None:
            layers.append(
                of_law.mark_area(color=BLUE, opacity=_BAND).encode(
                    x=x_axis, y=_low(y_axis), y2=alt.Y2("high:Q")
                )
            )
        layers.append(
            of_law.mark_line(color=BLUE, strokeWidth=1.8).encode(
                x=x_axis, y=y_axis, strokeDash=alt.StrokeDash("what:N").title("Law")
            )
        )
    if predicted is None:
        return [alt.layer(*layers)]
    left = [(x, y - p, d) for (x, y, d), p in zip(points, predicted.tolist(), strict=True)]
    unit = titles[1].rpartition(" ")[2]
    left_axis = alt.Y("y:Q").title(f"Flown − model {unit}")
    zero = alt.Chart(inline_rows([{"y": 0.0}])).mark_rule(color=BLUE).encode(y=left_axis)
    return [alt.layer(*layers), alt.layer(*_points(left, x_axis, left_axis), zero)]


def _low(y_axis: alt.Y) -> alt.Y:
    """Return the axis of values as that of the lower end of their range."""
    low = y_axis.copy()
    low["shorthand"] = "low:Q"
    return low


def _points(
    points: Sequence[tuple[float, float, float]], x_axis: alt.X, y_axis: alt.Y
) -> list[Chart]:
    """Return the layers of points with their 95 % range."""
    alt = load_altair()
    rows = [
        {
            "x": x,
            "y": y,
            "low": y - _95_PERCENT * error,
            "high": y + _95_PERCENT * error,
            "what": f"{_FLOWN}, 95 %",
        }
        for x, y, error in points
    ]
    measured = alt.Chart(inline_rows(rows))
    return [
        measured.mark_rule(color=GREY, strokeWidth=1.5).encode(
            x=x_axis, y=_low(y_axis), y2=alt.Y2("high:Q")
        ),
        measured.mark_point(filled=True, size=45, color=GREY, opacity=1.0).encode(
            x=x_axis, y=y_axis, shape=alt.Shape("what:N").title("Data")
        ),
    ]


VERIFICATION_WIDTH, VERIFICATION_HEIGHT = 720, 160
"""Of a panel. [px]"""
MOST_ROWS = 2_000
"""Of each flight."""
_PANELS = (
    ("power_w", "Power [W]"),
    ("height_above_home_m", "Height above home [m]"),
    ("ground_speed_m_s", "Ground speed [m/s]"),
)


def verification_figure(one: Verification, *, title: str = "") -> Chart:
    """Return a flight and its prediction, one over the other, over the time since they began."""
    alt = load_altair()
    rows = _rows(one.flown, _FLOWN) + _rows(one.foreseen, _PREDICTED)
    styles = {_FLOWN: _CURVES[_FLOWN], _PREDICTED: _CURVES[_MODEL]}
    panels = [
        alt.Chart(inline_rows(rows, name="flights"))
        .mark_line(strokeWidth=1.5)
        .encode(
            x=alt.X("time_s:Q").title("Time [s]").scale(nice=False),
            y=alt.Y(f"{column}:Q").title(label),
            **styled("flight:N", "Flight", styles),
        )
        .properties(width=VERIFICATION_WIDTH, height=VERIFICATION_HEIGHT)
        for column, label in _PANELS
    ]
    named = {"title": title} if title else {}
    return alt.vconcat(*panels, **named).properties(
        description="Power, height and ground speed over time, flown and predicted"
    )


def calibration_figure(
    rows: Sequence[Calibration], labels: Sequence[str], *, title: str = ""
) -> Chart:
    """Return what each flight took over what was predicted, with the interval it was predicted in."""
    alt = load_altair()
    panels = []
    for row in rows:
        if row.of not in OF_FLIGHTS:
            continue
        values = [
            {
                "flight": labels[one.flight],
                "error": 100.0 * one.error,
                "low": 100.0 * one.low,
                "high": 100.0 * one.high,
            }
            for one in row.intervals
        ]
        of = alt.Chart(inline_rows(values, name=row.of)).encode(
            y=alt.Y("flight:N").title(None).sort(None)
        )
        intervals = of.mark_rule(strokeWidth=3, opacity=0.5).encode(
            x=alt.X("low:Q").title(f"{row.of}: flown over predicted, less one [%]"),
            x2=alt.X2("high:Q"),
        )
        points = of.mark_point(filled=True, size=40).encode(x=alt.X("error:Q"))
        panels.append((intervals + points).properties(width=VERIFICATION_WIDTH))
    named = {"title": title} if title else {}
    return alt.vconcat(*panels, **named).properties(
        description="Errors of flights, and the intervals from p10 to p90 predicted for them"
    )


def _rows(record: FlightRecord, flight: str) -> list[Row]:
    """Return some samples of a flight, evenly chosen; ``None`` where the record knows nothing."""
    count = len(record.time_s)
    chosen = np.linspace(0, count - 1, min(count, MOST_ROWS)).round().astype(np.intp)
    time_s = np.round(record.time_s[chosen], 2).tolist()
    columns = [
        [round(value, 2) if np.isfinite(value) else None for value in column[chosen].tolist()]
        for column in (np.asarray(getattr(record, name), np.float64) for name, _ in _PANELS)
    ]
    names = ("flight", "time_s", *(name for name, _ in _PANELS))
    return [
        dict(zip(names, row, strict=True))
        for row in zip([flight] * len(time_s), time_s, *columns, strict=True)
    ]
