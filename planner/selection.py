"""Which findings are reported, and why the others are not; none is ever dropped.

A baseline holds findings that were seen and accepted.  A finding is known by its words: another
number, item or severity makes it another finding, which is reported, so a shortfall that has grown
comes back.  Errors about energy, vehicle, fence, ground and vehicles that meet (those whose rule names
what to give instead) take part in every verdict: nothing here switches them off.
"""

from __future__ import annotations

import os
import re
from pathlib import Path, PurePath
from typing import TYPE_CHECKING, Literal

import msgspec

from planner import catalogue
from planner.errors import BaselineFileError
from planner.files import meets_pattern, read_bounded, refuse_pattern, write_output_file
from planner.findings import Severity
from planner.values import Value, replace

if TYPE_CHECKING:
    from collections.abc import Iterable

    from planner.findings import Finding

_ITEM = r"(?P<pattern>.+)#(?P<item>\d+)"
_MOST_BYTES = 1 << 26
"""250,000 findings of 256 bytes."""


class KnownFinding(Value, order=True, forbid_unknown_fields=True):
    """What makes a finding the same as one seen before."""

    file: str
    """Path from the baseline's folder, with forward slashes; ``-`` for standard input."""
    item: int
    """Mission item from 1; 0 where none applies."""
    code: str
    severity: str
    message: str


class _BaselineDocument(Value, forbid_unknown_fields=True):
    schema: Literal[1]
    known: tuple[KnownFinding, ...]


class Baseline(Value):
    """The findings of a baseline file."""

    source: str
    folder: Path
    """The folder of the file, from which its paths count."""
    known: frozenset[KnownFinding]

    def holds(self, finding: Finding, *, file: str) -> bool:
        """Return whether a finding of a mission is known, and may be."""
        return not is_kept_on(finding) and _known(finding, file, self.folder) in self.known


class Exemption(Value):
    """Codes that are not reported of one mission, or of one of its items."""

    codes: tuple[str, ...]
    """Codes, or beginnings of codes."""
    item: int | None = None
    """Mission item from 1 in flown order; ``None``: every item, and what has none."""
    origin: str
    """Where it is written, for whoever wonders why a finding is not reported."""

    def covers(self, finding: Finding) -> bool:
        """Return whether a finding of the mission is not to be reported."""
        is_here = self.item is None or self.item == finding.item
        return is_here and finding.code.startswith(self.codes)


class FileIgnore(Value):
    """Codes not to report of the missions whose path meets a pattern.

    A pattern without a slash is met by a file of that name in any folder below the configuration's;
    one with a slash counts from that folder.  A star stays within a name, ``**`` stands for any
    folders.
    """

    folder: Path
    """Where the configuration is."""
    pattern: str
    exemption: Exemption

    def meets(self, mission: Path) -> bool:
        """Return whether the path of a mission meets the pattern; one beside the folder meets none."""
        if not mission.is_relative_to(self.folder):
            return False
        return meets_pattern(mission.relative_to(self.folder), self.pattern)


def make_file_ignore(key: str, codes: tuple[str, ...], *, configuration: Path) -> FileIgnore:
    """Return what one key of ``[per_file_ignores]`` and its codes ignore.

    ``#12`` at the end of a key means the mission's item 12.

    Raises
    ------
    ValueError
        If the key can mean no file or no item.
    """
    with_item = re.fullmatch(_ITEM, key)
    pattern = with_item["pattern"] if with_item else key
    item = int(with_item["item"]) if with_item else None
    if item == 0:
        msg = "items count from 1, home is none"
        raise ValueError(msg)
    refuse_pattern(pattern)
    return FileIgnore(
        folder=configuration.parent.resolve(),
        pattern=pattern,
        exemption=Exemption(codes=codes, item=item, origin=f"{key} in {configuration.name}"),
    )


def exemptions_of(ignores: Iterable[FileIgnore], mission: Path) -> tuple[Exemption, ...]:
    """Return the exemptions that a mission meets, by its path from the current folder."""
    whole = mission.parent.resolve() / mission.name
    return tuple(one.exemption for one in ignores if one.meets(whole))


class Selection(Value):
    """What is asked to be reported; by default everything."""

    select: tuple[str, ...] = ()
    """Codes, or beginnings of codes, of the findings to report; empty: all."""
    extend_select: tuple[str, ...] = ()
    """Codes, or beginnings of codes, to report whatever ``select`` and ``ignore`` say."""
    ignore: tuple[str, ...] = ()
    """Codes, or beginnings of codes, of the findings not to report."""
    exemptions: tuple[Exemption, ...] = ()
    baseline: Baseline | None = None
    """Findings that are known already."""

    def asks_for(self, code: str) -> bool:
        """Return whether a rule that is off by default is selected."""
        return code.startswith((*self.select, *self.extend_select))

    def divide(
        self, findings: Iterable[Finding], *, file: str
    ) -> tuple[tuple[Finding, ...], tuple[Finding, ...]]:
        """Return the findings to report and those not, each worst first, then by item.

        Parameters
        ----------
        findings : iterable of Finding
            Everything that was found about one mission.
        file : str
            The mission's file, as the baseline may know it.

        Returns
        -------
        reported, suppressed : tuple of Finding
            The second with the reason as their ``suppression``.
        """
        ordered = sorted(findings, key=lambda f: (-f.severity, f.item or 0, f.code))
        reasons = [self.reason(finding, file=file) for finding in ordered]
        both = list(zip(ordered, reasons, strict=True))
        return (
            tuple(finding for finding, reason in both if reason is None),
            tuple(replace(finding, suppression=reason) for finding, reason in both if reason),
        )

    def reason(self, finding: Finding, *, file: str) -> str | None:
        """Return why a finding is not to be reported; ``None`` where it is."""
        code = finding.code
        if is_kept_on(finding):
            return None
        if not code.startswith(self.extend_select):
            if self.select and not code.startswith(self.select):
                return f"not among the selected codes {', '.join(self.select)}"
            for start in self.ignore:
                if code.startswith(start):
                    return f"ignored as {start}"
        for exemption in self.exemptions:
            if exemption.covers(finding):
                return f"ignored by {exemption.origin}"
        if self.baseline is not None and self.baseline.holds(finding, file=file):
            return f"known from {self.baseline.source}"
        return None


def is_kept_on(finding: Finding) -> bool:
    """Return whether a finding takes part in every verdict, whatever is selected or ignored."""
    if finding.severity is not Severity.ERROR:
        return False
    entry = catalogue.entries().get(finding.code)
    return entry is not None and bool(entry.instead)


def read_baseline(path: Path) -> Baseline:
    """Return the baseline in a file.

    Raises
    ------
    BaselineFileError
        If the file cannot be read or is no baseline.
    """
    source = str(path)
    try:
        data = read_bounded(path, most_bytes=_MOST_BYTES, error=BaselineFileError, what="baseline")
        document = msgspec.json.decode(data, type=_BaselineDocument)
    except msgspec.ValidationError as error:
        msg = "is not a baseline of this version: write it again with --write-baseline"
        raise BaselineFileError(msg, source=source) from error
    except (ValueError, RecursionError) as error:  # msgspec's own, or text that is not UTF-8
        msg = f"is not JSON: {error}"
        raise BaselineFileError(msg, source=source) from error
    return Baseline(source=source, folder=_folder(path), known=frozenset(document.known))


def write_baseline(path: Path, findings: Iterable[tuple[str, Finding]]) -> tuple[int, int]:
    """Write findings, each with the file of its mission, as a baseline.

    Returns
    -------
    written, refused : int
        How many findings the baseline holds, and how many it must not hold.

    Raises
    ------
    OutputError
        If the file cannot be written; what was there before is untouched.
    """
    import json

    given = list(findings)
    known = {
        _known(finding, file, _folder(path)) for file, finding in given if not is_kept_on(finding)
    }
    document = msgspec.to_builtins(_BaselineDocument(schema=1, known=tuple(sorted(known))))
    write_output_file(path, json.dumps(document, ensure_ascii=True, indent=2) + "\n")
    return len(known), sum(is_kept_on(finding) for _, finding in given)


def _known(finding: Finding, file: str, folder: Path) -> KnownFinding:
    return KnownFinding(
        file=_path_from(folder, file),
        item=finding.item or 0,
        code=finding.code,
        severity=finding.severity.label,
        message=finding.message,
    )


def _folder(path: Path) -> Path:
    return Path(os.path.abspath(path)).parent  # noqa: PTH100 - as the missions': links not followed


def _path_from(folder: Path, file: str) -> str:
    if file == "-":
        return file
    whole = os.path.abspath(file)  # noqa: PTH100 - links not followed
    try:
        return PurePath(os.path.relpath(whole, folder)).as_posix()
    except ValueError:  # another drive
        return PurePath(whole).as_posix()
