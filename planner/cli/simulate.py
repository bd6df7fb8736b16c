"""``mavjoule simulate``: a vehicle that is not there, to try things out on."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any

import click

from planner import quantity
from planner.autopilot import Autopilot
from planner.cli.configuration import mission_settings
from planner.cli.link import LINK_OPTIONS
from planner.cli.options import (
    MISSION_PATH,
    given_settings,
    kind_option,
    path_option,
    setting_options,
)
from planner.cli.output import narrate
from planner.errors import UsageError
from planner.setting import Choice, Group, Number
from planner.setup import Setup
from planner.values import replace

if TYPE_CHECKING:
    from pathlib import Path

    from planner.link.address import LinkAddress
    from planner.simulator.vehicle import SimulatedVehicle
    from planner.simulator.wire import PassedMessage

_AUTOPILOTS = {"px4": Autopilot.PX4, "arducopter": Autopilot.ARDUPILOT}
_RETRY_S = 10.0
"""A pilot who may not arm tries again after this. [s]"""


@click.command("simulate", short_help="Speak as a vehicle that holds a mission and flies it.")
@click.argument("mission", type=MISSION_PATH)
@kind_option(
    "--as", Choice(_AUTOPILOTS), "whose manners it has", name="autopilot", default=Autopilot.PX4
)
@click.option(
    "--url",
    default="udpout:127.0.0.1:14550",
    metavar="URL",
    help="the vehicle's end of the line [default: udpout:127.0.0.1:14550]",
)
@kind_option(
    "--speed-up",
    Number("", 0.0, 1000.0, is_open=True),
    "seconds of flight in a second of the clock",
    default=1.0,
    metavar="X",
)
@kind_option(
    "--arm-after",
    Number("s", 0.0, 86_400.0),
    "fly the mission after so many seconds, and try again as long as it may not [default: it stays "
    "on the ground]",
)
@click.option(
    "--authoriser",
    type=click.IntRange(1, 255),
    metavar="ID",
    help="ask this system before arming, as PX4 does with COM_ARM_AUTH_REQ [default: nobody]",
)
@click.option(
    "--system-id", type=click.IntRange(1, 255), default=1, metavar="ID", help="[default: 1]"
)
@click.option(
    "--faults",
    default="",
    metavar="LIST",
    help="what goes wrong: loss=20%,duplication=,reordering=,delay=S,garbage=,truncation= (-in or "
    "-out for one way), silence=K[:S] after K messages, count=+2, twin, no-files, no-terrain, reject=TEXT, "
    "event=NAME, seed=N",
)
@path_option(
    "--log",
    "logs",
    multiple=True,
    help="a flight log that it has to be downloaded; repeatable [default: one of no use]",
)
@LINK_OPTIONS["signing_key"]
@setting_options(Group.FLIGHT, Group.BATTERY, without={"autopilot"})
def command(
    *,
    mission: str,
    autopilot: Autopilot,
    url: str,
    speed_up: float,
    arm_after: float | None,
    faults: str,
    logs: tuple[Path, ...],
    signing_key: Path | None,
    **options: Any,  # noqa: ANN401 - as click reads them
) -> None:
    """Speak as a vehicle that holds a mission and flies it as predicted.

    Everything it sends is marked as simulated.  It answers over UDP or TCP as PX4 or ArduPilot
    does: mission, fence and rally points both ways, parameters, home, battery, position, logs.  It
    arms by itself alone, with --arm-after; what a ground station wants to set or arm is not done.
    Ctrl-C ends it.

    Exit codes: 2 unusable input, usage or configuration, 3 the line cannot be opened, 130
    interrupted.
    """
    from planner.link.address import read_address
    from planner.mission.files import read_mission
    from planner.service.simulation import (
        SimulationRequest,
        make_simulated_vehicle,
        open_simulation,
    )
    from planner.simulator.faults import read_faults

    address = read_address(url)
    setup = Setup.of(mission_settings(mission, given_settings(options)))
    if setup.target is not None and setup.target.autopilot is not autopilot:
        flown = autopilot.label
        msg = f"--target {setup.target.label} is not firmware of a vehicle simulated as {flown}"
        raise UsageError(msg)
    request = SimulationRequest(
        autopilot=autopilot,
        setup=setup,
        speed_up=speed_up,
        faults=read_faults(faults),
        system=options["system_id"],
        authoriser=options["authoriser"],
        logs=logs,
        signing_key=signing_key,
    )
    vehicle = make_simulated_vehicle(read_mission(mission), request)
    runner, wire = open_simulation(vehicle, request, address)
    try:
        wire.on_message = _report_text
        _introduce(vehicle, mission, address)
        if arm_after is not None:
            vehicle.arm_at(time.monotonic() + arm_after, retry_s=max(arm_after, _RETRY_S))
        runner.run()
    finally:
        runner.close()


def _introduce(vehicle: SimulatedVehicle, mission: str, address: LinkAddress) -> None:
    held = vehicle.mission()
    narrate(
        f"simulating {vehicle.setup.identity.label} with {quantity.count(len(held.items), 'item')} "
        f"of {mission} on {address.text}; Ctrl-C ends it"
    )
    narrate(f"run next, elsewhere: mavjoule fetch {_other_end(address)} -o fetched.plan")


def _other_end(address: LinkAddress) -> str:
    """Return the address at which a ground station meets the vehicle."""
    from planner.link.address import LinkKind

    other = {
        LinkKind.UDP_SEND: LinkKind.UDP_LISTEN,
        LinkKind.UDP_LISTEN: LinkKind.UDP_SEND,
        LinkKind.TCP_LISTEN: LinkKind.TCP_CONNECT,
        LinkKind.TCP_CONNECT: LinkKind.TCP_LISTEN,
    }.get(address.kind)
    if other is None:
        return "URL"
    everywhere = address.host in {"0.0.0.0", "::"}
    return replace(address, kind=other, host="127.0.0.1" if everywhere else address.host).text


def _report_text(passed: PassedMessage) -> None:
    if not passed.is_to_vehicle and passed.message.name == "STATUSTEXT":
        narrate(f"vehicle: {passed.message['text']}")
