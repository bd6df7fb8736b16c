"""The page put together: one file with its style, its script and its data, and nothing from elsewhere.

What stands in it is escaped by the template; its own scripts are named in its Content-Security-Policy
by their hashes, so that no other text of the page can ever run, and nothing is fetched.
"""

from __future__ import annotations

import base64
import hashlib
import json
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from planner import quantity
from planner.errors import OutputError, libraries_of
from planner.files import write_output_file
from planner.report.figures import KEY_FIGURES, shown_figure
from planner.report.html.mission import mission_view
from planner.report.json import figures
from planner.report.plots.picture_files import chart_config, load_altair, load_converter
from planner.report.text import badness, finding_tally, given_text, given_texts, tally, well_formed
from planner.service.preflight import CheckResult

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from datetime import datetime

    from planner.geo.tiles import TileServer
    from planner.service.preflight import UnreadableMission

    Results = Sequence[CheckResult | UnreadableMission]

_FOLDER = Path(__file__).parent
_BUNDLE = "window.vegaEmbed = vegaEmbed;"
"""What the page uses of the plotting library, which is bundled with all it needs."""
_ROWS_OF_ONE, _ROWS_OF_ALL = 1_750, 7_000
"""Rows of the tables behind the pictures: of a mission, and of all missions of a page together."""
_FEWEST_ROWS = 140


def refuse_without_libraries() -> None:
    """Raise ``UsageError`` where the libraries of ``mavjoule[report]`` are not installed."""
    load_altair()
    load_converter()
    with libraries_of("report"):
        import jinja2  # noqa: F401 - only whether it is there


def check_html(
    results: Results,
    *,
    version: str,
    made_at: datetime,
    sha256: Mapping[str, str] | None = None,
    sections: Sequence[str] = (),
    title: str = "",
    names: Sequence[str] = (),
    server: TileServer | None = None,
) -> str:
    """Return all missions of a call as a page.

    Several are led by an overview, worst first; on a page with a title the sections, such as
    `planner.report.html.comparison` makes, say of all missions what there is to overview, and the
    missions follow in the order of the call.  ``sha256`` are of the missions' files by their names,
    ``names`` what each mission is called besides its file.  Nothing is fetched by who opens the page but
    the tiles of a base map, where a ``server`` of them is given.

    Raises
    ------
    UsageError
        If a library of ``mavjoule[report]`` is missing.
    """
    refuse_without_libraries()
    hashes = sha256 or {}
    rows = max(min(_ROWS_OF_ONE, _ROWS_OF_ALL // max(len(results), 1)), _FEWEST_ROWS)
    missions = [
        mission_view(
            result,
            number=number,
            sha256=hashes.get(result.file, ""),
            most_rows=rows,
            has_stills=len(results) == 1,
            name=names[number] if names else "",
            server=server,
        )
        for number, result in enumerate(results)
    ]
    order = (
        missions if title else sorted(missions, key=lambda view: badness(results[view["number"]]))
    )
    return page_text(
        title=title or (missions[0]["file"] if len(results) == 1 else tally(results)),
        version=version,
        made_at=made_at,
        has_charts=any(view["charts"] for view in missions),
        is_one=len(results) == 1 and not title,
        missions=order,
        heads=[one.label for one in KEY_FIGURES],
        overview=() if title else _overview(results, order),
        given=given_texts(
            (result.file, given_text(result))
            for result in results
            if isinstance(result, CheckResult)
        ),
        sections=sections,
        payloads=[page_json(view["payload"]) for view in missions],
        images="" if server is None else server.origin,
    )


def page_text(
    *,
    title: str,
    version: str,
    made_at: datetime,
    has_charts: bool,
    is_one: bool = True,
    sections: Sequence[str] = (),
    images: str = "",
    **missions: object,
) -> str:
    """Return a page of sections and missions; what is one has a heading of its own.

    ``images`` is where those come from that are fetched; by default none are.
    """
    style, script = (_text(name) for name in ("page.css", "page.js"))
    scripts = [plotting_bundle(), script] if has_charts else [script]
    empty = {"missions": (), "heads": (), "overview": (), "given": (), "payloads": ()}
    text = template("page.html.j2").render(
        title=title,
        is_one=is_one,
        sections=sections,
        style=style,
        scripts=scripts,
        policy=_policy(scripts, images),
        config=page_json(chart_config("page")),
        version=version,
        made_at=made_at.strftime("%Y-%m-%d %H:%M %Z").strip(),
        **(empty | missions),
    )
    return well_formed(text)


@cache
def plotting_bundle() -> str:
    """Return the plotting library as a script that needs nothing else.

    Putting it together takes seconds and no mission changes it: it is kept in the user's folder of
    caches, by the version of the library it comes from.
    """
    import platformdirs

    converter = load_converter()
    kept = platformdirs.user_cache_path("mavjoule") / f"plotting-{converter.__version__}.js"
    with suppress(OSError, UnicodeError):
        return kept.read_text(encoding="utf-8")
    script: str = converter.javascript_bundle(_BUNDLE).replace("</script", "<\\/script")
    if kept.is_absolute():  # a user without a home has no caches, and a page without is only slower
        with suppress(OSError, OutputError):
            kept.parent.mkdir(parents=True, exist_ok=True)
            write_output_file(kept, script)
    return script


@cache
def template(name: str) -> Any:  # noqa: ANN401 - jinja2 is loaded late
    """Return a template of the page; all it is given is escaped."""
    import jinja2

    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(_FOLDER),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    return environment.get_template(name)


def _overview(results: Results, views: Sequence[dict[str, Any]]) -> list[dict[str, object]]:
    """Return a row for each view of a mission; none for a page of one mission."""
    return [
        {
            **{key: view[key] for key in ("number", "file", "verdict")},
            "rank": rank,
            "numbers": [shown_figure(figures(result), one) for one in KEY_FIGURES],
            "findings": finding_tally(result.findings) or quantity.ABSENT,
        }
        for rank, view in enumerate(views if len(views) > 1 else (), start=1)
        for result in [results[view["number"]]]
    ]


def _text(name: str) -> str:
    return (_FOLDER / name).read_text(encoding="utf-8")


def _policy(scripts: Sequence[str], images: str) -> str:
    """Return the page's policy: its own scripts run, nothing is fetched but images of one origin, if any."""
    hashes = (
        base64.b64encode(hashlib.sha256(script.encode("utf-8")).digest()).decode("ascii")
        for script in scripts
    )
    allowed = " ".join(f"'sha256-{one}'" for one in hashes)
    return (
        f"default-src 'none'; script-src {allowed}; style-src 'unsafe-inline'; "
        f"img-src {f'data: {images}'.strip()}; "
        "base-uri 'none'; form-action 'none'"
    )


def page_json(value: object) -> str:
    """Return JSON that cannot end the element it stands in."""
    text = json.dumps(value, ensure_ascii=True, allow_nan=False, separators=(",", ":"))
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")
