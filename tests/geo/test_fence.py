from __future__ import annotations

import math
import subprocess
import sys
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pyproj import Geod
from thinning import examples

from planner.findings import Place, Severity
from planner.geo.barrier import path_legs
from planner.geo.fence import Fence, FenceArea, FenceCircle, FencePolygon, make_fence_area
from planner.geo.geodesy import LocalFrame

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy.typing as npt

    from planner.arrays import FloatArray

GEOD = Geod(ellps="WGS84")
HERE = LocalFrame(latitude_deg=47.0, longitude_deg=8.0)
# An edge of 1 km bows by 2 cm at this latitude; drawn edges are within 1 cm of that.
BOW_M = 0.03


def degrees(points_m: Sequence[tuple[float, float]]) -> tuple[tuple[float, float], ...]:
    """Latitudes and longitudes of (east, north) about HERE."""
    latitude, longitude = HERE.latitude_longitude_deg(*np.array(points_m, np.float64).T)
    return tuple(zip(latitude.tolist(), longitude.tolist(), strict=True))


def polygon(*points_m: tuple[float, float], inclusion: bool = True) -> FencePolygon:
    return FencePolygon(inclusion=inclusion, vertices_deg=degrees(points_m))


def rectangle(
    west: float, south: float, east: float, north: float, *, inclusion: bool = True
) -> FencePolygon:
    return polygon((west, south), (east, south), (east, north), (west, north), inclusion=inclusion)


def circle(east: float, north: float, radius: float, *, inclusion: bool = True) -> FenceCircle:
    ((latitude, longitude),) = degrees([(east, north)])
    return FenceCircle(
        inclusion=inclusion, latitude_deg=latitude, longitude_deg=longitude, radius_m=radius
    )


def area_of(*areas: FencePolygon | FenceCircle, inclusions_unite: bool = False) -> FenceArea:
    fence = Fence(
        polygons=tuple(a for a in areas if isinstance(a, FencePolygon)),
        circles=tuple(a for a in areas if isinstance(a, FenceCircle)),
    )
    return make_fence_area(fence, HERE, inclusions_unite=inclusions_unite)


def clearance_m(area: FenceArea, east: npt.ArrayLike, north: npt.ArrayLike) -> FloatArray:
    """The least signed distance along each leg of a path."""
    legs = path_legs(east, north)
    of_barriers = [barrier.leg_clearance(legs).clearance_m for barrier in area.barriers]
    nowhere = np.full(len(legs.length_m), math.inf)
    return np.asarray(np.min([nowhere, *of_barriers], axis=0))


def stretches_m(area: FenceArea, east: Sequence[float], north: Sequence[float]) -> list[float]:
    return [m for s in area.spans_outside(east, north) for m in (s.start_m, s.end_m)]


def test_a_mission_without_a_fence_does_not_wait_for_shapely_or_rasterio() -> None:
    code = (
        "import sys, planner.geo.terrain, planner.geo.fence as f, planner.geo.fence as v;"
        "from planner.geo.geodesy import LocalFrame;"
        "f.make_fence_area(v.Fence(), LocalFrame(latitude_deg=0.0, longitude_deg=0.0));"
        "print(*{'shapely', 'rasterio', 'pyproj', 'scipy'} & set(sys.modules))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == []


def test_without_a_fence_everything_is_allowed() -> None:
    area = area_of()
    assert area.signed_distance_m([0.0, 1e6], [0.0, 0.0]).tolist() == [math.inf, math.inf]
    assert area.is_inside([0.0], [0.0]).all()
    assert clearance_m(area, [0.0, 1.0], [0.0, 0.0]).tolist() == [math.inf]
    assert area.spans_outside([0.0, 1.0], [0.0, 0.0]) == ()
    assert area.findings == ()


def test_signed_distance_is_positive_inside_and_negative_outside() -> None:
    area = area_of(rectangle(-100.0, -50.0, 100.0, 50.0))
    found = area.signed_distance_m([0.0, 90.0, 130.0, 103.0], [0.0, 0.0, 0.0, 54.0])
    assert found == pytest.approx([50.0, 10.0, -30.0, -5.0], abs=BOW_M)
    assert area.is_inside([0.0, 130.0], [0.0, 0.0]).tolist() == [True, False]


def test_an_exclusion_area_turns_the_sign() -> None:
    area = area_of(rectangle(-100.0, -50.0, 100.0, 50.0, inclusion=False))
    found = area.signed_distance_m([0.0, 130.0], [0.0, 0.0])
    assert found == pytest.approx([-50.0, 30.0], abs=BOW_M)


def test_a_circle_is_measured_from_its_centre() -> None:
    inside = area_of(circle(300.0, 400.0, 600.0))
    outside = area_of(circle(300.0, 400.0, 450.0, inclusion=False))
    # 3-4-5: the origin is 500 m from the centre.
    assert inside.signed_distance_m([0.0], [0.0])[0] == pytest.approx(100.0, abs=1e-3)
    assert outside.signed_distance_m([0.0], [0.0])[0] == pytest.approx(50.0, abs=1e-3)


@pytest.mark.parametrize("inclusion", [True, False])
def test_the_direction_of_turning_does_not_matter(*, inclusion: bool) -> None:
    corners = [(0.0, 0.0), (100.0, 0.0), (100.0, 100.0), (0.0, 100.0)]
    one, other = (
        polygon(*corners, inclusion=inclusion),
        polygon(*corners[::-1], inclusion=inclusion),
    )
    points = [10.0, 150.0, 50.0], [20.0, 50.0, 90.0]
    assert np.allclose(
        area_of(one).signed_distance_m(*points), area_of(other).signed_distance_m(*points)
    )


def test_the_chord_of_a_long_parallel_enters_the_exclusion_at_its_middle() -> None:
    # PX4 #28759: a 20 km E–W leg at 47°, flown straight, passes 8.4 m north of the parallel.
    latitude, longitude = HERE.latitude_longitude_deg([-1e4, 1e4], [0.0, 0.0])
    east, north = HERE.east_north_m(47.0, longitude)
    at_chord = rectangle(-5.0, 3.4, 5.0, 13.4, inclusion=False)
    at_parallel = rectangle(-5.0, -5.0, 5.0, 5.0, inclusion=False)
    assert latitude == pytest.approx([46.99992] * 2, abs=1e-5)
    assert clearance_m(area_of(at_chord), east, north)[0] == pytest.approx(-5.0, abs=0.05)
    assert clearance_m(area_of(at_parallel), east, north)[0] == pytest.approx(3.4, abs=0.05)


def test_a_long_edge_of_a_fence_follows_its_parallel() -> None:
    vertices = ((47.0, 7.87), (47.0, 8.13), (47.1, 8.13), (47.1, 7.87))
    area = make_fence_area(
        Fence(polygons=(FencePolygon(inclusion=True, vertices_deg=vertices),)), HERE
    )
    longitude = np.linspace(7.88, 8.12, 1001)
    on_the_edge = area.signed_distance_m(*HERE.east_north_m(47.0, longitude))
    assert np.max(np.abs(on_the_edge)) <= 0.01


def test_a_sliver_between_samples_is_found_with_its_place() -> None:
    area = area_of(rectangle(7000.0, -500.0, 7001.0, 500.0, inclusion=False))
    east, north = [0.0, 20_000.0], [100.0, 100.0]
    least = area.barriers[0].leg_clearance(path_legs(east, north))
    assert least.clearance_m == pytest.approx([-0.5], abs=0.02)
    assert least.along_m == pytest.approx([7000.5], abs=0.5)
    assert area.barriers[0].label == "exclusion polygon 1"
    # The sides are meridians, which converge by 1e-4 rad here.
    assert stretches_m(area, east, north) == pytest.approx([7000.0, 7001.0], abs=0.02)


def test_a_leg_in_a_circle_is_cut_at_the_roots() -> None:
    # 3-4-5 again: 30 m beside the centre of a circle of 50 m.
    keep_out, keep_in = circle(0.0, 0.0, 50.0, inclusion=False), circle(0.0, 0.0, 50.0)
    east, north = [-100.0, 100.0], [30.0, 30.0]
    assert stretches_m(area_of(keep_out), east, north) == pytest.approx([60.0, 140.0])
    assert stretches_m(area_of(keep_in), east, north) == pytest.approx([0.0, 60.0, 140.0, 200.0])
    least = area_of(keep_out).barriers[0].leg_clearance(path_legs(east, north))
    assert (least.clearance_m[0], least.along_m[0]) == pytest.approx((-20.0, 100.0))
    assert clearance_m(area_of(keep_in), east, north) == pytest.approx(
        [50.0 - math.hypot(100.0, 30.0)]
    )
    assert clearance_m(area_of(keep_out), [60.0, 100.0], [0.0, 0.0]) == pytest.approx([10.0])


@pytest.mark.parametrize("as_circle", [True, False])
def test_the_rim_of_a_loiter_is_found_in_an_exclusion_its_centre_is_out_of(
    *, as_circle: bool
) -> None:
    # PX4 #28527: R = 200 m around a centre outside.
    exclusion = (
        circle(250.0, 0.0, 78.9, inclusion=False)
        if as_circle
        else rectangle(171.1, -300.0, 400.0, 300.0, inclusion=False)
    )
    angle = np.linspace(0.0, 4.0 * math.pi, 721)
    east, north = 200.0 * np.cos(angle), 200.0 * np.sin(angle)
    area = area_of(exclusion)
    assert area.is_inside([0.0], [0.0])[0]
    assert clearance_m(area, east, north).min() == pytest.approx(-28.9, abs=BOW_M)
    # Two turns from the easternmost point: half a span, a whole one, half a span.
    spans = area.spans_outside(east, north)
    assert len(spans) == 3
    whole = spans[1].end_m - spans[1].start_m
    ends = spans[0].end_m - spans[0].start_m, spans[2].end_m - spans[2].start_m
    assert sum(ends) == pytest.approx(whole, rel=1e-3)


def test_a_stretch_goes_on_around_a_corner() -> None:
    area = area_of(rectangle(0.0, 0.0, 100.0, 100.0))
    (span,) = area.spans_outside([50.0, 150.0, 150.0, 50.0], [10.0, 10.0, 60.0, 60.0])
    assert (span.start_m, span.end_m) == pytest.approx((50.0, 200.0), abs=BOW_M)
    assert span.leg == 0


@pytest.mark.parametrize("outside", [rectangle(0.0, 0.0, 100.0, 100.0), circle(50.0, 50.0, 60.0)])
def test_standing_still_outside_is_a_stretch_without_length(
    outside: FencePolygon | FenceCircle,
) -> None:
    area = area_of(outside)
    (span,) = area.spans_outside([200.0, 200.0], [50.0, 50.0])
    assert (span.start_m, span.end_m) == (0.0, 0.0)
    assert clearance_m(area, [200.0, 200.0], [50.0, 50.0])[0] < 0.0
    assert area.spans_outside([50.0, 50.0], [50.0, 50.0]) == ()
    assert clearance_m(area, [200.0, 200.0 + 1e-180], [50.0, 50.0])[0] < 0.0
    assert clearance_m(area, [50.0, 50.0], [50.0, 50.0])[0] > 0.0


@pytest.mark.parametrize(
    ("east", "north"), [([0.0], [0.0]), ([0.0, math.nan], [0.0, 0.0]), ([], [])]
)
def test_what_is_no_path_is_refused(east: list[float], north: list[float]) -> None:
    with pytest.raises(ValueError, match="two finite points"):
        path_legs(east, north)


def test_several_inclusions_intersect_unless_told_to_unite() -> None:
    west, east = rectangle(-300.0, -100.0, 50.0, 100.0), rectangle(-50.0, -100.0, 300.0, 100.0)
    points = [0.0, 200.0], [0.0, 0.0]
    both = area_of(west, east)
    assert both.findings == ()
    assert both.signed_distance_m(*points) == pytest.approx([50.0, -150.0], abs=BOW_M)
    either = area_of(west, east, inclusions_unite=True)
    assert either.findings == ()
    assert either.signed_distance_m(*points) == pytest.approx([100.0, 100.0], abs=BOW_M)


def test_a_seam_between_united_areas_is_no_boundary() -> None:
    # The shared edge has one more vertex on one side, rounded as a file rounds it.
    west = FencePolygon(
        inclusion=True,
        vertices_deg=(
            (47.0, 8.0),
            (47.0, 8.01),
            (47.0049999, 8.0100001),
            (47.01, 8.01),
            (47.01, 8.0),
        ),
    )
    east = FencePolygon(
        inclusion=True, vertices_deg=((47.0, 8.01), (47.0, 8.02), (47.01, 8.02), (47.01, 8.01))
    )
    area = make_fence_area(Fence(polygons=(west, east)), HERE, inclusions_unite=True)
    across = HERE.east_north_m([47.005, 47.005], [8.002, 8.018])
    # 0.002° of longitude at 47.005°: 0.002 · 76 049 m/° (cos φ · N · π/180).
    assert clearance_m(area, *across)[0] == pytest.approx(152.1, abs=0.1)
    assert area.spans_outside(*across) == ()


def test_united_circles_and_a_corridor_can_be_flown_through() -> None:
    area = area_of(
        circle(0.0, 0.0, 100.0),
        circle(1000.0, 0.0, 100.0),
        rectangle(0.0, -20.0, 1000.0, 20.0),
        inclusions_unite=True,
    )
    assert clearance_m(area, [0.0, 1000.0], [0.0, 0.0])[0] == pytest.approx(20.0, abs=BOW_M)
    assert area.signed_distance_m([-30.0], [0.0])[0] == pytest.approx(70.0, abs=BOW_M)
    assert area.barriers[0].label == "union of 3 inclusion areas"


def test_exclusions_hold_inside_united_inclusions() -> None:
    area = area_of(
        rectangle(0.0, 0.0, 100.0, 100.0),
        rectangle(100.0, 0.0, 200.0, 100.0),
        circle(150.0, 50.0, 10.0, inclusion=False),
        inclusions_unite=True,
    )
    assert area.signed_distance_m([150.0, 130.0], [50.0, 50.0]) == pytest.approx(
        [-10.0, 10.0], abs=BOW_M
    )


@pytest.mark.parametrize(
    ("areas", "message"),
    [
        (
            (rectangle(0.0, 0.0, 9.0, 9.0), rectangle(20.0, 0.0, 29.0, 9.0)),
            "inclusion polygon 1 and inclusion polygon 2 have no place in common",
        ),
        (
            (rectangle(0.0, 0.0, 90.0, 90.0), rectangle(90.0, 0.0, 180.0, 90.0)),
            "inclusion polygon 1 and inclusion polygon 2 have no place in common",
        ),
        (
            (rectangle(0.0, 0.0, 9.0, 9.0), circle(50.0, 0.0, 40.9)),
            "inclusion polygon 1 and inclusion circle 1 have no place in common",
        ),
        (
            (circle(0.0, 0.0, 58.0), circle(100.0, 0.0, 51.0), circle(50.0, 86.6, 51.0)),
            "the 3 inclusion areas have no place common to all",
        ),
    ],
)
def test_inclusions_apart_are_an_error_unless_they_unite(
    areas: tuple[FencePolygon | FenceCircle, ...], message: str
) -> None:
    area = area_of(*areas)
    (finding,) = area.findings
    assert (finding.code, finding.severity) == ("F106", Severity.ERROR)
    assert finding.message == message
    assert area.signed_distance_m([4.0, 50.0], [4.0, 30.0]).max() < 0.0
    assert area_of(*areas, inclusions_unite=True).findings == ()


def test_inclusions_that_overlap_are_no_finding() -> None:
    assert area_of(rectangle(0.0, 0.0, 9.0, 9.0), circle(50.0, 0.0, 42.0)).findings == ()


BOWTIE = degrees([(0.0, 0.0), (100.0, 100.0), (100.0, 0.0), (0.0, 100.0)])
SQUARE = degrees([(0.0, 0.0), (100.0, 0.0), (100.0, 100.0), (0.0, 100.0)])
SPIKE = degrees([(0.0, 0.0), (100.0, 0.0), (100.0, 200.0), (100.0, 100.0), (0.0, 100.0)])


@pytest.mark.parametrize(
    ("vertices", "problem"),
    [
        ((), "has fewer than 3 different vertices"),
        (((47.0, 8.0),) * 4, "has fewer than 3 different vertices"),
        ((*SQUARE[:2], SQUARE[0]), "has fewer than 3 different vertices"),
        (BOWTIE, "crosses itself: the edge after vertex 1 meets that after vertex 3"),
        (SPIKE, "folds back on itself"),
        (((47.0, 8.0), (47.0, 8.1), (47.0, 8.05)), "encloses no area"),
        (((47.0, 8.0), (47.1, 8.1), (47.05, 8.05)), "encloses no area"),
        ((*SQUARE[:2], (math.nan, 8.0)), "has a vertex 3 that is no position: nan, 8.0"),
        ((*SQUARE[:2], (47.0, math.inf)), "has a vertex 3 that is no position: 47.0, inf"),
        (((90.5, 8.0), *SQUARE[:2]), "has a vertex 1 that is no position: 90.5, 8.0"),
    ],
)
def test_a_polygon_that_encloses_nothing_is_an_error_and_no_barrier(
    vertices: tuple[tuple[float, float], ...], problem: str
) -> None:
    place = Place(3, 7)
    broken = FencePolygon(inclusion=False, vertices_deg=vertices, place=place)
    area = area_of(rectangle(0.0, 0.0, 9.0, 9.0), broken)
    (finding,) = area.findings
    assert (finding.code, finding.severity, finding.place) == ("F105", Severity.ERROR, place)
    assert finding.message == f"exclusion polygon 2 {problem}"
    assert [barrier.label for barrier in area.barriers] == ["inclusion polygon 1"]


@pytest.mark.parametrize("radius", [0.0, -5.0, math.nan, math.inf])
def test_a_circle_without_a_positive_radius_is_an_error(radius: float) -> None:
    area = area_of(circle(0.0, 0.0, radius))
    (finding,) = area.findings
    assert (finding.code, finding.severity) == ("F105", Severity.ERROR)
    assert finding.message == f"inclusion circle 1 has a radius of {radius} m"
    assert area.barriers == ()


def test_a_circle_nowhere_is_an_error() -> None:
    nowhere = FenceCircle(inclusion=True, latitude_deg=math.nan, longitude_deg=8.0, radius_m=100.0)
    (finding,) = area_of(nowhere).findings
    assert finding.message == "inclusion circle 1 has a centre that is no position: nan, 8.0"


@pytest.mark.parametrize(
    ("vertices", "message"),
    [
        ((*SQUARE, SQUARE[0]), "inclusion polygon 1 has 1 vertex given twice in a row"),
        (
            (SQUARE[0], *SQUARE, SQUARE[-1]),
            "inclusion polygon 1 has 2 vertices given twice in a row",
        ),
    ],
)
def test_vertices_given_twice_are_a_warning_and_change_nothing(
    vertices: tuple[tuple[float, float], ...], message: str
) -> None:
    area = area_of(FencePolygon(inclusion=True, vertices_deg=vertices))
    (finding,) = area.findings
    assert (finding.code, finding.severity) == ("F105", Severity.WARNING)
    assert finding.message == message
    assert area.signed_distance_m([50.0], [30.0])[0] == pytest.approx(30.0, abs=BOW_M)


def test_a_fence_around_the_pole_holds_the_pole() -> None:
    frame = LocalFrame(latitude_deg=89.95, longitude_deg=20.0)
    vertices = tuple((89.9, longitude) for longitude in (0.0, 90.0, 180.0, -90.0))
    area = make_fence_area(
        Fence(polygons=(FencePolygon(inclusion=True, vertices_deg=vertices),)), frame
    )
    assert area.findings == ()
    # Its edges are the parallel of 89.9°: 0.1° of a meridian, 111 694 m/° at the pole.
    pole = frame.east_north_m(90.0, 0.0)
    assert area.signed_distance_m([pole[0]], [pole[1]])[0] == pytest.approx(11_169.4, abs=0.1)


@given(
    st.one_of(st.floats(-89.5, 89.5), st.sampled_from([89.9, -89.95, 0.0])),
    st.sampled_from([179.99, -179.97, 8.0]),
    st.data(),
)
@settings(max_examples=examples(40), deadline=None)
def test_distances_to_polygons_agree_with_geodesics_to_their_edges(
    latitude: float, longitude: float, data: st.DataObject
) -> None:
    # A triangle about the origin with edges of up to 20 km, and a point up to 15 km away.
    frame = LocalFrame(latitude_deg=latitude, longitude_deg=longitude)
    turn = data.draw(st.floats(0.0, 2.0))
    radii = [data.draw(st.floats(2e3, 1.1e4)) for _ in range(3)]
    corners = [
        GEOD.fwd(longitude, latitude, math.degrees(turn) + 120.0 * i, radius)[:2]
        for i, radius in enumerate(radii)
    ]
    point_longitude, point_latitude, _ = GEOD.fwd(
        longitude, latitude, data.draw(st.floats(0.0, 360.0)), data.draw(st.floats(0.0, 1.5e4))
    )
    expected = min(
        edge_distance_m(corners[i], corners[(i + 1) % 3], point_longitude, point_latitude)
        for i in range(3)
    )
    fence = Fence(
        polygons=(
            FencePolygon(inclusion=True, vertices_deg=tuple((lat, lon) for lon, lat in corners)),
        )
    )
    east, north = frame.east_north_m([point_latitude], [point_longitude])
    found = make_fence_area(fence, frame).signed_distance_m(east, north)
    assert abs(found[0]) == pytest.approx(expected, abs=0.1)


def edge_distance_m(
    start: tuple[float, float], end: tuple[float, float], longitude: float, latitude: float
) -> float:
    """Least geodesic distance to an edge straight in degrees, by zooming in on samples."""
    turn = end[0] - start[0]
    turn -= 360.0 * round(turn / 360.0)
    low, high = 0.0, 1.0
    for _ in range(4):
        t = np.linspace(low, high, 101)
        _, _, distance = GEOD.inv(
            np.full(101, longitude),
            np.full(101, latitude),
            start[0] + t * turn,
            start[1] + t * (end[1] - start[1]),
        )
        nearest = int(np.argmin(distance))
        low, high = t[max(nearest - 1, 0)], t[min(nearest + 1, 100)]
    return float(np.min(distance))


@given(
    st.one_of(st.floats(-90.0, 90.0), st.sampled_from([89.9, -90.0])),
    st.sampled_from([179.99, -179.97, 8.0]),
    st.data(),
)
@settings(max_examples=examples(40), deadline=None)
def test_clearances_of_legs_to_circles_agree_with_geodesics(
    latitude: float, longitude: float, data: st.DataObject
) -> None:
    frame = LocalFrame(latitude_deg=latitude, longitude_deg=longitude)
    places = [
        GEOD.fwd(
            longitude, latitude, data.draw(st.floats(0.0, 360.0)), data.draw(st.floats(0.0, 1.4e4))
        )
        for _ in range(3)
    ]
    (start, end), centre = places[:2], places[2]
    fence = Fence(
        circles=(
            FenceCircle(
                inclusion=False, latitude_deg=centre[1], longitude_deg=centre[0], radius_m=500.0
            ),
        )
    )
    azimuth, _, length = GEOD.inv(start[0], start[1], end[0], end[1])
    low, high = 0.0, length
    for _ in range(4):  # the distance to the centre has one least value along the leg
        along = np.linspace(low, high, 101)
        on_leg = GEOD.fwd(
            np.full(101, start[0]), np.full(101, start[1]), np.full(101, azimuth), along
        )
        _, _, distance = GEOD.inv(
            on_leg[0], on_leg[1], np.full(101, centre[0]), np.full(101, centre[1])
        )
        nearest = int(np.argmin(distance))
        low, high = along[max(nearest - 1, 0)], along[min(nearest + 1, 100)]
    path = frame.east_north_m([start[1], end[1]], [start[0], end[0]])
    found = clearance_m(make_fence_area(fence, frame), *path)
    assert found[0] == pytest.approx(float(np.min(distance)) - 500.0, abs=0.1)


METRES = st.floats(-1000.0, 1000.0)


@st.composite
def star_polygons(draw: st.DrawFn) -> FencePolygon:
    """Polygons that are simple because they turn once about a centre."""
    east, north = draw(METRES), draw(METRES)
    radii = draw(st.lists(st.floats(20.0, 500.0), min_size=3, max_size=9))
    angles = [2.0 * math.pi * i / len(radii) for i in range(len(radii))]
    return polygon(
        *(
            (east + r * math.sin(angle), north + r * math.cos(angle))
            for r, angle in zip(radii, angles, strict=True)
        ),
        inclusion=draw(st.booleans()),
    )


CIRCLES = st.builds(
    lambda east, north, radius, inclusion: circle(east, north, radius, inclusion=inclusion),
    METRES,
    METRES,
    st.floats(10.0, 800.0),
    st.booleans(),
)


@given(
    st.lists(st.one_of(star_polygons(), CIRCLES), min_size=1, max_size=4),
    st.lists(st.tuples(METRES, METRES), min_size=2, max_size=5),
    st.booleans(),
)
@settings(max_examples=examples(100), deadline=None)
def test_no_sample_of_a_path_contradicts_its_clearance_and_stretches(
    areas: list[FencePolygon | FenceCircle],
    path: list[tuple[float, float]],
    unite: bool,  # noqa: FBT001 - drawn by hypothesis
) -> None:
    area = area_of(*areas, inclusions_unite=unite)
    corners = np.array(path)
    t = np.linspace(0.0, 1.0, 101)[:, None]
    clearance = clearance_m(area, *corners.T)
    for leg, (start, end) in enumerate(pairwise(corners)):
        samples = area.signed_distance_m(*(start + (end - start) * t).T)
        spacing = float(np.hypot(*(end - start))) / 100.0
        # Signed distances change by at most the way between samples; depths stop 1 cm short.
        assert samples.min() >= clearance[leg] - 0.011
        assert samples.min() <= clearance[leg] + spacing / 2.0 + 1e-6

    lengths = np.hypot(*np.diff(corners, axis=0).T)
    offsets = np.concatenate([[0.0], np.cumsum(lengths)])
    spans = area.spans_outside(*corners.T)
    for along in np.linspace(0.0, offsets[-1], 101):
        point = [[np.interp(along, offsets, axis)] for axis in corners.T]
        distance = area.signed_distance_m(*point)[0]
        if abs(distance) > 1e-5:  # nearer the ends of spans, rounding decides
            outside = any(s.start_m - 1e-6 <= along <= s.end_m + 1e-6 for s in spans)
            assert outside == (distance < 0.0)
