"""The review of a vehicle on the line, over real sockets on this computer."""

from __future__ import annotations

import asyncio
import socket
import time
from contextlib import asynccontextmanager, suppress
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import pytest
from reviews import rows_of, text_of, what_if_of
from simulated_vehicles import free_port, request, vehicle
from textual.widgets import Input

from planner.autopilot import Autopilot
from planner.errors import UsageError
from planner.guard.energy import Concern, EnergyLeft, EnergyState, EnergyWarning, Progress
from planner.link.address import LinkAddress, LinkKind, read_address
from planner.link.mission import MissionKind
from planner.link.transfers import LinkSettings
from planner.link.vehicle import LinkRequest
from planner.service.simulation import open_simulation
from planner.tui.app import ReviewApp
from planner.tui.screens.live import LiveScreen
from planner.tui.widgets.canvas import VEHICLE, Drawing
from planner.tui.widgets.ground_map import GroundMap
from planner.tui.widgets.profile_plot import ProfilePlot
from planner.tui.widgets.row_list import RowList
from planner.values import replace

if TYPE_CHECKING:
    from collections.abc import AsyncIterator, Callable
    from pathlib import Path

    from textual.message import Message
    from textual.pilot import Pilot

    from planner.guard.session import GuardStatus
    from planner.simulator.vehicle import SimulatedVehicle
    from planner.simulator.wire import PassedMessage, SimulationRunner

pytestmark = pytest.mark.asyncio

DEADLINE_S = 30.0
HARMLESS = {
    "HEARTBEAT",
    "COMMAND_LONG",
    "FILE_TRANSFER_PROTOCOL",  # its gate lets out what reads alone
    "MISSION_REQUEST_LIST",
    "MISSION_REQUEST_INT",
    "MISSION_ACK",
    "PARAM_REQUEST_LIST",
    "PARAM_REQUEST_READ",
}
"""Messages that ask, and change nothing."""
ASKING_COMMANDS = {410, 511, 512, 519, 520}


@dataclass
class Live:
    pilot: Pilot[None]
    screen: LiveScreen
    vehicle: SimulatedVehicle
    runner: SimulationRunner
    happened: asyncio.Event
    passed: list[PassedMessage] = field(default_factory=list)

    async def until(self, is_so: Callable[[], bool]) -> None:
        """Wait until something is so, looking whenever a message was handled."""
        until_s = time.monotonic() + DEADLINE_S
        while not is_so():
            self.happened.clear()
            left_s = until_s - time.monotonic()
            assert left_s > 0.0, f"{self.verdict}\n{self.line}\n{rows_of(self.screen, '#findings')}"
            with suppress(TimeoutError):
                await asyncio.wait_for(self.happened.wait(), left_s)

    @property
    def verdict(self) -> str:
        return text_of(self.screen, "#verdict")

    @property
    def line(self) -> str:
        return text_of(self.screen, "#live")


def drawn(drawing: Drawing) -> str:
    """Return the characters of a drawing."""
    return "".join(drawing.render_line(y).text for y in range(drawing.size.height))


@asynccontextmanager
async def live(speed_up: float = 1.0) -> AsyncIterator[Live]:
    """Review a simulated ArduPilot vehicle."""
    port = free_port(socket.SOCK_DGRAM)
    asked = request(Autopilot.ARDUPILOT, speed_up=speed_up)
    made = vehicle(Autopilot.ARDUPILOT, speed_up=speed_up)
    address = LinkAddress(kind=LinkKind.UDP_SEND, host="127.0.0.1", port=port)
    runner, wire = open_simulation(made, asked, address)
    passed: list[PassedMessage] = []
    wire.on_message = passed.append
    url = f"udpin:127.0.0.1:{port}"
    given = {
        "vehicle": asked.setup.vehicle.name,
        "battery": asked.setup.battery,
        "wind": asked.setup.wind,
    }
    link = LinkRequest(
        address=read_address(url), settings=LinkSettings(reply_timeout_s=0.5, retries=3)
    )
    app = ReviewApp((url,), lambda _: what_if_of("-", given), link=link)
    happened = asyncio.Event()

    def hear(_: Message) -> None:
        happened.set()

    with runner:
        async with app.run_test(size=(160, 45), message_hook=hear) as pilot:
            await pilot.pause()
            screen = app.screen
            assert isinstance(screen, LiveScreen)
            yield Live(pilot, screen, made, runner, happened, passed)


async def test_what_a_vehicle_holds_and_flies_is_followed_and_nothing_commanded(
    tmp_path: Path,
) -> None:
    async with live(speed_up=8.0) as one:
        await one.until(lambda: "✔ GO" in one.verdict and "battery" in one.line)
        assert "udpin:127.0.0.1" in one.verdict
        assert "battery 100 %" in one.line
        assert "on the ground" in one.line
        assert len(rows_of(one.screen, "#items")) == 4
        await one.pilot.press("s")
        saved = tmp_path / "saved.plan"
        one.pilot.app.screen.query_one("#name", Input).value = str(saved)
        await one.pilot.press("enter")
        await one.until(saved.exists)
        one.vehicle.arm_at(one.runner.now_s())
        await one.until(lambda: "in flight" in one.line and " into the flight" in one.line)
        assert "above the reserve" in one.line
        plot, ground = one.screen.query_one(ProfilePlot), one.screen.query_one(GroundMap)
        assert VEHICLE in drawn(plot)
        assert VEHICLE in drawn(ground)
        sent = [passed.message for passed in one.passed if passed.is_to_vehicle]
    assert {message.name for message in sent} <= HARMLESS
    commands = {message["command"] for message in sent if message.name == "COMMAND_LONG"}
    assert commands <= ASKING_COMMANDS
    assert '"fileType": "Plan"' in saved.read_text(encoding="utf-8")


async def test_a_change_on_the_vehicle_is_checked_again_and_its_silence_leaves_no_verdict() -> None:
    async with live() as one:
        await one.until(lambda: "✔ GO" in one.verdict)
        held = one.vehicle.missions.lists[MissionKind.MISSION]
        held.pop(3)  # the farther waypoint, home being the first
        await one.until(lambda: len(rows_of(one.screen, "#items")) == 3 and "✔ GO" in one.verdict)
        one.runner.close()
        await one.until(lambda: "NO VERDICT" in one.verdict)
        assert "NO SIGNAL" in one.line
        assert "last verdict: GO" in one.verdict


async def test_what_is_wrong_in_flight_leads_the_findings_and_is_no_go() -> None:
    async with live() as one:
        await one.until(lambda: "✔ GO" in one.verdict and "battery" in one.line)
        plain = len(rows_of(one.screen, "#findings"))
        state = _short()
        screen = one.screen
        told = screen.reported

        def tell_short(status: GuardStatus) -> None:
            told(replace(status, is_flying=True, energy=state))

        screen.reported = tell_short  # type: ignore[method-assign] # as if it flew so
        await one.until(lambda: "NO-GO" in one.verdict)
        assert "In flight: a return now lands 5.00 Wh below the reserve" in one.verdict
        found = rows_of(one.screen, "#findings")
        assert [cells[1] for cells in found[:2]] == ["V111", "V113"]
        assert found[0][0] == "✖"
        assert len(found) == plain + 2
        screen.reported = told  # type: ignore[method-assign]
        await one.until(lambda: "✔ GO" in one.verdict)
        assert len(rows_of(one.screen, "#findings")) == plain


async def test_changes_are_offered_for_what_a_vehicle_holds() -> None:
    async with live() as one:
        await one.until(lambda: "✔ GO" in one.verdict)
        charge = one.vehicle.state_at(0.0).state_of_charge
        assert charge is not None
        field = one.screen.query_one("#set-charge", Input)
        # The vehicle's, and not the 100 % that a file is checked with.
        await one.until(lambda: field.placeholder == f"{charge * 100.0:.0f}%")
        one.screen.query_one("#set-battery", Input).value = "60Wh"
        one.screen.query_one("#set-reserve", Input).value = "65%"
        await one.until(lambda: "would make it a GO" in one.verdict)
        assert "NO-GO" in one.verdict
        assert any("battery" in cells[1] for cells in rows_of(one.screen, "#suggestions"))


def _short() -> EnergyState:
    """Return an energy that does for nothing: 15 Wh home, 18 Wh to finish, 10 Wh of reserve."""
    warnings = {
        Concern.NO_RETURN: "a return now lands 5.00 Wh below the reserve",
        Concern.NO_FINISH: "the mission ends 8.00 Wh below the reserve",
    }
    return EnergyState(
        progress=Progress(
            item=2,
            time_s=60.0,
            off_track_m=0.0,
            used_wh=30.0,
            finish_wh=18.0,
            return_wh=15.0,
            return_s=50.0,
            destination=0,
        ),
        left=EnergyLeft(
            energy_wh=20.0, source="charge count", by_source=(("charge count", 20.0),), step_wh=0.1
        ),
        reserve_wh=10.0,
        ratio=None,
        finish_wh=18.0,
        return_wh=15.0,
        lead_s=None,
        warnings=tuple(
            EnergyWarning(concern=concern, severity=2, headline="", text=text)
            for concern, text in warnings.items()
        ),
    )


async def test_a_missing_library_ends_the_review_with_a_sentence(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def open_link(*_: object, **__: object) -> None:
        msg = "a link needs pymavlink"
        raise UsageError(msg)

    monkeypatch.setattr("planner.service.guard.open_link", open_link)
    link = LinkRequest(address=read_address("udpin:127.0.0.1:14550"))
    app = ReviewApp(("udpin:127.0.0.1:14550",), lambda _: what_if_of("-"), link=link)
    async with asyncio.timeout(DEADLINE_S), app.run_test() as pilot:
        while app.return_code is None:
            await pilot.pause()
    assert app.return_code == 2


async def test_as_long_as_nothing_was_read_there_is_no_verdict_and_no_check_has_passed() -> None:
    url = f"udpin:127.0.0.1:{free_port(socket.SOCK_DGRAM)}"
    link = LinkRequest(address=read_address(url), settings=LinkSettings(heartbeat_timeout_s=0.2))
    app = ReviewApp((url,), lambda _: what_if_of("-"), link=link)
    happened = asyncio.Event()
    async with (
        asyncio.timeout(DEADLINE_S),
        app.run_test(size=(160, 45), message_hook=lambda _: happened.set()) as pilot,
    ):
        await pilot.pause()
        screen = app.screen
        assert isinstance(screen, LiveScreen)
        assert text_of(screen, "#verdict").startswith("– NO VERDICT")
        while "LOST" not in text_of(screen, "#live"):
            happened.clear()
            await happened.wait()
        assert "link to the vehicle lost" in text_of(screen, "#verdict")
        findings = screen.query_one("#findings", RowList)
        assert "Not checked yet." in findings.render_line(1).text
        assert "no heartbeat" in screen.lost_by
