"""Tables behind the pictures of a flight: what it looks like over time, and where it goes.

They have a bounded number of rows, however long the flight: of each short time the first sample and
the extremes are kept, of the path the corners that can be seen.
"""

from __future__ import annotations

import math
from itertools import groupby
from typing import TYPE_CHECKING, Any

import numpy as np

from planner import quantity
from planner.errors import UsageError
from planner.findings import Severity
from planner.flight.motion.kinematics import STATES
from planner.flight.prediction import sample_trace, used_energy_wh
from planner.flight.returns.path import return_profile
from planner.flight.uncertainty import predict_energy_band
from planner.geo.barrier import swept_areas
from planner.mission.route.stage import LANDED_STAGES, StageKind
from planner.rules.energy import destination_name, place_along
from planner.service.separation import known_home_amsl_m
from planner.values import Value, field_names, field_values

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from planner.arrays import FloatArray, IntArray
    from planner.flight.prediction import Trace
    from planner.flight.returns.path import ReturnProfile
    from planner.geo.geodesy import LocalFrame
    from planner.mission.route.stage import Stage
    from planner.report.plots.picture_files import Chart
    from planner.rules.assessment import Assessment
    from planner.service.fleet import FleetResult
    from planner.service.preflight import CheckResult


_MOST_POINTS = 1_500
"""Corners of all areas together; more are thinned out."""
_DOT = 1.0 / 1_000
"""What an outline may be off at first, as a fraction of the extent of the flight. [-]"""
_ALIKE_DIGITS = 1
"""Legs flown again and again, to a tenth of a metre, are one: a union of many takes long."""
_LEAST_M = 0.1
"""A finer dot shows nothing more. [m]"""
_ARC_POINTS = 4
"""Of a quarter turn."""


def stop_room_rows(assessment: Assessment) -> list[Row]:
    """Return what a flight would pass over if commanded to stop anywhere, a row per corner.

    Around every place of the path it is the way straight ahead until the vehicle stands still (to
    react, to stop, what the wind adds), and the margin by which its position may be wrong: where that
    reaches over a fence there is a finding F102.  There is none without a fence, or too small to see.
    An area with holes is one line that goes there and back, round each hole the other way, so that it
    is filled as it should be.
    """
    if not assessment.mission.fence:
        return []
    import shapely

    flown = assessment.fenced
    dot_m = _DOT * float(np.ptp(flown.points_m, axis=0).max())
    farthest_m = float(np.hypot(*(flown.stopped_m - flown.points_m).T).max()) + flown.margin_m
    if farthest_m < dot_m:
        return []
    stretch, legs = _stretches(flown.path.length_m, dot_m), np.arange(len(flown.path.item))
    ahead = np.concatenate(
        [points[rows] for points in (flown.points_m, flown.stopped_m) for rows in (legs, legs + 1)]
    )
    hulls = swept_areas(np.round(ahead, _ALIKE_DIGITS), np.tile(stretch, 4)).hulls
    _, first = np.unique(shapely.to_wkb(shapely.normalize(hulls)), return_index=True)
    # widened one by one: hulls of legs straight ahead are slivers, which a union may lose
    room = shapely.union_all(shapely.buffer(hulls[first], flown.margin_m, quad_segs=_ARC_POINTS))
    outline = shapely.simplify(room, dot_m)
    while shapely.get_num_coordinates(outline) > _MOST_POINTS:
        dot_m *= 2.0
        outline = shapely.simplify(room, dot_m)
    rows: list[Row] = []
    for number, polygon in enumerate(shapely.get_parts(outline), start=1):
        places = _single_line(polygon)
        degrees = flown.frame.latitude_longitude_deg(places[:, 0], places[:, 1])
        line_m = assessment.route.frame.east_north_m(*degrees)
        rows += [{"area": number} | row for row in _line_rows(*line_m)]
    return rows


def _stretches(length_m: FloatArray, short_m: float) -> IntArray:
    """Return the stretch each leg is part of, from 0: legs that are short together make one. (n,)"""
    middle_m = np.cumsum(length_m) - 0.5 * length_m
    bins = np.floor(middle_m / max(short_m, _LEAST_M))
    return np.cumsum(np.diff(bins, prepend=bins[0]) != 0.0)


def _single_line(polygon: Any) -> FloatArray:  # noqa: ANN401 - shapely has no types
    """Return the outline of an area and of its holes as one line. (n, 2) [m]"""
    from shapely.geometry.polygon import orient

    turned = orient(polygon)
    outside = np.asarray(turned.exterior.coords)
    pieces = [outside]
    for hole in turned.interiors:
        pieces += [np.asarray(hole.coords), outside[:1]]
    return np.concatenate(pieces)


Row = dict[str, Any]

_CIRCLE_POINTS = 72
_EDGE_POINTS = 8
"""Fence edges are straight in degrees, thus bent in metres."""
_MOST_ITEMS = 1_500
"""Of more items only some are marked, evenly chosen: the path shows the others."""
_STAGE_NAMES = {
    StageKind.TAKEOFF: "Take-off",
    StageKind.GO: "Waypoint",
    StageKind.SPLINE: "Spline waypoint",
    StageKind.LOITER: "Loiter",
    StageKind.DELAY: "Delay",
    StageKind.CIRCLE: "Circle",
    StageKind.CHANGE_HEIGHT: "Altitude change",
    StageKind.SET_DOWN: "Payload place",
    StageKind.LAND: "Landing",
    StageKind.RETURN_LEG: "Return",
    StageKind.RETURN: "Return",
}


def item_rows(assessment: Assessment) -> list[Row]:
    """Return the places of the items that are flown, a row each, but for a great many."""
    frame = assessment.route.frame
    stages = {stage.item: stage for stage in assessment.route.stages}
    chosen = list(stages)[:: 1 + len(stages) // _MOST_ITEMS]
    stages = {item: stages[item] for item in chosen}
    latitude_deg, longitude_deg = frame.latitude_longitude_deg(
        np.array([stage.east_m for stage in stages.values()]),
        np.array([stage.north_m for stage in stages.values()]),
    )
    return [
        _place("item", _item_label(assessment, stage), _metres(stage.east_m, stage.north_m), *point)
        | {"short": str(item), "detail": _item_detail(assessment, stage)}
        for (item, stage), *point in zip(
            stages.items(), latitude_deg.tolist(), longitude_deg.tolist(), strict=True
        )
    ]


def _item_label(assessment: Assessment, stage: Stage) -> str:
    """Return ``Waypoint 7 · reached 28:13, left 28:33 · 61.2 Wh used · 50 m above home, 538 m AMSL``."""
    arrival = assessment.items[stage.item - 1]
    parts = [f"{_STAGE_NAMES[stage.kind]} {stage.item}"]
    if arrival.arrival_s is not None:
        times = [f"reached {quantity.clock(arrival.arrival_s)}"]
        if quantity.clock(arrival.left_s) != quantity.clock(arrival.arrival_s):
            times.append(f"left {quantity.clock(arrival.left_s)}")
        if arrival.later:
            times.append(f"the first of {len(arrival.later) + 1} times")
        parts.append(", ".join(times))
    if arrival.energy_used_wh is not None and math.isfinite(arrival.energy_used_wh):
        parts.append(f"{quantity.energy(arrival.energy_used_wh)} used")
    parts.append(_heights(assessment, stage))
    return " · ".join(parts)


def _item_detail(assessment: Assessment, stage: Stage) -> str:
    """Return what the map writes beside an item: ``28:13 · 61.2 Wh · 50 m``."""
    arrival = assessment.items[stage.item - 1]
    texts = [quantity.clock(arrival.arrival_s)]
    if arrival.energy_used_wh is not None and math.isfinite(arrival.energy_used_wh):
        texts.append(quantity.energy(arrival.energy_used_wh))
    return " · ".join((*texts, quantity.height(stage.height_m)))


def _heights(assessment: Assessment, stage: Stage) -> str:
    above = f"{quantity.height(stage.height_m)} above home"
    home_m = known_home_amsl_m(assessment)
    return above if home_m is None else f"{above}, {quantity.height(home_m + stage.height_m)} AMSL"


def place_rows(assessment: Assessment) -> list[Row]:
    """Return home and the rally points, a row each."""
    frame = assessment.route.frame
    home_m = known_home_amsl_m(assessment)
    at = "altitude not known" if home_m is None else f"{quantity.height(home_m)} AMSL"
    label = f"Home · {at}"
    home = _place("home", label, _metres(0.0, 0.0), frame.latitude_deg, frame.longitude_deg)
    rally = [
        _place("rally point", f"Rally point {number}", _metres(*frame.east_north_m(*place)), *place)
        | {"short": f"R{number}"}
        for number, place in enumerate(
            ((one.latitude_deg, one.longitude_deg) for one in assessment.mission.rally), start=1
        )
    ]
    return [home | {"short": "H"}, *rally]


def point_rows(result: CheckResult) -> list[Row]:
    """Return the places the return decides on, a row each: where it is tightest, and those of no return."""
    way, assessment = result.return_plan, result.assessment
    if way is None or assessment is None:
        return []
    margin = ""
    if way.margin_wh is not None:
        words = "short" if way.margin_wh < 0.0 else "above the reserve"
        margin = f" · {quantity.energy(abs(way.margin_wh))} {words}"
    takes = f"takes {quantity.energy(way.energy_home_wh)}{margin}"
    goal = destination_name(way.destination)
    points = (
        (TIGHTEST, way.tightest, f"flying {goal} {takes}"),
        (NO_RETURN, way.last_return, f"beyond it, flying {goal} lands below the reserve"),
        (EMPTY, way.last_return_empty, f"beyond it, flying {goal} empties the battery"),
    )
    return [
        _place(
            kind,
            label,
            _metres(*assessment.route.frame.east_north_m(*point.place_deg)),
            *point.place_deg,
        )
        | {"short": short, "time_min": round(point.time_s / 60.0, 4)}
        for (kind, short), point, words in points
        if point is not None
        for label in [
            f"{kind[0].upper()}{kind[1:]} · {quantity.clock(point.time_s)}, {place_along(point)} · {words}"
        ]
    ]


TIGHTEST = ("tightest return", "tightest")
NO_RETURN = ("point of no return", "no return")
EMPTY = ("battery empty on the return", "empty")
"""Kind of a point, and its name on the map."""


def joined_places(rows: Sequence[Row]) -> list[Row]:
    """Return places that are one, such as home, take-off and landing, as one row with a line for each."""
    places: dict[tuple[float, float], Row] = {}
    for row in rows:
        at = (row["east_m"], row["north_m"])
        known = places.get(at)
        if known is None:
            places[at] = dict(row)
            continue
        for key, between in (("label", "\n"), ("short", ", ")):
            known[key] = f"{known[key]}{between}{row[key]}"
        if row["kind"] != "item":
            known["kind"] = row["kind"]
        known.setdefault("detail", row.get("detail", ""))
    return list(places.values())


def fence_outlines(
    assessment: Assessment, frame: LocalFrame | None = None
) -> list[tuple[bool, FloatArray, FloatArray]]:
    """Return whether each area of the fence is to be kept inside, and its closed outline.

    East and north of home, or in another frame. (n,) [m]
    """
    fence, frame = assessment.mission.fence, frame or assessment.route.frame
    if fence is None:
        return []
    found = []
    for polygon in fence.polygons:
        if polygon.vertices_deg:
            corners = np.array([*polygon.vertices_deg, polygon.vertices_deg[0]])
            steps = np.linspace(0.0, len(corners) - 1, (len(corners) - 1) * _EDGE_POINTS + 1)
            whole = np.arange(len(corners))
            degrees = [np.interp(steps, whole, column) for column in corners.T]
            found.append((polygon.inclusion, *frame.east_north_m(*degrees)))
    turn = np.linspace(0.0, 2.0 * np.pi, _CIRCLE_POINTS + 1)
    for circle in fence.circles:
        east_m, north_m = frame.east_north_m(circle.latitude_deg, circle.longitude_deg)
        radius_m = circle.radius_m
        found.append(
            (circle.inclusion, east_m + radius_m * np.sin(turn), north_m + radius_m * np.cos(turn))
        )
    return found


def fence_rows(assessment: Assessment) -> list[Row]:
    """Return the outlines of the fence's areas, closed, a row per point."""
    return outline_rows(fence_outlines(assessment))


def outline_rows(outlines: Sequence[tuple[bool, FloatArray, FloatArray]]) -> list[Row]:
    """Return closed outlines, a row per point."""
    return [
        {"area": number, "kind": "stay inside" if is_inside else "keep out"} | row
        for number, (is_inside, *line_m) in enumerate(outlines, start=1)
        for row in _line_rows(*line_m)
    ]


def fleet_outlines(
    result: FleetResult, frame: LocalFrame
) -> list[tuple[bool, FloatArray, FloatArray]]:
    """Return the areas of all fences of a fleet as of one, those of several sorties once."""
    fences = {
        one.assessment.mission.fence: one.assessment
        for one in result.sorties
        if one.assessment is not None and one.assessment.mission.fence is not None
    }
    return [area for one in fences.values() for area in fence_outlines(one, frame)]


def _line_rows(east_m: FloatArray, north_m: FloatArray) -> list[Row]:
    return [
        {"order": order, "east_m": round(east, 1), "north_m": round(north, 1)}
        for order, (east, north) in enumerate(zip(east_m.tolist(), north_m.tolist(), strict=True))
    ]


def stretch_rows(result: CheckResult) -> list[Row]:
    """Return where over ground findings are, a row per point; ``finding`` counts as in the result."""
    if result.assessment is None:
        return []
    frame = result.assessment.route.frame
    return [
        {
            "finding": number,
            "code": finding.code,
            "part": part,
            "order": order,
            **_metres(*frame.east_north_m(*point_deg)),
        }
        for number, finding in enumerate(result.findings)
        if finding.severity > Severity.INFO and finding.stretch is not None
        for part, line_deg in enumerate(finding.stretch.lines_deg)
        for order, point_deg in enumerate(line_deg)
    ]


def _metres(east_m: float | FloatArray, north_m: float | FloatArray) -> Row:
    return {"east_m": round(float(east_m), 1), "north_m": round(float(north_m), 1)}


def _place(kind: str, label: str, metres: Row, latitude_deg: float, longitude_deg: float) -> Row:
    return {
        "kind": kind,
        "label": label,
        **metres,
        "latitude_deg": round(latitude_deg, 7),
        "longitude_deg": round(longitude_deg, 7),
    }


MOST_ROWS = 2_400
"""Of a table over time; finer than the dots of a screen."""
_SAMPLES = 20_000
"""Looked at for that."""
_EXTREMES = 7
"""Rows kept of each short time: the first, and the extremes of power, altitude and speed."""
_BAND_POINTS = 121
"""Times that the spread of the energy is looked at."""
_BANDS = 500
"""Most bands of states; with more, each shows what takes most of its time."""
_PATH_TOLERANCE = 1.0 / 4_000
"""What a simplified path may be off, as a fraction of its extent: a quarter of a dot. [-]"""


class FlightTables(Value, eq=False):
    """A result, and the rows of its pictures."""

    result: CheckResult
    assessment: Assessment
    flight: list[Row]
    """Samples over time; power and energy are left out where they are not known."""
    path: list[Row]
    """Samples of the way over ground; where the battery is known, in runs of one level of the return."""
    arrows: list[Row]
    """Which way it is flown, here and there."""
    states: list[Row]
    """Stretches of one state."""
    returns: list[Row]
    """What it would take to get home; empty where the power is not known."""
    marks: list[Row]
    """Items, home and rally points; those at one place in one row."""
    points: list[Row]
    """Where the return is tightest, and the points of no return."""
    fence: list[Row]
    """Outlines of its areas."""
    stretches: list[Row]
    """Where over ground findings are."""
    room: list[Row]
    """What the flight would pass over if commanded to stop; empty without a fence."""
    band: list[Row]
    """Energy that one flight of ten stays below, and one exceeds; empty without a spread."""

    @property
    def named(self) -> dict[str, list[Row]]:
        """The rows that pictures name; those that hold any."""
        rows = field_values(self)
        return {name: rows[name] for name in field_names(self)[2:] if rows[name]}


def make_tables(result: CheckResult, *, most_rows: int = MOST_ROWS) -> FlightTables:
    """Return the tables of a result.

    Raises
    ------
    UsageError
        If nothing is flown, of which there is no picture.
    """
    assessment = result.assessment
    if assessment is None:
        msg = f"{result.file}: nothing is flown, so there is nothing to draw"
        raise UsageError(msg)
    trace = sample_trace(assessment.flight, assessment.route, most_samples=_SAMPLES)
    profile = return_profile(assessment.returns) if assessment.vehicle.is_power_known else None
    turning = _turning(assessment, profile)
    path = _path_by_level(assessment, trace, profile, turning)
    return FlightTables(
        result=result,
        assessment=assessment,
        flight=_flight_rows(assessment, trace, most_rows),
        path=path,
        arrows=arrow_rows(path),
        states=_state_rows(assessment),
        returns=_return_rows(profile, turning, most_rows),
        marks=joined_places(item_rows(assessment) + place_rows(assessment)),
        points=point_rows(result),
        fence=fence_rows(assessment),
        stretches=stretch_rows(result),
        room=stop_room_rows(assessment),
        band=_band_rows(assessment),
    )


def with_data(chart: Chart, tables: FlightTables) -> Chart:
    """Return a chart with the rows it names: it can be shown as it is."""
    # Set as an item: a property would have every row checked.
    chart["datasets"] = named_rows(chart.to_dict(validate=False), tables.named)
    return chart


def named_rows(spec: dict[str, Any], tables: Mapping[str, list[Row]]) -> dict[str, list[Row]]:
    """Return the rows that the specification of a chart names."""
    text = str(spec)
    return {name: rows for name, rows in tables.items() if f"'name': '{name}'" in text}


def _flight_rows(assessment: Assessment, trace: Trace, most_rows: int) -> list[Row]:
    known = assessment.vehicle.is_power_known
    kept = _extremes(
        trace.time_s,
        (trace.power_w, trace.height_above_home_m, trace.ground_speed_m_s),
        most_rows // _EXTREMES,
    )
    east_m, north_m = assessment.route.frame.east_north_m(trace.latitude_deg, trace.longitude_deg)
    columns = {
        "time_min": _rounded(trace.time_s / 60.0, 4),
        "item": trace.item.tolist(),
        # of an unknown home it is that above home, and drawn as such
        "altitude_amsl_m": _rounded(trace.height_above_home_m + assessment.route.home_amsl_m, 2),
        "speed_m_s": _rounded(trace.ground_speed_m_s, 2),
        "east_m": _rounded(east_m, 1),
        "north_m": _rounded(north_m, 1),
        "state": list(trace.state),
    }
    if known:
        columns["power_w"] = _rounded(trace.power_w, 1)
        used_wh = used_energy_wh(assessment.flight, trace.time_s, trace.power_w)
        columns["used_wh"] = _rounded(used_wh, 3)
    if assessment.setup.terrain is not None:
        ground_m = assessment.setup.terrain.height_amsl_m(trace.latitude_deg, trace.longitude_deg)
        route = assessment.route  # drawn as it is judged: so far below the flight
        columns["ground_amsl_m"] = _rounded(
            ground_m.filled(np.nan) + route.home_amsl_m - route.ground_datum_m, 1
        )
    return _rows(columns, kept)


def path_rows(
    assessment: Assessment,
    trace: Trace,
    chosen: slice = slice(None),
    *,
    level: IntArray | None = None,
) -> list[Row]:
    """Return the way over ground of the samples chosen, a row for each corner that can be seen.

    Where each sample has a level, the position of its name in `LEVELS`, rows are in runs of one level,
    which begin where the one before ends.
    """
    import shapely

    east_m, north_m = assessment.route.frame.east_north_m(
        trace.latitude_deg[chosen], trace.longitude_deg[chosen]
    )
    number = np.arange(len(east_m), dtype=np.float64)
    kept = np.arange(len(east_m))
    if len(kept) > 2:
        extent_m = float(max(np.ptp(east_m), np.ptp(north_m)))
        line = shapely.LineString(np.column_stack((east_m, north_m, number)))
        thin = shapely.simplify(line, _PATH_TOLERANCE * extent_m, preserve_topology=False)
        kept = shapely.get_coordinates(thin, include_z=True)[:, 2].astype(np.intp)
    columns = {
        "time_min": _rounded(trace.time_s[chosen] / 60.0, 4),
        "item": trace.item[chosen].tolist(),
        "east_m": _rounded(east_m, 1),
        "north_m": _rounded(north_m, 1),
    }
    if level is None:
        return _rows(columns, kept)
    changes = np.flatnonzero(np.diff(level)) + 1
    columns["level"] = [LEVELS[one] for one in level.tolist()]
    rows: list[Row] = []
    run = 0
    for row in _rows(columns, np.union1d(kept, changes)):
        if rows and rows[-1]["level"] != row["level"]:
            rows.append(row | {"level": rows[-1]["level"], "run": run})
            run += 1
        rows.append(row | {"run": run})
    return rows


LEVELS = (
    "an empty battery",
    "less than the reserve",
    "reserve + up to 10 %",
    "reserve + 10 to 25 %",
    "reserve + over 25 %",
)
"""With what a vehicle lands that turns back, worst first; fractions of the battery, above the reserve."""
_LEVEL_FRACTIONS = (0.0, 0.1, 0.25)


def _path_by_level(
    assessment: Assessment, trace: Trace, profile: ReturnProfile | None, turning: IntArray
) -> list[Row]:
    """Return the way over ground by what a return from each place leaves in the battery, if known."""
    battery = assessment.battery
    if battery is None or profile is None or not len(turning):
        return path_rows(assessment, trace)
    needed_wh = np.interp(
        trace.time_s, profile.time_s[turning], profile.used_wh[turning] + profile.return_wh[turning]
    )
    above = (battery.above_reserve_wh - needed_wh) / battery.capacity_wh
    level = np.searchsorted(_LEVEL_FRACTIONS, above, side="right") + 1
    level[needed_wh > battery.usable_wh] = 0
    return path_rows(assessment, trace, level=level)


_ARROW_FRACTION = 0.06
"""Shortest way between arrows, over the extent of the path. [-]"""
_MOST_ARROWS = 60
_ARROW_AT = 0.58
"""Along a leg, so that those of there and back do not lie on each other. [-]"""


def arrow_rows(path: Sequence[Row]) -> list[Row]:
    """Return arrows along a path: one on each long leg, and one on each so long way of short ones."""
    places = np.array([(row["east_m"], row["north_m"]) for row in path])
    legs = np.diff(places, axis=0)
    length_m = np.hypot(*legs.T)
    least_m = _ARROW_FRACTION * float(np.ptp(places, axis=0).max())
    if least_m == 0.0:
        return []
    chosen: list[int] = []
    while not chosen or len(chosen) > _MOST_ARROWS:
        chosen, since_m = [], 0.0
        for number, own_m in enumerate(length_m.tolist()):
            since_m += own_m
            if since_m >= least_m:
                chosen.append(number)
                since_m = 0.0
        least_m *= 1.5
    heads = places[chosen] + _ARROW_AT * legs[chosen]
    bearings_deg = np.degrees(np.arctan2(*legs[chosen].T)) % 360.0
    columns = {
        "east_m": _rounded(heads[:, 0], 1),
        "north_m": _rounded(heads[:, 1], 1),
        "bearing_deg": _rounded(bearings_deg, 1),
    }
    return _rows(columns, np.arange(len(chosen)))


def _state_rows(assessment: Assessment) -> list[Row]:
    columns = assessment.flight.motion.segments
    state, end_s = columns.state, columns.end_s
    last = np.flatnonzero(np.diff(state, append=-1))
    starts_s = [0.0, *end_s[last[:-1]].tolist()]
    bands = list(zip(state[last].tolist(), starts_s, end_s[last].tolist(), strict=True))
    if len(bands) > _BANDS:
        bands = _coarse_bands(state, end_s)
    return [
        {
            "state": STATES[index].value,
            "start_min": round(start_s / 60.0, 4),
            "end_min": round(stop_s / 60.0, 4),
        }
        for index, start_s, stop_s in bands
    ]


def _coarse_bands(state: IntArray, end_s: FloatArray) -> list[tuple[int, float, float]]:
    """Return even bands with the state that takes most of the time of each, neighbours joined."""
    edges_s = np.linspace(0.0, float(end_s[-1]), _BANDS + 1)
    spent_s = np.zeros((len(STATES), _BANDS))
    for index in range(len(STATES)):
        of_state_s = np.cumsum(np.where(state == index, np.diff(end_s, prepend=0.0), 0.0))
        spent_s[index] = np.diff(
            np.interp(edges_s, np.append(0.0, end_s), np.append(0.0, of_state_s))
        )
    most = spent_s.argmax(axis=0).tolist()
    bands = []
    for index, group in groupby(range(_BANDS), key=most.__getitem__):
        members = list(group)
        bands.append((int(index), float(edges_s[members[0]]), float(edges_s[members[-1] + 1])))
    return bands


def _turning(assessment: Assessment, profile: ReturnProfile | None) -> IntArray:
    """Return the rows of a profile from which a flight may still turn back."""
    if profile is None:
        return np.zeros(0, dtype=np.intp)
    # Where the vehicle lands anyway nothing is left to turn back from.
    landing = [stage.item for stage in assessment.route.stages_of(*LANDED_STAGES)]
    return np.flatnonzero(~np.isin(profile.item, landing))


def _return_rows(profile: ReturnProfile | None, turning: IntArray, most_rows: int) -> list[Row]:
    if profile is None:
        return []
    needed_wh = profile.used_wh + profile.return_wh
    columns = {
        "time_min": _rounded(profile.time_s / 60.0, 4),
        "item": profile.item.tolist(),
        "return_wh": _rounded(profile.return_wh, 3),
        "needed_wh": _rounded(needed_wh, 3),
    }
    kept = _extremes(profile.time_s[turning], (needed_wh[turning],), most_rows // _EXTREMES)
    return _rows(columns, turning[kept])


def _band_rows(assessment: Assessment) -> list[Row]:
    if assessment.vehicle.spread is None:
        return []
    columns = assessment.flight.motion.segments
    even_s = np.linspace(0.0, assessment.flight.time_s, _BAND_POINTS)[1:]
    segments = np.unique(np.searchsorted(columns.end_s, even_s).clip(max=len(columns.end_s) - 1))
    band = predict_energy_band(
        assessment.returns, assessment.setup, segments, spread=assessment.vehicle.spread
    )
    if band is None:
        return []
    low_wh, high_wh = band
    rows = {
        "time_min": _rounded(np.append(0.0, columns.end_s[segments]) / 60.0, 4),
        "p10_wh": _rounded(np.append(0.0, low_wh), 3),
        "p90_wh": _rounded(np.append(0.0, high_wh), 3),
    }
    return _rows(rows, np.arange(len(segments) + 1))


def _extremes(time_s: FloatArray, columns: tuple[FloatArray, ...], buckets: int) -> IntArray:
    """Return the rows to keep: the first of each bucket of time, the last, and the extremes."""
    count = len(time_s)
    if count <= _EXTREMES * buckets:
        return np.arange(count)
    bucket = np.minimum((time_s / time_s[-1] * buckets).astype(np.intp), buckets - 1)
    kept = [np.flatnonzero(np.diff(bucket, prepend=-1)), np.array([count - 1])]
    for column in columns:
        for values in (column, -column):
            order = np.lexsort((values, bucket))  # the highest of a bucket stands last in it
            kept.append(order[np.flatnonzero(np.diff(bucket[order], append=-1))])
    return np.unique(np.concatenate(kept))


def _rounded(values: FloatArray, digits: int) -> list[float | None]:
    return [None if value != value else value for value in np.round(values, digits).tolist()]  # noqa: PLR0124 - NaN is not itself


def _rows(columns: dict[str, list[Any]], kept: IntArray) -> list[Row]:
    chosen = kept.tolist()
    lists = [[column[index] for index in chosen] for column in columns.values()]
    return [dict(zip(columns, row, strict=True)) for row in zip(*lists, strict=True)]
