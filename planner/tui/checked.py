"""A mission checked, with the very bytes it was checked as."""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import TYPE_CHECKING

from planner import service
from planner.frozen import frozen
from planner.service import CheckResult
from planner.tui.curves import pictures
from planner.tui.ground import ground

if TYPE_CHECKING:
    from planner.checks.case import Case
    from planner.link.vehicle import VehicleSnapshot
    from planner.service import UnreadableMission
    from planner.tui.curves import Picture
    from planner.tui.ground import Ground
    from planner.tui.what_if import WhatIf


@frozen(eq=False)
class Checked:
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
    def case(self) -> Case | None:
        """Everything the rules looked at; ``None`` where nothing is flown."""
        return self.result.case if isinstance(self.result, CheckResult) else None


def checked(file: str, what_if: WhatIf) -> Checked:
    """Check a mission file and work out what is drawn of it.

    Raises
    ------
    ValueError
        If a change does not say a value.
    MavjouleError
        If the settings are unusable.
    """
    request = what_if.request()
    before = file_sha256(file)
    result = service.check_file(file, request)
    case = result.case if isinstance(result, CheckResult) else None
    return Checked(
        file=file,
        what_if=what_if,
        sha256=before if before == file_sha256(file) else None,
        result=result,
        pictures=pictures(case),
        ground=ground(case),
    )


def checked_vehicle(snapshot: VehicleSnapshot, what_if: WhatIf) -> Checked:
    """Check what a vehicle holds, and work out what is drawn of it.

    Raises
    ------
    ValueError
        If a change does not say a value.
    MavjouleError
        If the settings are unusable.
    """
    from planner.live import check_vehicle

    result = check_vehicle(
        snapshot, what_if.request(), is_charge_given="charge" in what_if.values()
    )
    case = result.case if isinstance(result, CheckResult) else None
    return Checked(
        file=snapshot.address,
        what_if=what_if,
        sha256=None,
        result=result,
        pictures=pictures(case),
        ground=ground(case),
        snapshot=snapshot,
    )


def check_what_if(file: str, what_if: WhatIf) -> CheckResult | UnreadableMission:
    """Check a mission file under changed settings, for the result alone."""
    return service.check_file(file, what_if.request())


def file_sha256(file: str) -> str | None:
    """Return the SHA-256 of a file's bytes; ``None`` where it cannot be read."""
    try:
        return hashlib.sha256(Path(file).read_bytes()).hexdigest()
    except OSError:
        return None
