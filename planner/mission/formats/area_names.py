"""What areas of a drawing are called, and which side of them that means."""

from __future__ import annotations

import re
import unicodedata
from enum import StrEnum
from functools import cache
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping


class AreaSide(StrEnum):
    """What an area of a drawing is there for."""

    INSIDE = "to stay inside"
    OUTSIDE = "to stay out of"
    WORK = "of the work"
    """Where something is done; whether the flight may leave it is another question."""


_AREAS = "area|areas|zone|zones|volume|box|boundary|perimeter|polygon|fence"
PHRASES: Mapping[AreaSide, tuple[str, ...]] = {
    AreaSide.OUTSIDE: (
        "no fly|flight|flights|flying|go|entry|access|drone|drones|uav|uavs|uas",
        "keep|stay out|away|clear",
        "off limits",
        "exclusion|exclude|excluded|prohibited|forbidden|restricted|nfz",
        "avoid|danger|dangerous|hazard|hazards|hazardous|obstacle|obstacles",
    ),
    AreaSide.INSIDE: (
        "keep|stay|remain in|inside|within",
        "inclusion|include|included|containment",
        "geo fence",
        f"flight|flying|operation|operations|operational {_AREAS}|geography",
    ),
    AreaSide.WORK: (
        "aoi",
        "area of interest",
        f"survey|mission|work|working|search|mapping|project {_AREAS}",
        "field|site|farm|property boundary|perimeter",
    ),
}
"""Words one after the other, | between those that do; of an area that is called so, among other words."""
_ROMANCE_AREAS = (
    "zone|zones|aire|aires|secteur|perimetre|zona|zonas|area|areas|aree|espacio|espaco|spazio "
    "d|de|del|di|do|da"
)
_POLISH_AREAS = "strefa|obszar|teren|rejon|przestrzen|granica"
FOREIGN_PHRASES: Mapping[str, Mapping[AreaSide, tuple[str, ...]]] = {
    "French": {
        AreaSide.OUTSIDE: (
            f"{_ROMANCE_AREAS} vol|survol interdit|interdite|interdites",
            "interdit|interdite|interdits|interdites|interdiction|reglemente|reglementee",
            "dangereuse|dangereux|eviter",
        ),
        AreaSide.INSIDE: (
            f"{_ROMANCE_AREAS} vol|vols|evolution|operation|operations",
            "geocloture",
        ),
        AreaSide.WORK: (
            f"{_ROMANCE_AREAS} interet|etude|travail|travaux|mission|recherche|recherches|projet|releve",
        ),
    },
    "German": {
        AreaSide.OUTSIDE: (
            "flugverbot|flugverbotszone|flugverbotsgebiet|flugverbotsbereich|flugbeschrankungsgebiet",
            "sperrzone|sperrgebiet|sperrbereich|sperrflache|verbotszone|tabuzone|tabuflache",
            "verboten|verbotene|verbotener|verbotenes|verbotenen",
            "gefahr|gefahrenzone|gefahrenbereich|gefahrengebiet|hindernis|hindernisse",
        ),
        AreaSide.INSIDE: (
            "flugzone|fluggebiet|flugbereich|flugraum|fluggeografie|fluggeographie",
            "betriebsgebiet|betriebsbereich|einsatzgebiet|einsatzbereich|geozaun",
        ),
        AreaSide.WORK: (
            "arbeitsgebiet|arbeitsbereich|messgebiet|vermessungsgebiet|untersuchungsgebiet|suchgebiet",
            "projektgebiet|kartiergebiet|interessengebiet|feldgrenze|grundstucksgrenze",
        ),
    },
    "Italian": {
        AreaSide.OUTSIDE: (
            f"{_ROMANCE_AREAS} volo vietato|vietata|interdetto|interdetta",
            "divieto|vietato|vietata|vietati|vietate|interdetto|interdetta|interdetti|interdette",
            "esclusione|ristretta|regolamentata|pericolo|pericoli|pericoloso|pericolosa|ostacolo|ostacoli|evitare",
        ),
        AreaSide.INSIDE: (f"{_ROMANCE_AREAS} volo|operazione|operazioni",),
        AreaSide.WORK: (
            f"{_ROMANCE_AREAS} interesse|studio|lavoro|lavori|ricerca|rilievo|progetto",
        ),
    },
    "Polish": {
        AreaSide.OUTSIDE: (
            "zakaz|zakazu lotu|lotow|wlotu|wstepu",
            "ograniczony|ograniczona|ograniczen|zakaz|zakazu|zakazany|zakazana|zabroniony|zabroniona|wykluczenie|wykluczenia",
            "niebezpieczny|niebezpieczna|zagrozenie|zagrozenia|przeszkoda|przeszkody",
        ),
        AreaSide.INSIDE: (f"{_POLISH_AREAS} lotu|lotow|operacji|operacyjna|operacyjny",),
        AreaSide.WORK: (
            f"{_POLISH_AREAS} prac|pracy|badan|pomiaru|pomiarow|poszukiwan|nalotu|projektu|zainteresowania",
        ),
    },
    "Portuguese": {
        AreaSide.OUTSIDE: (
            "nao voar|sobrevoar|voo|entrar",
            f"{_ROMANCE_AREAS} voo proibido|proibida|interdito|interdita",
            "proibido|proibida|proibidos|proibidas|proibicao|interdito|interdita|interdicao",
            "exclusao|perigo|perigos|perigoso|perigosa|restrito|restrita|evitar",
        ),
        AreaSide.INSIDE: (f"{_ROMANCE_AREAS} voo|voos|operacao|operacoes", "geocerca"),
        AreaSide.WORK: (
            f"{_ROMANCE_AREAS} interesse|estudo|trabalho|busca|projeto|levantamento|mapeamento",
        ),
    },
    "Spanish": {
        AreaSide.OUTSIDE: (
            "no volar|vuelo|vuelos|sobrevolar|entrar|pasar",
            f"{_ROMANCE_AREAS} vuelo prohibido|prohibida|restringido|restringida",
            "prohibido|prohibida|prohibidos|prohibidas|prohibicion|restringido|restringida",
            "peligro|peligros|peligroso|peligrosa|obstaculo|obstaculos|evitar",
        ),
        AreaSide.INSIDE: (
            f"{_ROMANCE_AREAS} vuelo|vuelos|operacion|operaciones",
            "geocerca|geovalla",
        ),
        AreaSide.WORK: (
            f"{_ROMANCE_AREAS} interes|estudio|trabajo|trabajos|busqueda|mision|proyecto|levantamiento",
        ),
    },
}
"""The same in other languages, without accents."""
FENCES = ("fence", "boundary", "perimeter")
"""What is to be stayed inside where it is the whole name."""
_FOREIGN_FENCES = (
    *("cloture", "limite", "perimetre"),
    *("zaun", "grenze", "begrenzung", "umgrenzung"),
    *("recinto", "recinzione", "confine", "perimetro"),
    *("ogrodzenie", "granica"),
    *("cerca", "valla"),
)
CONTRARY = "not|never|non|outside|beyond|without|free|except|unless"
"""What makes the contrary of what stands beside it: nothing is settled."""
_FOREIGN_CONTRARY = (
    "hors|sans|pas|jamais|sauf|dehors|nicht|nie|kein|keine|keinen|ohne|frei|freie|freies|ausser|ausserhalb|"
    "fuori|senza|tranne|eccetto|poza|bez|oprocz|fora|sem|nao|nunca|exceto|exceptuado|fuera|sin|excepto|salvo"
)
CLOSED = "closed|banned|denied|suspended|tfr"
OTHERS = (
    "manned|glider|paraglider|helicopter|military|model flying|model aircraft|airplane|aeroplane|crane|"
    "blasting|people|crowd"
)
"""What leaves open whether a flight may be where flights are: it is closed, or others fly there."""
_FOREIGN_CLOSED = (
    *("fermee", "fermees", "suspendue", "gesperrt", "gesperrte", "gesperrtes", "tabu"),
    *("chiusa", "chiuso", "chiuse", "sospesa", "zamkniety", "zamknieta", "wylaczony", "wylaczona"),
    *("fechada", "fechado", "interditada", "interditado", "cerrada", "cerrado", "suspendida"),
)
_FOREIGN_OTHERS = (
    *("planeur", "parapente", "militaire", "helicoptere", "grue"),
    *("segelflug", "segelflieger", "gleitschirm", "hubschrauber", "militar", "modellflug", "kran"),
    *("aliant", "parapendio", "elicotter"),
    *("szybow", "paralotni", "smiglow", "wojsk", "dzwig"),
    *(
        "planador",
        "planeador",
        "helicopter",
        "helikopter",
        "grua",
        "glid",
        "paraglid",
        "skydiv",
        "parachut",
    ),
)
"""As words begin."""


_UNDIVIDED = str.maketrans({"ł": "l", "ø": "o", "đ": "d"})
"""Letters whose stroke is no accent to Unicode."""


def side_of(words: str) -> AreaSide | None:
    """Return what an area is there for by what it is called, a name a line; ``None``: nothing settles it."""
    plain = plain_name(words)
    # A flight zone is none where there is no flight.
    rest, outs = _pattern(AreaSide.OUTSIDE).subn(";", plain)
    if _contrary().search(rest):
        return None
    is_fence = any(line in {*FENCES, *_FOREIGN_FENCES} for line in rest.splitlines())
    is_inside = is_fence or _pattern(AreaSide.INSIDE).search(rest) is not None
    is_work = _pattern(AreaSide.WORK).search(rest) is not None
    if outs:
        return None if is_inside or is_work else AreaSide.OUTSIDE
    if _closed().search(rest):
        return None
    if is_inside:
        return AreaSide.INSIDE
    return AreaSide.WORK if is_work else None


def plain_name(words: str) -> str:
    """Return names in small letters, a line each, without accents, numbers and signs.

    They are alike for parts of one area.
    """
    letters = unicodedata.normalize("NFKD", words.casefold().translate(_UNDIVIDED))
    letters = "".join(one for one in letters if not unicodedata.combining(one))
    letters = re.sub(r"\bno\W*(?=\d)", " ", letters)  # of No. 2
    lines = re.sub(r"[^\w\n]|[_\d]", " ", letters).splitlines()
    return "\n".join(" ".join(line.split()) for line in lines)


def phrases_text(side: AreaSide) -> str:
    """Return what areas for one thing are called, as a reader of a rule sees it."""
    return "; ".join(phrase.replace("|", "/") for phrase in PHRASES[side])


@cache
def _pattern(side: AreaSide) -> re.Pattern[str]:
    languages = (PHRASES, *FOREIGN_PHRASES.values())
    return re.compile("|".join(_phrase(one.split()) for each in languages for one in each[side]))


@cache
def _contrary() -> re.Pattern[str]:
    # "no" alone counts things: only before what is to be stayed out of it makes the contrary of that.
    return re.compile(rf"{_phrase([f'{CONTRARY}|{_FOREIGN_CONTRARY}'])}|\bno ?;")


@cache
def _closed() -> re.Pattern[str]:
    begun = rf"\b(?:{'|'.join((*OTHERS.split('|'), *_FOREIGN_OTHERS))})\w*"
    closed = _phrase(["|".join((CLOSED, *_FOREIGN_CLOSED))])
    return re.compile(rf"{closed}|{begun}|\bno$", re.MULTILINE)


def _phrase(words: Iterable[str]) -> str:
    return rf"\b{' ?'.join(f'(?:{word})' for word in words)}\b"
