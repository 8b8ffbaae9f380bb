"""Sites where longitudes break: the antimeridian and both poles.

    far_places.py make TINY FOLDER    the data of fixtures/tiny at each of them, in FOLDER/NAME
    far_places.py check FOLDER        the maps made of them, in FOLDER/NAME-map, hold what the one at an
                                      ordinary place does, and their GeoJSON is as RFC 7946 has it

The same poses as offsets from origins of other places give the same rocks and the same ground,
which the tangent planes at each origin must show.
"""

import csv
import json
import sys
import tomllib
from pathlib import Path

import numpy as np
import pyproj
from shapely.geometry import Polygon, shape

PLACES = {
    "plain": (20.0, 30.0),
    "antimeridian": (-17.0, 180.0),
    "antimeridian-west": (64.0, -180.0),
    "north-pole": (90.0, 0.0),
    "south-pole": (-90.0, 0.0),
}
# The middle of what is seen goes to the place, metres east of the first pose.
MIDDLE_M = 9.0


def expect(what, found, expected=True):
    if found != expected:
        sys.exit(f"{what}: found {found!r}, expected {expected!r}")


def tangent_plane(lat, lon, height):
    """Longitude, latitude and height to east, north and up. Not by a map projection: PROJ's are
    good to centimetres only within metres of a pole."""
    return pyproj.Transformer.from_pipeline(
        "+proj=pipeline +step +proj=cart +ellps=WGS84 "
        f"+step +proj=topocentric +ellps=WGS84 +lat_0={lat} +lon_0={lon} +h_0={height}"
    )


def make(tiny, folder):
    origin = tomllib.loads((tiny / "pipeline.toml").read_text())["site"]["origin"]
    height = origin["height_m"]
    topocentric = tangent_plane(origin["lat_deg"], origin["lon_deg"], height)
    with (tiny / "poses.csv").open() as file:
        poses = list(csv.DictReader(file))
    for pose in poses:
        at = [float(pose.pop(key)) for key in ("lon_deg", "lat_deg", "alt_m")]
        x, y, z = topocentric.transform(*at)
        pose |= {"x_m": f"{x - MIDDLE_M:.5f}", "y_m": f"{y:.5f}", "z_m": f"{z:.5f}"}
    pipeline = (tiny / "pipeline.toml").read_text()
    for name, (lat, lon) in PLACES.items():
        data = folder / name
        data.mkdir(parents=True, exist_ok=True)
        with (data / "poses.csv").open("w", newline="") as file:
            writer = csv.DictWriter(file, poses[0])
            writer.writeheader()
            writer.writerows(poses)
        for file in ("cameras.toml", "detections.csv"):
            (data / file).write_text((tiny / file).read_text())
        lines = [line for line in pipeline.splitlines() if not line.startswith("origin")]
        here = f"origin = {{ lat_deg = {lat}, lon_deg = {lon}, height_m = {height} }}"
        lines.insert(lines.index("[site]") + 1, here)
        (data / "pipeline.toml").write_text("\n".join(lines) + "\n")


def positions(coordinates):
    if isinstance(coordinates[0], (int, float)):
        yield coordinates
    else:
        for part in coordinates:
            yield from positions(part)


def rings(geometry):
    kind, coordinates = geometry["type"], geometry["coordinates"]
    polygons = {"Polygon": [coordinates], "MultiPolygon": coordinates}.get(kind, [])
    return [(ring, k > 0) for polygon in polygons for k, ring in enumerate(polygon)]


def signed_area(ring):
    a = np.array(ring)
    # About its own corner: differences of places on one rock are the last digits of a longitude.
    x, y = (a - a[0]).T
    return 0.5 * float(np.sum(x[:-1] * y[1:] - x[1:] * y[:-1]))


def check_rfc_7946(shown, geometry):
    """Longitudes and latitudes in their bounds; rings that close, wind as they must, and never
    leap over the antimeridian; polygons that are simple."""
    for position in positions(geometry["coordinates"]):
        lon, lat = position[:2]
        expect(f"{shown}: {position} lies on the map", -180 <= lon <= 180 and -90 <= lat <= 90)
    for ring, is_hole in rings(geometry):
        expect(f"{shown}: a ring has four positions or more", len(ring) >= 4)
        expect(f"{shown}: a ring closes", ring[0], ring[-1])
        expect(f"{shown}: a ring winds as it must", (signed_area(ring) > 0) != is_hole)
        leaps = [abs(a[0] - b[0]) for a, b in zip(ring, ring[1:]) if abs(a[1]) < 90 or abs(b[1]) < 90]
        expect(f"{shown}: an edge turns by half of the map", max(leaps) < 180)
    if rings(geometry):
        expect(f"{shown}: is simple", shape(geometry).is_valid)
    if geometry["type"] == "LineString":
        line = geometry["coordinates"]
        leaps = [abs(a[0] - b[0]) for a, b in zip(line, line[1:])]
        expect(f"{shown}: a line leaps over the antimeridian", max(leaps) < 180)


def area_m2(geometry, to_local):
    """In the tangent plane, where cuts along a meridian have no width."""
    total = 0.0
    for ring, is_hole in rings(geometry):
        lon, lat = np.array(ring)[:, :2].T
        x, y, _ = to_local.transform(lon, lat, np.zeros_like(lon))
        area = Polygon(np.column_stack([x, y])).area
        total += -area if is_hole else area
    return total


def measured(folder, name):
    """Of every footprint and ellipse its area, of every rock its place about the origin."""
    lat, lon = PLACES[name]
    to_local = tangent_plane(lat, lon, 0)
    map_folder = folder / f"{name}-map"
    areas, places, cut = {}, {}, 0
    for file in sorted(map_folder.glob("*.geojson")):
        for feature in json.loads(file.read_text())["features"]:
            geometry = feature["geometry"]
            if geometry is None:
                continue
            check_rfc_7946(f"{name} {file.name} {feature['id']}", geometry)
            key = (file.stem, feature["id"])
            if rings(geometry):
                areas[key] = area_m2(geometry, to_local)
                sides = {np.sign(p[0]) for p in positions(geometry["coordinates"]) if p[0]}
                cut += sides == {1.0, -1.0}
            elif geometry["type"] == "Point":
                places[key] = to_local.transform(*geometry["coordinates"][:2], 0)[:2]
    return areas, places, cut


def check(folder):
    areas, places, _ = measured(folder, "plain")
    for name in list(PLACES)[1:]:
        here, there, cut = measured(folder, name)
        expect(f"{name}: features", (sorted(here), sorted(there)), (sorted(areas), sorted(places)))
        worst = max(abs(here[key] / areas[key] - 1) for key in areas)
        # At a pole east and north are those of the origin's longitude, as the plain map's are.
        apart = max(float(np.hypot(*np.subtract(there[key], places[key]))) for key in places)
        print(f"{name:18} {len(here)} areas, {cut} of them on both sides; areas within "
              f"{worst:.1e}, places within {1000 * apart:.2f} mm of those of an ordinary site")
        expect(f"{name}: something is cut", cut > 0)
        expect(f"{name}: areas agree", worst < 1e-3)
        expect(f"{name}: places agree", apart < 2e-3)


if __name__ == "__main__":
    if sys.argv[1] == "make":
        make(Path(sys.argv[2]), Path(sys.argv[3]))
    else:
        check(Path(sys.argv[2]))
