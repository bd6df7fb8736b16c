from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING, Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from thinning import examples

from planner.errors import MissionFileError
from planner.findings import Place
from planner.mission.formats.json_document import parse_json

if TYPE_CHECKING:
    from collections.abc import Iterator


def refusal(text: str) -> MissionFileError:
    with pytest.raises(MissionFileError) as caught:
        parse_json(text, source="a.plan")
    return caught.value


def objects(value: Any) -> Iterator[dict[str, Any]]:  # noqa: ANN401 (whatever JSON holds)
    if isinstance(value, dict):
        yield value
        for inner in value.values():
            yield from objects(inner)
    elif isinstance(value, list):
        for inner in value:
            yield from objects(inner)


def offset(text: str, place: Place) -> int:
    return sum(len(line) + 1 for line in text.split("\n")[: place.line - 1]) + place.column - 1


def test_an_object_knows_its_line_and_column() -> None:
    document = parse_json('{\n  "a": [\n    {"b": 1},\n    {}\n  ]\n}\n', source="a.plan")
    first, second = document.root["a"]
    assert document.place(document.root) == Place(1, 1)
    assert document.place(first) == Place(3, 5)
    assert document.places([second, first]) == (Place(4, 5), Place(3, 5))


@pytest.mark.parametrize("text", ['[1, {}, {"a": []}]', '[{}, "{", {"a": [0, [1, {}]]}]'])
def test_objects_among_values_and_braces_in_texts_are_placed(text: str) -> None:
    document = parse_json(text, source="a.plan")
    opening = [at for at, one in enumerate(text) if one == "{" and text[at - 1] != '"']
    assert [document.place(one).column - 1 for one in objects(document.root)] == opening


def test_a_value_inside_an_object_is_found_by_its_path() -> None:
    document = parse_json('{"a": {"b"  : [10,\n 20 , [30]]}, "c": 1}', source="a.plan")
    assert document.place(document.root, "a", "b", 1) == Place(2, 2)
    assert document.place(document.root, "c") == Place(2, 20)
    assert document.element_places(document.root, "a", "b")[2] == Place(2, 7)


def test_a_path_that_breaks_off_gives_the_last_value_there_is() -> None:
    document = parse_json('{"a": [1, 2]}', source="a.plan")
    assert document.place(document.root, "a", 7, "b") == Place(1, 7)


def test_braces_quotes_and_backslashes_inside_texts_do_not_mislead() -> None:
    text = r'{"}{\"": "]}[{\\", "é{": {"x": "\\\"}"}, "last": {}}'
    document = parse_json(text, source="a.plan")
    assert document.place(document.root["last"]).column == text.index("{}") + 1


JSON_VALUES = st.recursive(
    st.none() | st.booleans() | st.integers() | st.text('{}[]",\\é\n', max_size=5),
    lambda inner: (
        st.lists(inner, max_size=3) | st.dictionaries(st.text('ab{"\\', max_size=3), inner)
    ),
    max_leaves=12,
)


@settings(max_examples=examples(60), deadline=None)
@given(value=JSON_VALUES, indent=st.sampled_from([None, 0, 2]), ascii_only=st.booleans())
def test_every_object_stands_where_its_place_says(
    value: object,
    indent: int | None,
    ascii_only: bool,  # noqa: FBT001 (drawn)
) -> None:
    text = json.dumps(value, indent=indent, ensure_ascii=ascii_only)
    document = parse_json(text, source="a.plan")
    assert document.root == value
    decoder = json.JSONDecoder()
    for each in objects(document.root):
        assert decoder.raw_decode(text, offset(text, document.place(each)))[0] == each


@pytest.mark.parametrize(
    ("text", "place", "sentence"),
    [
        ("", Place(1, 1), "the file is empty"),
        ('{"a": 1,\n "b": [1, 2', Place(2, 12), "cut off"),
        ('{"a": "half', Place(1, 7), "not closed"),
        ('{"a": [1,\n]}', Place(2, 1), "comma before a closing bracket"),
        ('{"a": 1,}', Place(1, 9), "comma before a closing bracket"),
        ('{"a": 1} {}', Place(1, 10), "follows the end"),
        ('{"a": 1, // speed\n "b": 2}', Place(1, 10), "no comments"),
        ("{'a': 1}", Place(1, 2), "double quotes"),
        ('{"a" 1}', Place(1, 6), "colon"),
        ('{"a": 1 "b": 2}', Place(1, 9), "comma or a closing bracket"),
        ('{"a": yes}', Place(1, 7), "expected a value, found 'yes}'"),
        ('{"a": "b\nc"}', Place(1, 9), "line break"),
        ('{"a": "\\q"}', Place(1, 8), "backslash"),
        ('{"a": 1,\n "a": 2}', Place(2, 7), "'a' appears twice"),
        ('{"b": {"x": 1, "y": 2, "x": 3}}', Place(1, 29), "'x' appears twice"),
        ('{"b": [1, {"x": 1, "x": 3}], "y": ":"}', Place(1, 25), "'x' appears twice"),
        ('{"y": "\\u003a", "x": 1, "x": 3}', Place(1, 30), "'x' appears twice"),
        ('{"NaN": "NaN", "a": [1, NaN]}', Place(1, 25), "NaN is not a finite number"),
        ('{"a": -Infinity}', Place(1, 7), "-Infinity is not a finite number"),
        ('{"e": 1e-5,\n"a": 1e999}', Place(2, 6), "1e999 is not a finite number"),
        ('{"a": -' + "9" * 400 + ".5}", Place(1, 7), "is not a finite number"),
        ('{"a": ' + "9" * 5000 + "}", Place(1, 7), "4000 digits"),
        ("[" * 100_000, Place(1, 65), "nest deeper than 64"),
        ('{"a":' * 70 + "1" + "}" * 70, Place(1, 64 * 5 + 1), "nest deeper than 64"),
    ],
)
def test_broken_json_is_refused_with_its_place(text: str, place: Place, sentence: str) -> None:
    error = refusal(text)
    assert error.place == place
    assert sentence in error.message
    assert str(error).startswith(f"a.plan:{place.line}:{place.column}: ")


def test_nesting_hidden_behind_brackets_in_texts_is_refused_too() -> None:
    # The texts look like closing brackets to nobody: depth counts outside of them.
    assert "nest" in refusal('["]",' * 50_000).message


def test_large_numbers_that_a_double_holds_are_read() -> None:
    document = parse_json('{"a": 1.5e+300, "b": 1E5, "c": 2e-400}', source="a.plan")
    assert document.root == {"a": 1.5e300, "b": 1e5, "c": 0.0}
    assert math.isfinite(document.root["a"])


def test_a_byte_order_mark_is_told_and_counts_for_no_column() -> None:
    document = parse_json('\ufeff{"a": {}}', source="a.plan")
    assert document.place(document.root["a"]) == Place(1, 7)
    assert [finding.code for finding in document.findings] == ["L162"]


@settings(max_examples=examples(150), deadline=None)
@given(text=st.text('{}[]",:\\ \n019.eE-+NaInfity\ufeffé', max_size=40))
def test_any_text_is_parsed_as_the_standard_library_does_or_refused(text: str) -> None:
    try:
        root = parse_json(text, source="a.plan").root
    except MissionFileError:
        return
    assert root == json.loads(text.removeprefix("\ufeff"))
