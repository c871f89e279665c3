"""Cells in polygons with holes, against the Voronoi diagram of GEOS."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest
from any_domains import any_domain
from any_points import any_set
from hypothesis import given
from hypothesis import strategies as st

import voroquad as vq

shapely = pytest.importorskip("shapely")

# A square with a bay and a hole
BAY = shapely.box(0, 0, 1, 1).difference(shapely.box(0.4, 0.5, 0.6, 1)).difference(shapely.box(0.2, 0.2, 0.4, 0.3))


def random_region(rng: np.random.Generator):
    blobs = [shapely.Point(*rng.uniform(0, 4, 2)).buffer(rng.uniform(0.5, 2), 5) for _ in range(4)]
    region = shapely.union_all(blobs[:3])
    rest = region.difference(shapely.Point(*rng.uniform(0, 4, 2)).buffer(0.7, 3))
    return rest if rest.area > 1 else region


def points_in(rng: np.random.Generator, region, n: int) -> np.ndarray:
    west, south, east, north = region.bounds
    points = rng.uniform((west, south), (east, north), (40 * n, 2))
    return points[shapely.contains_xy(region, *points.T)][:n]


@given(n=st.integers(2, 60), seed=st.integers(0, 2**32))
def test_equals_geos(n, seed):
    rng = np.random.default_rng(seed)
    region = random_region(rng)
    points = points_in(rng, region, n)
    cells = vq.cells(points, domain=region)
    assert cells.measures.sum() == pytest.approx(region.area, rel=1e-12)
    theirs = shapely.voronoi_polygons(shapely.MultiPoint(points), extend_to=region, ordered=True)
    areas = shapely.area(shapely.intersection(shapely.get_parts(theirs), region))
    np.testing.assert_allclose(cells.measures, areas, rtol=0, atol=1e-10 * region.area)
    np.testing.assert_allclose(
        cells.measures @ cells.centroids / region.area, shapely.get_coordinates(region.centroid)[0], atol=1e-9
    )


@given(points=any_set().filter(lambda x: x.shape[1] == 2))
def test_of_any_set_fill_the_polygon(points):
    inside = points[shapely.intersects_xy(BAY, *points.T)]
    if not len(inside):
        return
    measures = vq.cells(inside, domain=BAY).measures
    assert (measures >= 0).all()
    assert measures.sum() == pytest.approx(BAY.area, abs=1e-12)


def test_thin_cells_that_rounding_folds():
    turns = np.random.default_rng(0).random((30, 12)) * 2 * np.pi
    for angles in turns:  # wedges that meet in the middle of the square
        points = 0.5 + 1e-10 * np.stack([np.cos(angles), np.sin(angles)], axis=-1)
        cells = vq.cells(points[points[:, 1] < 0.5], domain=BAY)
        assert cells.measures.sum() == pytest.approx(BAY.area, abs=1e-12)


def test_cells_in_pieces():
    cells = vq.cells([[0.3, 0.6], [0.9, 0.1], [0.3, 0.6]], domain=BAY)
    pieces = cells.geometries()
    np.testing.assert_allclose(cells.measures[0] + cells.measures[2], pieces[0].area, rtol=1e-14)
    assert cells.measures[0] == cells.measures[2]
    one = vq.cells([[0.5, 0.45], [0.5, 0.1]], bounds=(0, 1), domain=None).geometries()
    assert [g.area for g in one] == pytest.approx([0.725, 0.275])
    bar = shapely.box(0, 0.8, 1, 1).union(shapely.box(0, 0, 1, 0.5))
    top = vq.cells([[0.5, 0.45], [0.1, 0.9], [0.9, 0.9]], domain=bar)
    assert top.geometries()[0].geom_type == "MultiPolygon"  # below, and a corner between the two above
    np.testing.assert_array_equal(cells.locate([[0.9, 0.2]]), [1])


def test_a_convex_polygon_is_the_same_by_both_ways():
    corners = [(0, 0), (2, 0), (2.5, 1), (1, 3)]
    points = points_in(np.random.default_rng(2), shapely.Polygon(corners), 200)
    ours, theirs = vq.cells(points, domain=corners), vq.cells(points, domain=shapely.Polygon(corners))
    np.testing.assert_allclose(ours.measures, theirs.measures, atol=1e-12)
    np.testing.assert_allclose(ours.centroids, theirs.centroids, atol=1e-9)
    np.testing.assert_allclose([g.area for g in ours.geometries()], ours.measures, atol=1e-12)


class Features:
    """As GeoPandas' frames."""

    __geo_interface__ = {  # noqa: RUF012
        "type": "FeatureCollection",
        "features": [
            {"type": "Feature", "geometry": shapely.box(0, 0, 1, 1).__geo_interface__, "properties": {}},
            {"type": "Feature", "geometry": shapely.box(1, 0, 2, 1).__geo_interface__, "properties": {}},
        ],
    }


@pytest.mark.parametrize("domain", [Features(), Features.__geo_interface__, shapely.box(0, 0, 2, 1).__geo_interface__])
def test_takes_what_has_a_geo_interface(domain):
    np.testing.assert_allclose(vq.cells([[0.5, 0.5], [1.1, 0.5]], domain=domain).measures, [0.8, 1.2])


@pytest.mark.parametrize(
    ("domain", "message"),
    [
        (shapely.Point(0, 0), "domain is a Point of area 0; give a polygon"),
        (shapely.Polygon(), "domain is a Polygon of area 0"),
        (shapely.Polygon([(0, 0), (1, 1), (1, 0), (0, 1)]), "domain is not valid: Self-intersection"),
        (BAY, r"points\[1\] = \[0.5, 0.9\] is outside the polygon; drop it"),
    ],
)
def test_refuses(domain, message):
    with pytest.raises(ValueError, match=message):
        vq.cells([[0.1, 0.1], [0.5, 0.9]], domain=domain)


@given(n=st.integers(1, 40), seed=st.integers(0, 2**32))
def test_neighbours_share_the_border_of_their_pieces(n, seed):
    """Against the common border of the pieces, which GEOS finds where both have the same corners."""
    rng = np.random.default_rng(seed)
    region = random_region(rng)
    points = points_in(rng, region, n)
    cells = vq.cells(points, domain=region)
    near, pieces = cells.neighbours(), cells.geometries()
    np.testing.assert_allclose(near.surfaces, shapely.length(pieces), rtol=1e-9)
    assert near.border.sum() == pytest.approx(region.length, rel=1e-9)
    whole = vq.cells(points, bounds=cells.bounds).neighbours()
    pairs = set(zip(whole.rows.tolist(), whole.indices.tolist(), strict=True))
    found = list(zip(near.rows.tolist(), near.indices.tolist(), near.measures.tolist(), strict=True))
    assert {(i, j) for i, j, _ in found} <= pairs
    assert sorted(found) == sorted((j, i, length) for i, j, length in found) == found
    np.testing.assert_allclose(near.distances, np.linalg.norm(points[near.rows] - points[near.indices], axis=1))


def test_a_shared_face_ends_at_a_hole():
    frame = shapely.box(0, 0, 3, 3).difference(shapely.box(1, 1, 2, 2))
    near = vq.cells([[0.5, 1.5], [2.5, 1.5], [2.5, 1.5]], domain=frame).neighbours()
    assert [near[i].tolist() for i in range(3)] == [[1], [0], []]
    np.testing.assert_allclose(near.measures, 2)  # one below the hole, one above
    np.testing.assert_allclose(near.border, [8, 8, 0])
    apart = shapely.union_all([shapely.box(0, 0, 1, 1), shapely.box(2, 0, 3, 1)])
    assert len(vq.cells([[0.5, 0.5], [2.5, 0.5]], domain=apart).neighbours().indices) == 0
    np.testing.assert_allclose(vq.cells([[0.5, 0.5]], domain=apart).neighbours().border, [8])


@given(any_domain(("polygon",)))
def test_neighbours_of_any_set(case):
    near = vq.cells(case.points, **case.arguments).neighbours()
    assert np.isfinite(near.measures).all()
    assert (near.measures > 0).all()
    assert (near.border >= 0).all()
    if not (near.distances < 1e-6).any():  # else rounding decides which of a cluster's points share a face
        assert near.border.sum() == pytest.approx(case.arguments["domain"].length, rel=1e-9)


@pytest.mark.parametrize(
    ("domain", "message"),
    [
        ({"type": "Feature", "geometry": None}, "domain has no geometry that is not null"),
        ({"type": "FeatureCollection", "features": []}, "domain has no geometry that is not null"),
        ({"type": "Foo"}, "domain of type 'Foo' is no valid GeoJSON"),
        ({"type": "Polygon"}, "domain of type 'Polygon' is no valid GeoJSON"),
        ({"type": "Polygon", "coordinates": [[1, 2], [3]]}, "domain of type 'Polygon' is no valid GeoJSON"),
        ({"type": "FeatureCollection", "features": [1]}, "domain of type 'FeatureCollection' is no valid GeoJSON"),
        (
            {"type": "GeometryCollection", "geometries": [shapely.Polygon([(0, 0), (1, 1), (0, 1), (1, 0)]), BAY]},
            r"domain is not valid: Self-intersection\[0.5 0.5\]",
        ),
    ],
)
def test_refuses_what_is_no_geojson(domain, message):
    if "geometries" in domain:
        domain = domain | {"geometries": [part.__geo_interface__ for part in domain["geometries"]]}
    with pytest.raises(ValueError, match=message) as error:
        vq.cells([[0.5, 0.5]], domain=domain)
    assert "\n" not in str(error.value)


def test_null_geometries_are_dropped():
    square = shapely.box(0, 0, 2, 1).__geo_interface__
    features = [{"type": "Feature", "geometry": part, "properties": {}} for part in (None, square)]
    for domain in (
        {"type": "FeatureCollection", "features": features},
        {"type": "GeometryCollection", "geometries": [None, square]},
    ):
        assert vq.cells([[0.5, 0.5]], domain=domain).measures.tolist() == [2.0]


def test_locates_places_of_the_domain_only():
    cells = vq.cells([[0.1, 0.1], [0.9, 0.1]], domain=BAY)
    np.testing.assert_array_equal(cells.locate([[0.4, 0.25], [1 + 1e-16, 0.5], [0.0, 1.0]]), [0, 1, 0])
    np.testing.assert_array_equal(cells.locate(np.float32([[0.4, 0.25]])), [0])
    for outside in ([0.3, 0.25], [0.5, 0.9], [1.1, 0.5], [np.nan, 0.5]):  # in the hole, in the bay
        with pytest.raises(ValueError, match=r"x\[1\] = \[.*\] is outside the polygon; drop it"):
            cells.locate([[0.1, 0.1], outside])


@pytest.mark.parametrize("what", ["polygons", "triangulation"])
def test_refuses_what_pieces_have_not(what):
    name = what.removesuffix("s")
    with pytest.raises(ValueError, match=f"several pieces and have no {name}s?; use geometries\\(\\), or for a convex"):
        getattr(vq.cells([[0.1, 0.1]], domain=BAY), what)()


def test_of_batches_are_the_measures():
    batch = points_in(np.random.default_rng(4), BAY, 30).reshape(3, 10, 2)
    cells = vq.cells(batch, domain=BAY)
    np.testing.assert_allclose(cells.measures, [vq.cells(points, domain=BAY).measures for points in batch], atol=1e-15)
    batch[1, 2] = 0.5, 0.9
    with pytest.raises(ValueError, match=r"points\[\(1, 2\)\] = \[0.5, 0.9\] is outside the polygon"):
        vq.cells(batch, domain=BAY)
    with pytest.raises(ValueError, match="geometries needs one set of points"):
        cells.geometries()


def test_says_what_is_missing():
    program = (
        "import sys; sys.modules['shapely'] = None; import voroquad as vq\n"
        "try: vq.cells([[.5, .5]], domain={'type': 'Polygon'})\n"
        "except ImportError as error: print(error)\n"
        "try: vq.cells([[.5, .5]]).geometries()\n"
        "except ImportError as error: print(error)\n"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout.count("pip install '.[geo]'") == 2
