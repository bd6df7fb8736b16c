"""A mission checked, with the very bytes it was checked as; and the files that decide its verdict."""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import TYPE_CHECKING

from planner.cli.configuration import OWN_FILE, SHARED_FILE
from planner.service.preflight import CheckResult, Steps, WhatIfSteps, check_file
from planner.tui.widgets.ground_map import ground
from planner.tui.widgets.profile_plot import pictures
from planner.values import Value, replace

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from planner.link.snapshot import VehicleSnapshot
    from planner.mission.items import Mission
    from planner.rules.assessment import Assessment
    from planner.service.preflight import UnreadableMission
    from planner.setup import Setup
    from planner.tui.what_if import WhatIf
    from planner.tui.widgets.ground_map import Ground
    from planner.tui.widgets.profile_plot import Picture


class Checked(Value, eq=False):
    """One mission under one set of settings, and what is drawn of it."""

    file: str
    what_if: WhatIf
    sha256: str | None
    """Of the file's bytes; ``None`` where they changed while it was checked, or cannot be read."""
    result: CheckResult | UnreadableMission
    pictures: tuple[Picture, ...] = ()
    ground: Ground | None = None
    snapshot: VehicleSnapshot | None = None
    """The vehicle that it was read from; ``None`` where it was a file."""

    @property
    def assessment(self) -> Assessment | None:
        """Everything the rules looked at; ``None`` where nothing is flown."""
        return self.result.assessment if isinstance(self.result, CheckResult) else None

    @property
    def tried_speed(self) -> str:
        """The speed at which the file has to be saved for the result to be its own; empty: it is already."""
        speed = self.what_if.changes.get("speed_m_s")
        return f"{speed} m/s" if speed is not None and self.snapshot is None else ""

    @property
    def reported(self) -> dict[str, str]:
        """What a vehicle on the line reports in place of settings that are not given, by key."""
        if self.snapshot is None:
            return {}
        battery, home = self.snapshot.state.battery, self.snapshot.mission.home
        found = {}
        if battery is not None and battery.remaining_fraction is not None:
            found["charge"] = f"{battery.remaining_fraction * 100.0:.0f}%"
        if home is not None and home.altitude_amsl_m is not None:
            found["home_amsl_m"] = f"{home.altitude_amsl_m:.1f}"
        return found


def checked(source: str | VehicleSnapshot, what_if: WhatIf) -> Checked:
    """Check a mission file or what a vehicle holds, and work out what is drawn of it.

    Raises ``ValueError`` if a change is no value, `MavjouleError` if the settings are unusable.
    """
    snapshot = None if isinstance(source, str) else source
    file = source if isinstance(source, str) else source.address
    before = file_sha256(file) if snapshot is None else None
    result = _check(source, what_if)
    assessment = result.assessment if isinstance(result, CheckResult) else None
    return Checked(
        file=file,
        what_if=what_if,
        sha256=before if before is not None and before == file_sha256(file) else None,
        result=result,
        pictures=pictures(assessment),
        ground=ground(assessment),
        snapshot=snapshot,
    )


def _check(source: str | VehicleSnapshot, what_if: WhatIf) -> CheckResult | UnreadableMission:
    if isinstance(source, str):
        # A speed that is tried is that of a mission which may be saved with it.
        steps = WhatIfSteps() if "speed_m_s" in what_if.changes else Steps()
        return check_file(source, what_if.setup(), steps=steps)
    from planner.service.vehicle import check_vehicle

    return check_vehicle(source, what_if.setup(), is_charge_given="charge" in what_if.values())


def check_again(checked: Checked, changes: Mapping[str, str]) -> CheckResult | UnreadableMission:
    """Check a mission, or what a vehicle held, under more changes, for the result alone."""
    what_if = checked.what_if.with_changes({**checked.what_if.changes, **changes})
    return _check(checked.snapshot or checked.file, what_if)


def check_inputs(checked: Checked, assessment: Assessment) -> tuple[Mission, Setup]:
    """Return mission and setup of a check; a file that they name may be unusable by now."""
    setup = replace(checked.what_if.setup(), parameters=assessment.setup.parameters)
    if checked.snapshot is not None:
        # the vehicle's own charge, where it reports one
        setup = replace(setup, charge=assessment.setup.charge)
    return assessment.mission, setup


def file_sha256(file: str) -> str | None:
    """Return the SHA-256 of a file's bytes; ``None`` where it cannot be read."""
    try:
        return hashlib.sha256(Path(file).read_bytes()).hexdigest()
    except OSError:
        return None


_FILES = ("params", "profile", "baseline")
"""Settings that name a file."""


def deciding_files(file: str, what_if: WhatIf) -> tuple[Path, ...]:
    """Return the files that decide a verdict: mission, model, parameters, profile, configuration.

    Files that are typed and not there yet count too.
    """
    values = {**what_if.settings, **what_if.changes}
    named = [Path(str(values[key])) for key in _FILES if values.get(key)]
    vehicle = str(values.get("vehicle") or "")
    if vehicle.endswith(".toml"):
        named.append(Path(vehicle))
    named += values.get("terrain", ())
    folder = Path(file).parent.resolve()
    places = (folder, *folder.parents)
    settings = [place / name for place in places for name in (OWN_FILE, SHARED_FILE)]
    return tuple(dict.fromkeys((Path(file), *named, *settings)))


WATCH_S = 1.0
"""How often the files of one mission are looked at. [s]"""


class FileWatch:
    """When files were written, as far as they were looked at."""

    def __init__(self) -> None:
        self._stamps: dict[Path, tuple[int, int] | None] = {}

    def follow(self, files: Iterable[Path]) -> None:
        """Look at files from now on, at others no longer."""
        self._stamps = {
            file: self._stamps[file] if file in self._stamps else _stamp(file) for file in files
        }

    def changed(self) -> tuple[Path, ...]:
        """Return the files that were written, made or removed since the last look."""
        before, self._stamps = self._stamps, {file: _stamp(file) for file in self._stamps}
        return tuple(file for file, stamp in self._stamps.items() if stamp != before[file])


def _stamp(file: Path) -> tuple[int, int] | None:
    """Return when a file was written and how long it is; ``None`` where it is not there."""
    try:
        found = file.stat()
    except OSError:
        return None
    return found.st_mtime_ns, found.st_size
