"""Which side of an area its name means, in whatever language."""

from __future__ import annotations

import unicodedata

import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner.mission.formats.area_names import (
    CONTRARY,
    FOREIGN_PHRASES,
    AreaSide,
    plain_name,
    side_of,
)

INSIDE, OUTSIDE, WORK = AreaSide.INSIDE, AreaSide.OUTSIDE, AreaSide.WORK


@pytest.mark.parametrize(
    ("name", "side"),
    [
        ("Fluggebiet Nord", INSIDE),
        ("Flugverbotszone Kita", OUTSIDE),
        ("Sperrfläche 2", OUTSIDE),
        ("Suchgebiet", WORK),
        ("Zaun", INSIDE),
        ("kein Fluggebiet", None),
        ("außerhalb des Fluggebiets", None),
        ("hindernisfrei", None),
        ("Fluggebiet ohne Sperrzone", None),
        ("Zone de vol", INSIDE),
        ("zone interdite", OUTSIDE),
        ("Zone de vol interdite", OUTSIDE),
        ("Zone d'étude", WORK),
        ("hors zone de vol", None),
        ("ne pas survoler", None),
        ("Zona de vuelo", INSIDE),
        ("Zona de no vuelo", OUTSIDE),
        ("Zona de exclusión aérea", OUTSIDE),
        ("no prohibida", None),
        ("fuera de la zona de vuelo", None),
        ("Área de interés", WORK),
        ("Zona di volo", INSIDE),
        ("Divieto di sorvolo", OUTSIDE),
        ("area di volo vietata", OUTSIDE),
        ("Zona de voo", INSIDE),
        ("não voar", OUTSIDE),
        ("Área de voo proibido", OUTSIDE),
        ("Obszar lotów", INSIDE),
        ("Strefa zakazu lotów", OUTSIDE),
        ("poza obszarem lotów", None),
        # a number is counted, not denied
        ("Flight area No 2", INSIDE),
        ("No. 2 flight area", INSIDE),
        ("no-fly zone No 2", OUTSIDE),
        # the contrary of what is to be stayed out of
        ("no danger area", None),
        ("never a no-fly zone", None),
        # closed, or others': may a flight be where flights are?
        ("Closed flight area", None),
        ("flight area: NO", None),
        ("flight area TFR", None),
        ("Hazardous operations area", None),
        ("hazardous area", OUTSIDE),
        ("Flight area airplanes", None),
        ("survey area with people", None),
        ("operations area unmanned aircraft", INSIDE),
        ("survey area quarry", WORK),
        ("Operation area denied", None),
        ("Verbotenes Fluggebiet", None),
        ("Flugraum gesperrt", None),
        ("Fluggebiet tabu", None),
        ("zona de vuelo cerrada", None),
        ("zone de vol fermée", None),
        ("zona de voo fechada", None),
        ("area di volo chiusa", None),
        ("strefa lotów wyłączona", None),
        ("obszar lotów zamknięty", None),
        ("Glider flight area", None),
        ("paragliding flight zone", None),
        ("manned flight area", None),
        ("Military operations area", None),
        ("Einsatzgebiet Militär", None),
        ("Flugbereich Segelflug", None),
        ("Einsatzbereich Hubschrauber", None),
        ("teren lotów wojskowych", None),
        ("crane operation area", None),
        ("mission area (manned aircraft)", None),
        # to be stayed out of whoever flies there
        ("Military no-fly zone", OUTSIDE),
        ("Exclusion zone, helicopters", OUTSIDE),
        ("unmanned flight area", INSIDE),
        ("zone de vol Ferme Dupont", INSIDE),
        ("Flight area Norton", INSIDE),
        ("Flight area group 2", INSIDE),
        ("model flying area", None),
        ("3D model flight area", INSIDE),
    ],
)
def test_names_mean_a_side_in_their_own_language(name: str, side: AreaSide | None) -> None:
    assert side_of(name) is side
    assert side_of(name.upper()) is side
    assert side_of(unicodedata.normalize("NFD", name)) is side


PHRASES = [
    (side, phrase)
    for sides in FOREIGN_PHRASES.values()
    for side, phrases in sides.items()
    for phrase in phrases
]


@given(phrase=st.sampled_from(PHRASES), data=st.data())
def test_every_foreign_phrase_means_its_side_unless_its_contrary_stands_beside_it(
    phrase: tuple[AreaSide, str], data: st.DataObject
) -> None:
    side, words = phrase
    name = " ".join(data.draw(st.sampled_from(word.split("|"))) for word in words.split())
    assert plain_name(name) == name  # as names are compared
    assert side_of(f"{name} 3") is side
    assert side_of(f"{data.draw(st.sampled_from(CONTRARY.split('|')))} {name}") is None
