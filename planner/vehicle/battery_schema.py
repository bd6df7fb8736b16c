"""The part of the schema that describes batteries, and the cells they are made of."""

from __future__ import annotations

from planner.vehicle.consistency import battery_problems, chemistry_problems
from planner.vehicle.keys import Key, Kind, Table

_RESISTANCE_CURVE = (
    Key(
        name="resistance_temperature_c",
        kind=Kind.NUMBERS,
        unit="°C",
        meaning="battery temperatures, rising; beyond them the factor of the nearest",
        required=False,
        at_least=-60.0,
        at_most=100.0,
        least_count=1,
        is_rising=True,
    ),
    Key(
        name="resistance_factor",
        kind=Kind.NUMBERS,
        meaning="resistance at each temperature over the given one",
        required=False,
        above=0.0,
        least_count=1,
    ),
)

BATTERY = Table(
    name="battery",
    meaning=(
        "The battery the vehicle flies with; optional, --battery replaces it.  Give an energy, or a "
        "charge and either the nominal voltage or an open-circuit curve; an energy alone leaves the "
        "charge unknown.  With a curve and a resistance the voltage under load is predicted and the "
        "energy down to the cut-off is what counts.  Values are those of the whole battery, but where "
        "the key says cell."
    ),
    keys=(
        Key(
            name="capacity_ah",
            kind=Kind.NUMBER,
            unit="Ah",
            meaning="charge of the full battery",
            required=False,
            above=0.0,
        ),
        Key(
            name="capacity_wh",
            kind=Kind.NUMBER,
            unit="Wh",
            meaning="energy of the full battery",
            required=False,
            above=0.0,
        ),
        Key(
            name="nominal_voltage_v",
            kind=Kind.NUMBER,
            unit="V",
            meaning="energy over charge of the full battery",
            required=False,
            above=0.0,
        ),
        Key(
            name="cells_in_series",
            kind=Kind.INTEGER,
            meaning="number of cells in series",
            required=False,
            at_least=1,
            at_most=400,
        ),
        Key(
            name="cells_in_parallel",
            kind=Kind.INTEGER,
            meaning="number of such rows in parallel, 1 where not given",
            required=False,
            at_least=1,
            at_most=400,
        ),
        Key(
            name="chemistry",
            kind=Kind.TEXT,
            meaning=(
                "kind of cell, a file of models/chemistries: gives the curves this table does not; "
                "needs cells_in_series"
            ),
            required=False,
        ),
        Key(
            name="cell_capacity_ah",
            kind=Kind.NUMBER,
            unit="Ah",
            meaning="charge of one full cell, instead of capacity_ah",
            required=False,
            above=0.0,
        ),
        Key(
            name="cell_resistance_ohm",
            kind=Kind.NUMBER,
            unit="ohm",
            meaning="resistance of one cell, instead of internal_resistance_ohm",
            required=False,
            at_least=0.0,
        ),
        Key(
            name="internal_resistance_ohm",
            kind=Kind.NUMBER,
            unit="ohm",
            meaning="resistance of the whole battery",
            required=False,
            at_least=0.0,
        ),
        *_RESISTANCE_CURVE,
        Key(
            name="resistance_age_factor",
            kind=Kind.NUMBER,
            meaning="resistance of this battery over that of the new one, 1 where not given",
            required=False,
            at_least=1.0,
            at_most=20.0,
        ),
        Key(
            name="health",
            kind=Kind.NUMBER,
            meaning="charge of this battery over that of the new one, 1 where not given",
            required=False,
            above=0.0,
            at_most=1.0,
        ),
        Key(
            name="ocv_soc",
            kind=Kind.NUMBERS,
            meaning="states of charge, rising from 0 to 1",
            required=False,
            at_least=0.0,
            at_most=1.0,
            least_count=2,
            is_rising=True,
        ),
        Key(
            name="ocv_v",
            kind=Kind.NUMBERS,
            unit="V",
            meaning="open-circuit voltage at each ocv_soc, rising",
            required=False,
            above=0.0,
            least_count=2,
            is_rising=True,
        ),
        Key(
            name="cutoff_voltage_v",
            kind=Kind.NUMBER,
            unit="V",
            meaning="voltage under load at which the battery counts as empty",
            required=False,
            above=0.0,
        ),
        Key(
            name="max_c_rate",
            kind=Kind.NUMBER,
            unit="1/h",
            meaning="highest current over the charge of the new battery",
            required=False,
            above=0.0,
        ),
    ),
    cross_check=battery_problems,
)

CHEMISTRY = Table(
    name="",
    meaning="A kind of cell, in a file of its own under models/chemistries.",
    required=True,
    keys=(
        Key(name="name", kind=Kind.TEXT, meaning="must equal the file name without .toml"),
        Key(name="description", kind=Kind.TEXT, meaning="what the cell is"),
        Key(name="source", kind=Kind.TEXT, meaning="where the numbers were read"),
        Key(
            name="ocv_soc",
            kind=Kind.NUMBERS,
            meaning="states of charge, rising from 0 to 1",
            at_least=0.0,
            at_most=1.0,
            least_count=2,
            is_rising=True,
        ),
        Key(
            name="cell_ocv_v",
            kind=Kind.NUMBERS,
            unit="V",
            meaning="open-circuit voltage of a cell at each ocv_soc, rising",
            above=0.0,
            least_count=2,
            is_rising=True,
        ),
        *_RESISTANCE_CURVE,
    ),
    cross_check=chemistry_problems,
)
"""What a chemistry file holds, besides ``schema``."""
