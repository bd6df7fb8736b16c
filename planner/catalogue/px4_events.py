"""PX4's events about missions, as what they are told by here: for who searches by their names.

Names of ``events::ID`` in PX4's FeasibilityChecker.cpp and geofence checks, 1.14 to early 2026.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Mapping

PX4_EVENTS: Mapping[str, str] = {
    "navigator_mis_no_home_rel_alt": "M107",
    "navigator_mis_unsup_cmd": "M105",
    "navigator_mis_vtol_items": "M105",
    "navigator_mis_starts_w_landing": "M108",
    "navigator_mis_starts_w_landing2": "M108",
    "navigator_mis_takeoff_too_low": "A106",
    "navigator_mis_takeoff_not_first": "M101",
    "navigator_mis_takeoff_missing": "M116",
    "navigator_mis_land_missing": "M116",
    "navigator_mis_takeoff_or_land_missing": "M116",
    "navigator_mis_add_land_or_rm_to": "M116",
    "navigator_mis_add_to_or_rm_land": "M116",
    "feasibility_mis_in_air_landing_req": "M116",
    "navigator_mis_first_wp_far": "M104",
    "navigator_mis_first_wp_too_far": "M104",
    "navigator_mis_wp_gate_too_close": "M119",
    # Landing patterns are checked on fixed-wing and VTOL vehicles only.
    "navigator_mis_approach_wp_below_land": "M111",
    "navigator_mis_land_wp_inside_orbit_radius": "M111",
    "navigator_mis_unsupported_landing_approach_wp": "M111",
    "navigator_mis_glide_slope_too_steep": "M111",
    "navigator_mis_correct_glide_slope": "M111",
    "navigator_mis_multiple_land": "M111",
    "navigator_mis_land_before_rtl": "M111",
    "navigator_mis_invalid_land": "M111",
    "navigator_mis_do_jump_invalid": "M103",
    "navigator_mis_geofence_violation": "F101",
    "navigator_mis_geofence_path_violation": "F101",
    "navigator_mis_geofence_jump_breach": "F101",
    "navigator_mis_geofence_loiter_breach": "F107",
    "navigator_mis_geofence_no_home": "F104",
    "navigator_mis_geofence_no_home2": "F104",
    "navigator_geofence_invalid_against_home": "F104",
}
"""Code of the rule by name of the event."""


def events_of(code: str) -> tuple[str, ...]:
    """Return the events of PX4 that a rule tells about."""
    return tuple(event for event, rule in PX4_EVENTS.items() if rule == code)
