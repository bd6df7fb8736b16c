"""A check signed by a person: every input with its hash, the numbers, and what has changed since."""

from __future__ import annotations

import hashlib
import math
import os
from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import msgspec

from planner import __version__
from planner.errors import InputError, OutputError, UsageError
from planner.files import read_bounded, write_output_file
from planner.report.figures import FIGURES, number_at
from planner.report.json import (
    checks_document,
    envelope,
    finding_document,
    json_text,
    mission_document,
    values,
)
from planner.report.text import finding_message
from planner.service.preflight import UnreadableMission, check_file
from planner.setting import File, Switch
from planner.setup import SETTINGS_FILE, Setup, settings
from planner.values import Value, field_values
from planner.vehicle.library import DEFAULT_MODEL, model_names
from planner.vehicle.reader import models_root

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence
    from datetime import datetime

    from planner.findings import Finding
    from planner.service.preflight import CheckResult
    from planner.site_profile import ManualItem

_MOST_BYTES = 1 << 24
_WHAT = "sign-off"
_SAME = 1e-6
"""Numbers this near to each other, relatively, are the same: libraries round differently."""
Decision = Literal["released", "refused"]


class SignedInput(Value):
    """A file that decides the verdict, and the very bytes that did."""

    input: str
    """What it is: ``mission``, ``settings``, or the key of the setting that names it."""
    file: str
    """Counted from the folder of the sign-off; ``models/NAME.toml`` for a shipped model."""
    sha256: str | None
    """``None`` where it cannot be read."""


class SignedFinding(Value):
    """What was found when it was signed."""

    code: str
    name: str
    severity: str
    item: int | None
    message: str


class _SignedBy(Value):
    name: str
    version: str


class SignOff(Value):
    """A sign-off as it is read back; what is not compared is left out."""

    tool: _SignedBy
    decision: Decision
    verdict_text: str
    signed_by: str
    signed_at: str
    mission: str
    """The mission's file, counted from the folder of the sign-off."""
    inputs: tuple[SignedInput, ...]
    settings: dict[str, Any]
    """What was given besides the settings file, by key."""
    numbers: dict[str, Any]
    findings: tuple[SignedFinding, ...]


class SignOffChange(Value):
    """Something that is not as it was signed."""

    kind: Literal["input", "verdict", "figure", "finding"]
    subject: str
    signed: str | None
    now: str | None

    @property
    def message(self) -> str:
        """The change in a line."""
        if self.now is None:
            return f"{self.subject}: {self.signed}; now gone"
        if self.signed is None:
            return f"{self.subject}: {self.now}; new"
        return f"{self.subject}: {self.signed} when signed, {self.now} now"


class VerifiedSignOff(Value):
    """A sign-off beside the same check made anew."""

    file: str
    sign_off: SignOff
    result: CheckResult | UnreadableMission
    changes: tuple[SignOffChange, ...]

    @property
    def is_valid(self) -> bool:
        """Whether the flight was released, and everything is as it was then."""
        return (
            self.sign_off.decision == "released"
            and self.result.verdict == "go"
            and not self.changes
        )


def decision_of(result: CheckResult | UnreadableMission) -> Decision:
    """Return what can be signed of a check: only a go is released."""
    return "released" if result.verdict == "go" else "refused"


def sign_off_paths(mission: str) -> tuple[Path, ...]:
    """Return the sign-offs of a mission that are there, the first one first."""
    found: list[Path] = []
    while (path := _sign_off_path(mission, len(found) + 1)).exists() or path.is_symlink():
        found.append(path)
    return tuple(found)


def _sign_off_path(mission: str, number: int) -> Path:
    """Return where a sign-off of a mission goes: beside it, each to a file of its own."""
    return Path(f"{mission}.signoff.json" if number == 1 else f"{mission}.signoff-{number}.json")


def _reserved_path(mission: str) -> Path:
    """Return a new file for a sign-off, made here: no other one is ever written over."""
    while True:
        path = _sign_off_path(mission, len(sign_off_paths(mission)) + 1)
        try:
            path.touch(exist_ok=False)
        except FileExistsError:
            continue  # someone else signed at this moment
        except OSError as error:
            msg = f"{path}: cannot be written: {error.strerror or error}"
            raise OutputError(msg) from error
        return path


def write_sign_off(
    shown: CheckResult | UnreadableMission,
    values_by_key: Mapping[str, Any],
    *,
    command: str,
    manual: Sequence[tuple[ManualItem, bool]],
    who: str,
    at: datetime,
) -> Path:
    """Write that a person has seen a check and decided; return the file, a new one beside the mission.

    The mission is checked again here, between two looks at every input, so that what is signed is
    what was seen.

    Parameters
    ----------
    shown : CheckResult or UnreadableMission
        The check that is signed.
    values_by_key : mapping
        The settings it was made with.
    command : str
        The command that makes it.
    manual : sequence
        What a person has to look at, each with whether it is done.
    who : str
        Who signs.
    at : datetime
        The time, with its zone.

    Raises
    ------
    UsageError
        If the name is missing, a manual item of a go is open, or an input changed after the check.
    OutputError
        If the file cannot be written.
    """
    decision = decision_of(shown)
    still_open = [item for item, is_done in manual if not is_done]
    problem = ""
    if not who.strip():
        problem = "name missing: type who signs"
    elif still_open and decision == "released":
        problem = f"not ticked off: {still_open[0].section}: {still_open[0].prompt}"
    if problem:
        raise UsageError(problem)
    folder = Path(shown.file).parent
    before = _inputs(shown.file, values_by_key, folder)
    again = check_file(shown.file, Setup.of(values_by_key))
    numbers = _numbers(again)
    if (
        _signed_findings(shown.findings) != (findings := _signed_findings(again.findings))
        or numbers != _numbers(shown)
        or before != _inputs(shown.file, values_by_key, folder)
    ):
        msg = "an input changed after the check: check it again first"
        raise UsageError(msg)
    document = envelope(__version__) | {
        "mission": Path(shown.file).name,
        "decision": decision,
        "verdict": again.verdict,
        "verdict_text": again.verdict_text,
        "signed_by": who.strip(),
        "signed_at": at.isoformat(timespec="seconds"),
        "command": command,
        "inputs": [field_values(one) for one in before],
        "settings": dict(_stored_settings(values_by_key, folder)),
        "numbers": numbers,
        "manual": [
            {"section": item.section, "prompt": item.prompt, "done": is_done}
            for item, is_done in manual
        ],
        "findings": [field_values(one) for one in findings],
        "suppressed": [field_values(one) for one in _signed_findings(again.suppressed)],
        "checks": checks_document(again.checked),
    }
    path = _reserved_path(shown.file)
    try:
        write_output_file(path, json_text(document, indent=2))
    except OutputError:
        path.unlink(missing_ok=True)
        raise
    return path


def read_sign_off(path: Path) -> SignOff:
    """Read a sign-off.

    Raises InputError if the file is none, or was signed before inputs were signed with it.
    """
    data = read_bounded(path, most_bytes=_MOST_BYTES, error=InputError, what=_WHAT)
    try:
        return msgspec.json.decode(data, type=SignOff)
    except (msgspec.DecodeError, UnicodeDecodeError) as error:
        msg = f"is not a sign-off that can be recomputed: {error}; sign the mission again"
        raise InputError(msg, source=str(path)) from error


def signed_settings(path: Path, signed: SignOff) -> dict[str, Any]:
    """Return what was given for the check that a file signs, by key; paths count from the file.

    Raises InputError if a setting is not one, or has another value.
    """
    known, given = settings(), {}
    for key, raw in signed.settings.items():
        try:
            kind = known[key].kind
            is_toml = isinstance(kind, File | Switch)
            given[key] = kind.from_toml(raw, path) if is_toml else kind.read(str(raw))
        except (KeyError, ValueError) as error:
            why = error if isinstance(error, ValueError) else "not a setting of this version"
            msg = f"{why}; sign the mission again"
            raise InputError(msg, source=str(path), key=f"settings.{key}") from error
    return given


def verified_sign_off(
    path: Path, signed: SignOff, values_by_key: Mapping[str, Any]
) -> VerifiedSignOff:
    """Make a signed check anew under settings as they are now, and compare."""
    folder, mission = path.parent, str(path.parent / signed.mission)
    inputs = _inputs(mission, values_by_key, folder)
    result = check_file(mission, Setup.of(values_by_key))
    changes = [*_changes_of_inputs(signed.inputs, inputs)]
    if signed.verdict_text != result.verdict_text:
        change = SignOffChange(
            kind="verdict", subject="verdict", signed=signed.verdict_text, now=result.verdict_text
        )
        changes.append(change)
    if not isinstance(result, UnreadableMission):  # which has none
        changes += _changes_of_figures(signed.numbers, _numbers(result))
    changes += _changes_of_findings(signed.findings, _signed_findings(result.findings))
    return VerifiedSignOff(file=str(path), sign_off=signed, result=result, changes=tuple(changes))


def sign_off_text(verified: VerifiedSignOff) -> str:
    """Return what has changed since a check was signed, as text."""
    signed, result = verified.sign_off, verified.result
    by = f"{signed.verdict_text}, {signed.decision} by {signed.signed_by} at {signed.signed_at}"
    lines = [f"{verified.file}: {by} (mavjoule {signed.tool.version})"]
    now = f"Recomputed with mavjoule {__version__}: {result.verdict_text}"
    if verified.changes:
        lines.append(f"{now}; changed since:")
        lines += [f"  {change.message}" for change in verified.changes]
    else:
        lines.append(f"{now}, nothing has changed.")
    if verified.is_valid:
        lines.append("VALID: the flight is released as signed.")
    else:
        was_refused = signed.decision == "refused"
        why = (
            "it was refused" if was_refused else "sign the check again after a look at the changes"
        )
        lines.append(f"NOT VALID: {why}.")
    return "\n".join(lines) + "\n"


def sign_off_json(verified: VerifiedSignOff) -> str:
    """Return what has changed since a check was signed, as a JSON document."""
    signed = verified.sign_off
    return json_text(
        envelope(__version__)
        | {
            "sign_off": verified.file,
            "mission": verified.result.file,
            "is_valid": verified.is_valid,
            **values(signed, ("decision", "signed_by", "signed_at")),
            "signed_with": signed.tool.version,
            "signed_verdict_text": signed.verdict_text,
            "verdict": verified.result.verdict,
            "verdict_text": verified.result.verdict_text,
            "changes": [
                values(change, ("kind", "subject", "signed", "now", "message"))
                for change in verified.changes
            ],
            "findings": [finding_document(finding) for finding in verified.result.findings],
        },
        indent=2,
    )


def _inputs(
    mission: str, values_by_key: Mapping[str, Any], folder: Path
) -> tuple[SignedInput, ...]:
    """Return every file that decides a verdict, with its hash."""
    named: list[tuple[str, str | Path]] = [("mission", mission)]
    if (file := values_by_key.get(SETTINGS_FILE)) is not None:
        named.append(("settings", file.path))
    for key, setting in settings().items():
        value = values_by_key.get(key, DEFAULT_MODEL if key == "vehicle" else None)
        if isinstance(setting.kind, File) and value is not None:
            several = value if isinstance(value, tuple) else (value,)
            named += [(key, one) for one in several]
    return tuple(_input(name, file, folder) for name, file in named)


def _input(name: str, file: str | Path, folder: Path) -> SignedInput:
    if name == "vehicle" and file in model_names():
        path, shown = models_root() / f"{file}.toml", f"models/{file}.toml"
    else:
        path, shown = Path(file), _counted_from(folder, file)
    try:
        with path.open("rb") as data:
            digest = hashlib.file_digest(data, "sha256").hexdigest()
    except OSError:
        digest = None
    return SignedInput(input=name, file=shown, sha256=digest)


def _counted_from(folder: Path, file: str | Path) -> str:
    """Return a path counted from a folder, so that both can be moved together."""
    try:
        return Path(os.path.relpath(file, folder)).as_posix()
    except ValueError:  # on another drive
        return str(Path(file).resolve())


def _stored_settings(
    values_by_key: Mapping[str, Any], folder: Path
) -> Iterator[tuple[str, str | bool | list[str]]]:
    """Yield what was given besides the settings file, as `signed_settings` reads it."""
    file = values_by_key.get(SETTINGS_FILE)
    of_file = {SETTINGS_FILE} if file is None else {SETTINGS_FILE, *dict(file.values)}
    for key, value in values_by_key.items():
        if key in of_file or key not in settings():
            continue
        kind = settings()[key].kind
        if isinstance(kind, File):
            several = value if isinstance(value, tuple) else (value,)
            is_name = key == "vehicle" and value in model_names()
            paths = [str(one) if is_name else _counted_from(folder, one) for one in several]
            yield key, paths if isinstance(value, tuple) else paths[0]
        elif isinstance(kind, Switch):
            yield key, bool(value)
        else:
            yield key, kind.text(value)


def _numbers(result: CheckResult | UnreadableMission) -> dict[str, object]:
    document = mission_document(result)
    return {key: document[key] for key in ("vehicle", "conditions", "totals", "battery", "return")}


def _changes_of_inputs(
    signed: Sequence[SignedInput], now: Sequence[SignedInput]
) -> Iterator[SignOffChange]:
    """Yield the inputs that are others, changed or gone."""
    before, after = ({(one.input, one.file): one.sha256 for one in each} for each in (signed, now))
    for key in dict.fromkeys([*before, *after]):
        if key not in before or key not in after or before[key] != after[key]:
            yield SignOffChange(
                kind="input",
                subject=" ".join(key),
                signed=_digest_text(before, key),
                now=_digest_text(after, key),
            )


def _digest_text(digests: Mapping[tuple[str, str], str | None], key: tuple[str, str]) -> str | None:
    if key not in digests:
        return None
    digest = digests[key]
    return "cannot be read" if digest is None else f"SHA-256 {digest[:12]}…"


def _changes_of_figures(signed: dict[str, Any], now: dict[str, Any]) -> Iterator[SignOffChange]:
    for table, figures in FIGURES:
        for figure in figures:
            was, then = number_at(signed, figure.path), number_at(now, figure.path)
            if was == then or (
                was is not None
                and then is not None
                and math.isclose(was, then, rel_tol=_SAME, abs_tol=_SAME)
            ):
                continue
            texts = [figure.text(was), figure.text(then)]
            if texts[0] == texts[1]:  # less than is shown
                texts = [f"{was:.9g}", f"{then:.9g}"]
            yield SignOffChange(
                kind="figure", subject=f"{table}, {figure.label}", signed=texts[0], now=texts[1]
            )


def _signed_findings(findings: Sequence[Finding]) -> tuple[SignedFinding, ...]:
    return tuple(
        SignedFinding(
            code=one.code,
            name=one.name,
            severity=one.severity.label,
            item=one.item,
            message=finding_message(one),
        )
        for one in findings
    )


def _changes_of_findings(
    signed: Sequence[SignedFinding], now: Sequence[SignedFinding]
) -> Iterator[SignOffChange]:
    """Yield the findings that are gone, then those that are new; their numbers are compared as figures."""
    for found, others, is_new in ((signed, now, False), (now, signed, True)):
        known = Counter(_key(one) for one in others)
        for one in found:
            if known[_key(one)]:
                known[_key(one)] -= 1
                continue
            yield SignOffChange(
                kind="finding",
                subject=f"{one.code} {one.name} ({one.severity})",
                signed=None if is_new else one.message,
                now=one.message if is_new else None,
            )


def _key(finding: SignedFinding) -> tuple[str, str, int | None]:
    return finding.code, finding.severity, finding.item
