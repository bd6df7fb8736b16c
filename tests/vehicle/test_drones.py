"""The library of common drones: models that ``make drones`` writes from one table of published figures.

``python tests/vehicle/test_drones.py`` writes them, and their table in models/README.md (``make drones``).
"""

from __future__ import annotations

from pathlib import Path

import pytest

from planner.autopilot import Autopilot
from planner.service.endurance import predict_endurance
from planner.vehicle.data_sheet import drone_sheet, vehicle_from_data_sheet
from planner.vehicle.drones import FIGURES, PublishedDrone, drone_table
from planner.vehicle.library import load_vehicle
from planner.vehicle.priors import ideal_hover_w, multicopter_priors
from planner.vehicle.reader import models_root
from planner.vehicle.writer import vehicle_text, write_vehicle

README = Path(__file__).parents[2] / "models" / "README.md"
BEGIN, END = "<!-- library begins -->\n\n", "\n<!-- library ends -->"
REMARKS = ("Written by make drones from models/priors/drones.toml.",)
MODELS = [one for one in drone_table().drones if one.is_model]


def library_text() -> str:
    rows = ["| model | vehicle | compared with a page | as remembered |", "|---|---|---|---|"]
    for one in MODELS:
        given = [name for name in FIGURES if getattr(one.sources, name) is not None]
        compared = [name for name in given if name not in one.remembered]
        remembered = [name for name in given if name in one.remembered]
        rows.append(
            f"| `{one.name}` | {one.description} | {', '.join(compared)} | {', '.join(remembered)} |"
        )
    return "\n".join(rows) + "\n"


def rendered(readme: str) -> str:
    begin, end = readme.index(BEGIN) + len(BEGIN), readme.index(END)
    return readme[:begin] + library_text() + readme[end:]


@pytest.mark.parametrize("drone", MODELS, ids=lambda one: one.name)
def test_the_models_are_those_of_the_table(drone: PublishedDrone) -> None:
    made = vehicle_from_data_sheet(drone_sheet(drone, date=drone_table().date))
    file = models_root() / f"{drone.name}.toml"
    assert file.read_text(encoding="utf-8") == vehicle_text(made, remarks=REMARKS), "make drones"


def test_the_table_of_the_readme_is_that_of_the_library() -> None:
    readme = README.read_text(encoding="utf-8")
    assert readme == rendered(readme), "make drones"


def test_a_hover_time_gives_the_hover() -> None:
    # six batteries of 99.9 Wh that last 35 min, DJI says, of which 0.93 is what hovering takes: 956 W
    hover = predict_endurance(load_vehicle("dji-matrice-600")).hover
    assert hover is not None
    assert hover.power_w == pytest.approx(0.93 * 6.0 * 99.9 * 60.0 / 35.0, rel=0.03)


def test_what_nobody_measured_says_so_and_how_it_moves() -> None:
    for drone in MODELS:
        provenance = load_vehicle(drone.name).provenance
        assert provenance.basis is not None
        assert not provenance.basis.is_flown
        assert not provenance.logs
        is_closed = drone.autopilot is None
        assert ("moves like dji-matrice-100" in " ".join(provenance.readings)) is is_closed
        assert (load_vehicle(drone.name).reference is Autopilot.STEP) is is_closed


def test_every_figure_names_whose_it_is() -> None:
    for drone in drone_table().drones:
        readings = drone.notes
        assert len(readings) >= 2, drone.name
        for reading in readings:
            assert ("compared with https://" in reading) is not ("as remembered" in reading)


def test_no_published_drone_hovers_on_less_than_its_disk_takes() -> None:
    for drone in drone_table().drones:
        figure = drone.figure
        if figure is None or drone.mass_kg is None or drone.propeller_m is None:
            continue
        taken_w = drone.battery.energy_wh / (figure.value / 60.0)
        ideal_w = ideal_hover_w(drone.mass_kg, drone.rotors, drone.propeller_m)
        assert 1.4 < taken_w / ideal_w < 4.5, drone.name


def test_less_is_known_of_a_drone_without_a_figure_of_its_hover() -> None:
    def fraction(name: str) -> float:
        spread = load_vehicle(name).spread
        assert spread is not None
        assert spread.energy_fraction is not None
        return spread.energy_fraction

    assert fraction("dji-matrice-600") == pytest.approx(
        multicopter_priors()["hover_time"].fraction, abs=0.005
    )
    assert fraction("dji-matrice-600") < fraction("3dr-iris-plus") < fraction("freefly-astro")


if __name__ == "__main__":
    for one in MODELS:
        sheet = drone_sheet(one, date=drone_table().date)
        path = models_root() / f"{one.name}.toml"
        write_vehicle(path, vehicle_from_data_sheet(sheet), remarks=REMARKS)
    README.write_text(rendered(README.read_text(encoding="utf-8")), encoding="utf-8")
