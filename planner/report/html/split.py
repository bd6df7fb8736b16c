"""A mission split into flights, as a section of the page: who flies what, and each one's budget."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from planner import quantity
from planner.report.figures import KEY_FIGURES, ShownFigure, shown_figure
from planner.report.html.mission import finding_view
from planner.report.html.page import page_json, template
from planner.report.plots.picture_files import still_svg
from planner.report.plots.split import split_energy_figure, split_map_figure
from planner.report.split import flown_text, part_document, together

if TYPE_CHECKING:
    from planner.service.split import Split

_TITLES = {"map": "Map of the parts", "energy": "Energy of each part"}


def split_section(split: Split) -> Any:  # noqa: ANN401 - Markup of jinja2, loaded late
    """Return a ``section`` that shows the parts of a mission, for `check_html`; its text is escaped.

    The parts are the missions of the page, in their order.

    Raises
    ------
    UsageError
        If a library of ``mavjoule[report]`` is missing.
    """
    figures = {"map": split_map_figure(split), "energy": split_energy_figure(split)}
    payload = {name: figure.to_dict(validate=False) for name, figure in figures.items()}
    sums = together(split)
    rows = [
        {
            "verdict": part.result.verdict_text,
            "flies": flown_text(part),
            "numbers": [shown_figure(part_document(part), one) for one in KEY_FIGURES],
        }
        for part in split.parts
    ]
    totals = {
        key: ShownFigure("", shown(sums[key]), key, sums[key])
        for key, shown in (("time_s", quantity.duration), ("energy_wh", quantity.energy))
    }
    return template("split.html.j2").module.split(
        heads=[one.label for one in KEY_FIGURES],
        columns=[one.path.partition(".")[2] for one in KEY_FIGURES],
        rows=rows,
        totals=totals,
        charts=_TITLES,
        stills={name: still_svg(spec) for name, spec in payload.items()},
        payload=page_json(payload),
        findings=[
            finding_view(finding, number, has_place=False)
            for number, finding in enumerate(split.findings)
        ],
    )
