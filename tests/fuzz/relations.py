"""A fuzz target of what two checks have to say of each other: nothing has to be known of the right answer.

An input is one of the whole pipeline with the name of a relation and an amount.  Each relation changes the
input, and says what must hold between the two results, and why.
"""

from __future__ import annotations

import json
import math
from random import Random
from typing import TYPE_CHECKING, Any, NamedTuple

from fuzz.pipeline import checked, drawn_settings, rough_plan, sound_plan
from fuzz.target import Target

from planner.cli.check_output import rendered
from planner.errors import ExitCode
from planner.mission.convert import convert_mission
from planner.mission.files import read_mission_bytes
from planner.mission.items import MissionFormat
from planner.setup import Output
from planner.vehicle.parameters.table import parameter_table

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from planner.service.preflight import CheckResult

Document = dict[str, Any]

_SAME = 1e-6
"""Of a figure: places are rounded to 1e-14 of a degree where they are moved, some nanometres of legs of
metres; the solvers of motion stop at 1e-9."""
_HOME_AMSL_M = 400.0


class Relation(NamedTuple):
    """What is changed, and what must hold then; ``None`` for an input that cannot be changed so."""

    change: Callable[[Document, float], Document | None]
    holds: Callable[[CheckResult, CheckResult], None]


def _close(one: float | None, other: float | None, what: str) -> None:
    if one is None or other is None:
        assert one is other, what
        return
    if math.isnan(one) and math.isnan(other):  # not known: of a model without power
        return
    is_same = math.isclose(one, other, rel_tol=_SAME, abs_tol=_SAME)
    assert is_same, f"{what}: {one!r} and {other!r}"


def _same_figures(one: CheckResult, other: CheckResult) -> None:
    for name in ("time_s", "distance_m", "climb_m", "descent_m", "energy_wh", "peak_power_w"):
        _close(getattr(one.totals, name), getattr(other.totals, name), name)
    if one.battery is not None and other.battery is not None:
        _close(one.battery.margin_wh, other.battery.margin_wh, "margin_wh")
    ways = [
        None if result.return_plan is None else result.return_plan.energy_home_wh
        for result in (one, other)
    ]
    _close(ways[0], ways[1], "energy_home_wh")


def _errors(result: CheckResult) -> set[str]:
    return {one.code for one in result.findings if one.severity >= result.setup.fail_on}


def _same_judgement(one: CheckResult, other: CheckResult) -> None:
    _same_figures(one, other)
    margin_wh = math.inf if one.battery is None else abs(one.battery.margin_wh)
    if margin_wh > _SAME:
        assert _errors(one) == _errors(other), f"{_errors(one)} and {_errors(other)}"
        assert one.verdict == other.verdict


def _no_better(one: CheckResult, other: CheckResult) -> None:
    """Hold that the second, which has less or asks for more, is no go where the first is none."""
    if one.battery is not None and other.battery is not None:
        more_wh = other.battery.margin_wh - one.battery.margin_wh
        assert more_wh <= _SAME, f"margin grew by {more_wh} Wh"
    if one.verdict == "no-go":
        assert other.verdict == "no-go", f"{_errors(one)} gone"


def _no_harsher(one: CheckResult, other: CheckResult) -> None:
    """Hold that the second, of which more is known or allowed, flies the same and finds no more errors."""
    _same_figures(one, other)
    assert _errors(other) <= _errors(one), f"{_errors(other) - _errors(one)} added"


def _same_bytes(one: CheckResult, other: CheckResult) -> None:
    for name in ("json", "text"):
        texts = [
            rendered([result], Output(format=name), exit_code=ExitCode.GO)
            for result in (one, other)
        ]
        assert texts[0] == texts[1], name


def _plan(document: Document) -> Any:  # noqa: ANN401 - JSON
    return json.loads(document["mission"])


def _with_plan(document: Document, plan: object, *, indent: int | None = None) -> Document:
    return document | {"mission": json.dumps(plan, indent=indent)}


def _set(**options: str) -> Callable[[Document, float], Document]:
    return lambda document, _: document | {"settings": document["settings"] | options}


def _less(key: str, least: float, most: float, form: str) -> Callable[..., Document]:
    """Return a change of a setting by an amount from 0 to 1; that it begins from has to be the least."""

    def change(document: Document, amount: float) -> Document:
        text = form.format(least + (most - least) * amount)
        return document | {"settings": document["settings"] | {key: text}}

    return change


def _moved(plan: Any, place: Callable[[float, float], tuple[float, float]]) -> Any:  # noqa: ANN401 - JSON
    home = plan["mission"]["plannedHomePosition"]
    home[:2] = place(*home[:2])
    for one in plan["mission"]["items"]:
        if one["params"][4:6] != [0, 0]:
            one["params"][4:6] = place(*one["params"][4:6])
    for one in plan["geoFence"]["circles"]:
        one["circle"]["center"] = place(*one["circle"]["center"])
    for one in plan["geoFence"]["polygons"]:
        one["polygon"] = [place(*corner) for corner in one["polygon"]]
    for one in plan["rallyPoints"]["points"]:
        one[:2] = place(*one[:2])
    return plan


def _eastward(document: Document, amount: float) -> Document:
    turn = round(amount * 360.0) - 180.0
    if amount >= 0.7 and not _plan(document)["geoFence"]["polygons"]:
        turn = 172.0  # home is on the antimeridian; polygons across it are refused
    elif abs(turn - 172.0) < 6.0:  # so far from home the farthest corner is
        turn = 160.0

    def place(latitude: float, longitude: float) -> tuple[float, float]:
        east = round((longitude + turn + 180.0) % 360.0 - 180.0, 7)
        return latitude, east

    return _with_plan(document, _moved(_plan(document), place))


_MIRRORED = {"5@270": "5@270", "12@0": "12@180", "30@90": "30@90", "3@45": "3@135", "0": "0"}
"""Winds, and their mirror images in the equator."""


def _mirrored(document: Document, _: float) -> Document | None:
    wind = document["settings"].get("wind", "0")
    if wind not in _MIRRORED:
        return None
    changed = _with_plan(document, _moved(_plan(document), lambda south, east: (-south, east)))
    if "wind" in document["settings"]:
        changed["settings"] = document["settings"] | {"wind": _MIRRORED[wind]}
    return changed


def _unrolled(document: Document, _: float) -> Document | None:
    plan = _plan(document)
    items = plan["mission"]["items"]
    jumps = [number for number, one in enumerate(items) if one["command"] == 177]
    if len(jumps) != 1:
        return None
    [at] = jumps
    first, times = int(items[at]["params"][0]) - 1, int(items[at]["params"][1])
    again = [dict(one) for _ in range(times) for one in items[first:at]]
    flat = items[:at] + again + items[at + 1 :]
    plan["mission"]["items"] = [one | {"doJumpId": n} for n, one in enumerate(flat, 1)]
    return _with_plan(document, plan)


def _as_text(document: Document, _: float) -> Document | None:
    """Convert to a waypoint file, which has no firmware: that of the model counts."""
    mission = read_mission_bytes(document["mission"].encode(), source="a.plan")
    has_areas = bool(mission.fence or mission.rally)  # the text has neither
    if has_areas or document["settings"]["vehicle"] not in {"px4-sih-quad", "arducopter-sitl-quad"}:
        return None
    return document | {"mission": convert_mission(mission, MissionFormat.WPL).text}


def _amsl(document: Document, _: float) -> Document:
    plan = _plan(document)
    for one in plan["mission"]["items"]:
        if one["frame"] == 3 and one["command"] != 21:
            one["frame"] = 0
            one["params"][6] += _HOME_AMSL_M
    return _with_plan(document, plan)


def _held_longer(document: Document, amount: float) -> Document | None:
    plan = _plan(document)
    held = [one for one in plan["mission"]["items"] if one["command"] == 19]
    if not held:
        return None
    held[0]["params"][0] += 1.0 + 100.0 * amount
    return _with_plan(document, plan)


def _kept_out(document: Document, amount: float) -> Document:
    plan = _plan(document)
    middle = [47.0 + 0.01 * (amount - 0.5), 8.0 + 0.002]
    circle = {"circle": {"center": middle, "radius": 100.0}, "inclusion": False, "version": 1}
    plan["geoFence"]["circles"].append(circle)
    return _with_plan(document, plan)


def _fenced_far(document: Document, _: float) -> Document:
    plan = _plan(document)
    corners = [[47.0 + i, 8.0 + j] for i, j in ((-0.5, -0.7), (-0.5, 0.7), (0.5, 0.7), (0.5, -0.7))]
    plan["geoFence"]["polygons"].append({"polygon": corners, "inclusion": True, "version": 1})
    return _with_plan(document, plan)


def _with_camera(document: Document, amount: float) -> Document | None:
    plan = _plan(document)
    items = plan["mission"]["items"]
    if any(one["command"] == 177 for one in items):
        return None
    camera = items[-1] | {"command": 206, "frame": 2, "params": [0, 0, 0, 0, 0, 0, 0]}
    items.insert(1 + int(amount * (len(items) - 1)), camera)
    plan["mission"]["items"] = [one | {"doJumpId": n} for n, one in enumerate(items, 1)]
    return _with_plan(document, plan)


def _given_in_full(document: Document, _: float) -> Document | None:
    """Give every parameter that the flight is predicted with, as the file of the vehicle would."""
    flown = checked(document).parameters
    if flown is None:
        return None
    rows = parameter_table(type(flown)).items()
    lines = [
        f"{row.now.name},{getattr(flown, quantity) / (1.0 if row.is_choice else row.now.si(1.0))!r}"
        for quantity, row in rows
    ]
    return document | {"parameters": "\n".join(lines)}


def _on_ground(document: Document, _: float) -> Document:
    return document | {"ground_amsl_m": _HOME_AMSL_M}


def _commented(document: Document, _: float) -> Document | None:
    if not document["parameters"]:
        return None
    lines = document["parameters"].splitlines()
    return document | {"parameters": "\n".join(["# a vehicle", *reversed(lines)])}


RELATIONS: Mapping[str, Relation] = {
    # The same is asked: the same is answered, to the byte.
    "again": Relation(lambda document, _: dict(document), _same_bytes),
    # The Earth is a solid of revolution, and mirrored at its equator: only the names of places change.
    "eastward": Relation(_eastward, _same_judgement),
    "mirrored": Relation(_mirrored, _same_judgement),
    # White space and the order of parameters have no meaning; a frame is a way to write an altitude.
    "laid-out": Relation(lambda d, _: _with_plan(d, _plan(d), indent=3), _same_judgement),
    "reordered": Relation(_commented, _same_judgement),
    "amsl": Relation(_amsl, _same_figures),
    # A format is a way to write a mission, a jump a way to write items again.
    "as-text": Relation(_as_text, _same_judgement),
    "unrolled": Relation(_unrolled, _same_figures),
    # What is the default may be typed: knowing it is no worse, and no better.
    "in-full": Relation(_given_in_full, _same_figures),
    "home": Relation(_set(home_amsl_m="400"), _same_judgement),
    "full": Relation(_set(charge="100%"), _same_judgement),
    "fifth": Relation(_set(reserve="20%"), _same_judgement),
    "empty": Relation(_set(payload_kg="0"), _same_judgement),
    # A camera is no part of the flight; level ground at home's height is what every flight assumes, and a
    # fence that nothing comes near forbids nothing.
    "camera": Relation(_with_camera, _same_figures),
    "ground": Relation(_on_ground, _no_harsher),
    "fenced-far": Relation(_fenced_far, _no_harsher),
    # Less in the battery, more to keep in it, more to carry, longer to hover: none of them helps.
    "reserve": Relation(_less("reserve", 20, 100, "{:.0f}%"), _no_better),
    "charge": Relation(_less("charge", 100, 1, "{:.0f}%"), _no_better),
    "health": Relation(_less("battery_health", 100, 20, "{:.0f}%"), _no_better),
    "payload": Relation(_less("payload_kg", 0.01, 2, "{:.3f}"), _no_better),
    "risk": Relation(_less("risk", 50, 0.1, "{:.1f}%"), _no_better),
    "warnings": Relation(_set(fail_on="warning"), _no_better),
    "longer": Relation(_held_longer, _no_better),
    "vaguer": Relation(_less("position_error_m", 0, 30, "{:.1f}"), _no_better),
    "slower": Relation(_less("reaction_time_s", 0, 20, "{:.1f}"), _no_better),
    # A place that may not be flown over is one more way to be wrong.
    "kept-out": Relation(_kept_out, _no_better),
}
_BEGUN: Mapping[str, Mapping[str, str]] = {
    "full": {}, "fifth": {}, "empty": {}, "home": {},
    "reserve": {"reserve": "20%"},
    "charge": {"charge": "100%"},
    "health": {"battery_health": "100%", "reserve": "12Wh"},  # a share of less is less
    "payload": {"payload_kg": "0"},
    "risk": {"risk": "50%"},
    "vaguer": {"position_error_m": "0"},
    "slower": {"reaction_time_s": "0"},
    "warnings": {"fail_on": "error"},
}  # fmt: skip
"""Settings that a relation begins from; all others are drawn."""
_KEYS = {"full": "charge", "fifth": "reserve", "empty": "payload_kg", "home": "home_amsl_m"}
_ROUGH = frozenset(
    {"again", "laid-out", "reordered", "full", "fifth", "empty"}
    | {"reserve", "charge", "health", "payload", "risk", "warnings", "vaguer", "slower"}
)
"""What holds of any mission, and not only of those on the grid of degrees."""
_PARAMETERS = {
    "px4-sih-quad": ("MPC_XY_CRUISE,7", "RTL_RETURN_ALT,40", "NAV_ACC_RAD,5", "MPC_Z_V_AUTO_DN,2"),
    "arducopter-sitl-quad": (
        "WPNAV_SPEED,700",
        "RTL_ALT,4000",
        "WPNAV_RADIUS,300",
        "LAND_SPEED,40",
    ),
}


def _made(draw: Random) -> bytes:
    name = draw.choice(tuple(RELATIONS))
    options = drawn_settings(draw)
    for key in ("fail_on", "ignore", "target", "home_amsl_m", _KEYS.get(name)):
        options.pop(key or "", None)
    options |= _BEGUN.get(name, {})
    options["battery"] = draw.choice(("20Wh", "60Wh", "170Wh", "5.2Ah@14.8V", "4000Wh"))
    lines = _PARAMETERS.get(options["vehicle"], ())
    chosen = draw.sample(lines, draw.randrange(len(lines) + 1)) if draw.random() < 0.4 else []
    document = {
        "mission": rough_plan(draw) if name in _ROUGH and draw.random() < 0.4 else sound_plan(draw),
        "settings": options,
        "parameters": "\n".join(chosen),
        "relation": name,
        "amount": round(draw.random(), 6),
    }
    return json.dumps(document).encode()


def run(data: bytes) -> None:
    """Check an input and its changed form; raise where their relation does not hold."""
    document = json.loads(data)
    relation = RELATIONS[document["relation"]]
    changed = relation.change(document, document["amount"])
    if changed is not None:
        relation.holds(checked(document), checked(changed))


def relations() -> Target:
    """Return the target."""
    return Target("relations", [_made(Random(1))], run, make=_made)
