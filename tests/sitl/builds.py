"""Simulated vehicles of real firmware: started in a folder of their own, armed and flown by pymavlink."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pymavlink import mavutil

from planner.autopilot import Autopilot

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

PILOT = 250
"""System id of who arms: a ground station beside the one that is tried."""
_LATITUDE_DEG, _LONGITUDE_DEG, _AMSL_M = 47.397742, 8.545594, 488.0
_READY_S = 90.0
_COPTER = {
    "AUTO_OPTIONS": 3,  # arms in AUTO, and takes off without a stick
    # Three cells, as the frame is made for: its thrust goes by the square of the voltage.
    "SIM_BATT_VOLTAGE": 12.6,
    "BATT_CAPACITY": 8000,
    "LOG_FILE_DSRMROT": 1,  # a log each flight
}
_PX4 = {
    "SIH_KDV": 0.15,  # as the shipped model was flown
    "MIS_COMMAND_TOUT": 5,
    "COM_ARM_AUTH_REQ": 1,
    "COM_ARM_AUTH_ID": 245,
    "COM_ARM_AUTH_MET": 0,
    "COM_ARM_AUTH_TO": 5,
}
LOW_M = 0.5
"""As good as on the ground, whatever its own height has drifted by. [m]"""
_STABILIZE, _AUTO, _MAIN_AUTO, _SUB_LOITER, _SUB_MISSION = 0, 3, 4, 3, 4
_PX4_LOITER = _MAIN_AUTO << 16 | _SUB_LOITER << 24
_PX4_MISSION = _MAIN_AUTO << 16 | _SUB_MISSION << 24
_PREARM = 1 << 28
_SAID = re.compile(r"^(dis)?arm(?:ing motors|ed by)", re.IGNORECASE)
"""What both report at once, where their heartbeats come once a second."""


@dataclass
class Build:
    """One build that runs."""

    autopilot: Autopilot
    folder: Path
    url: str
    """Where the product calls it."""
    pilot_url: str
    """Where the pilot does."""
    process: subprocess.Popen[bytes]
    boot_s: float = 0.0
    """Its own clock, which may run faster. [s]"""
    is_armed: bool = False
    mode: int = 0
    """Its own number of it."""
    armed_s: float | None = None
    """When it armed, by the first sign of it; ``None`` since it was asked. [s]"""
    disarmed_s: float | None = None
    down_s: float | None = None
    """When it last came lower than LOW_M. [s]"""
    texts: list[str] = field(default_factory=list)
    results: dict[int, int] = field(default_factory=dict)
    """By command, the latest MAV_RESULT."""
    _line: Any = None

    def stop(self) -> None:
        """End it."""
        if self._line is not None:
            self._line.close()
        self.process.terminate()
        try:
            self.process.wait(10.0)
        except subprocess.TimeoutExpired:
            self.process.kill()

    def call(self) -> None:
        """Listen as the pilot, until the vehicle may arm."""
        self._line = mavutil.mavlink_connection(self.pilot_url, source_system=PILOT)
        until_s = time.monotonic() + _READY_S
        is_ready = False
        while not is_ready:
            if time.monotonic() > until_s:
                msg = f"{self.autopilot} is not ready after {_READY_S:.0f} s: see {self.folder}"
                raise TimeoutError(msg)
            self._line.mav.heartbeat_send(6, 8, 0, 0, 0)
            for one in self.heard(1.0):
                if one.get_type() == "SYS_STATUS":
                    is_ready = bool(one.onboard_control_sensors_health & _PREARM)
            for number, rate_hz in ((1, 2.0), (33, 20.0), (245, 5.0)):
                self._command(511, number, 1e6 / rate_hz)

    def heard(self, duration_s: float) -> Iterator[Any]:
        """Yield the vehicle's messages in a time by our clock, and keep what they say."""
        until_s = time.monotonic() + duration_s
        while (left_s := until_s - time.monotonic()) > 0.0:
            one = self._line.recv_match(blocking=True, timeout=left_s)
            if one is None or one.get_srcComponent() != 1:
                continue
            match one.get_type():
                case "GLOBAL_POSITION_INT":
                    self.boot_s = one.time_boot_ms / 1e3
                    if one.relative_alt > 1e3 * LOW_M:
                        self.down_s = None
                    elif self.down_s is None:
                        self.down_s = self.boot_s
                case "HEARTBEAT":
                    self.is_armed = bool(one.base_mode & 128)
                    self.mode = one.custom_mode
                    self._note(is_armed=self.is_armed)
                case "STATUSTEXT":
                    self.texts.append(one.text)
                    if said := _SAID.search(one.text):
                        self._note(is_armed=said[1] is None)
                case "COMMAND_ACK":
                    self.results[one.command] = one.result
            yield one

    def _note(self, *, is_armed: bool) -> None:
        if is_armed and self.armed_s is None:
            self.armed_s = self.boot_s
        elif not is_armed and self.armed_s is not None and self.disarmed_s is None:
            self.disarmed_s = self.boot_s

    def until(self, is_so: Callable[[], bool], longest_s: float) -> bool:
        """Listen until something is so; return whether it is, in time by our clock."""
        until_s = time.monotonic() + longest_s
        while not is_so():
            if time.monotonic() > until_s:
                return False
            self._line.mav.heartbeat_send(6, 8, 0, 0, 0)
            for _ in self.heard(0.1):
                if is_so():
                    break
        return True

    def set(self, name: str, value: float) -> None:
        """Set a whole parameter of PX4's, which has it byte by byte, or one of ArduPilot's."""
        import struct

        is_px4 = self.autopilot is Autopilot.PX4
        sent = struct.unpack("<f", struct.pack("<i", int(value)))[0] if is_px4 else value
        for _ in range(3):
            target = (self._line.target_system, 1)
            self._line.mav.param_set_send(*target, name.encode(), sent, 6 if is_px4 else 9)
            for _ in self.heard(0.2):
                pass

    def arm(self, longest_s: float = 15.0) -> bool:
        """Ask it to fly its mission; return whether it armed."""
        self.results.clear()
        self.texts.clear()
        self.armed_s = self.disarmed_s = None
        # Another mode first, or the last mission counts as flown.
        if self.autopilot is Autopilot.PX4:
            self._enter(_PX4_LOITER, _MAIN_AUTO, _SUB_LOITER)
            self._enter(_PX4_MISSION, _MAIN_AUTO, _SUB_MISSION)
        else:
            self._enter(_STABILIZE, _STABILIZE)
            self._enter(_AUTO, _AUTO)
        self._command(400, 1)
        # PX4 answers a second request while it waits for the first one's answer by nothing.
        return self.until(
            lambda: self.is_armed or self.results.get(400) not in {None, 0}, longest_s
        ) and (self.until(lambda: self.is_armed, 3.0))

    def _enter(self, mode: int, *numbers: float) -> None:
        """Have it enter a mode, asking again: a mission that has just come is judged first."""
        for _ in range(10):
            self._command(176, 1, *numbers)
            if self.until(lambda: self.mode == mode, 1.0):
                return

    def disarm(self) -> None:
        """Disarm it, whatever it does."""
        self._command(400, 0, 21196)
        self.until(lambda: not self.is_armed, 5.0)

    def fly(self, longest_s: float) -> float | None:
        """Fly the mission; return the time armed, by its clock: ``None`` where it did not. [s]"""
        if not self.arm():
            return None
        if not self.until(lambda: self.disarmed_s is not None, longest_s):
            self.disarm()
            return None
        self.until(lambda: not self.is_armed, 10.0)
        assert self.armed_s is not None
        assert self.disarmed_s is not None
        return self.disarmed_s - self.armed_s

    def _command(self, number: int, *params: float) -> None:
        padded = (*params, *[0.0] * (7 - len(params)))
        self._line.mav.command_long_send(self._line.target_system, 1, number, 0, *padded)


def start_ardupilot(binary: Path, folder: Path, *, instance: int, speed: float) -> Build:
    """Start ArduCopter in a folder."""
    own = folder / "own.parm"
    own.write_text("".join(f"{name} {value}\n" for name, value in _COPTER.items()))
    tree = binary.resolve().parents
    found = [binary.with_name("copter.parm")]
    found += [one / "Tools/autotest/default_params/copter.parm" for one in tree]
    defaults = next((one for one in found if one.exists()), None)
    files = ",".join(str(one) for one in (defaults, own) if one is not None)
    place = f"{_LATITUDE_DEG},{_LONGITUDE_DEG},{_AMSL_M},0"
    options = ["-w", "--model", "quad", "--speedup", str(speed), "--home", place]
    process = _started(
        [str(binary.resolve()), *options, "--defaults", files, "-I", str(instance)], folder
    )
    port = 5760 + 10 * instance
    return Build(
        Autopilot.ARDUPILOT, folder, f"tcp:127.0.0.1:{port}", f"tcp:127.0.0.1:{port + 2}", process
    )


def start_px4(binary: Path, folder: Path, *, instance: int, speed: float) -> Build:
    """Start PX4 with its simulator in hardware's quadrotor in a folder."""
    binary = binary.resolve()
    candidates = (binary.with_name("px4-etc"), binary.parent.parent / "etc")
    etc = next((one for one in candidates if one.is_dir()), None)
    if etc is None:
        msg = f"{binary}: its etc folder is neither beside it nor above it"
        raise FileNotFoundError(msg)
    programs = folder / "bin"
    programs.mkdir(exist_ok=True)
    shutil.copy(binary, programs / "px4")
    alias = shutil.copy(binary.with_name("px4-alias.sh"), programs / "px4-alias.sh")
    for name in re.findall(r"^alias ([a-z0-9_]*)=", Path(alias).read_text(), re.MULTILINE):
        link = programs / f"px4-{name}"
        if not link.is_symlink():
            link.symlink_to("px4")
    environment = {
        "PX4_SIM_MODEL": "sihsim_quadx",
        "PX4_SIMULATOR": "sihsim",
        "PX4_SIM_SPEED_FACTOR": str(speed),
        "HEADLESS": "1",
        "SIH_NOISE": "0.02",  # a fraction; the clock of this build stands still with none
        **{f"PX4_PARAM_{name}": str(value) for name, value in _PX4.items()},
    }
    order = [str(programs / "px4"), "-d", "-i", str(instance), "-w", str(folder), str(etc)]
    process = _started(order, folder, environment)
    ports = (etc / "init.d-posix/px4-rc.mavlink").read_text()
    return Build(
        Autopilot.PX4,
        folder,
        f"udpin:127.0.0.1:{_port(ports, 'udp_offboard_port_remote', instance)}",
        f"udpin:127.0.0.1:{_port(ports, 'udp_gcs_port_remote', instance)}",
        process,
    )


def _port(script: str, name: str, instance: int) -> int:
    """Return a port that PX4's start script sends to."""
    found = re.search(rf"^{name}=(.*)$", script, re.MULTILINE)
    assert found is not None, name
    (number,) = re.findall(r"\d{4,5}", found[1])
    return int(number) + (instance if "px4_instance" in found[1] else 0)


def _started(
    order: list[str], folder: Path, environment: dict[str, str] | None = None
) -> subprocess.Popen[bytes]:
    with (folder / "output.txt").open("wb") as output:
        return subprocess.Popen(
            order,
            cwd=folder,
            env={**os.environ, **(environment or {})},
            stdin=subprocess.DEVNULL,
            stdout=output,
            stderr=subprocess.STDOUT,
        )
