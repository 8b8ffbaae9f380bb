"""Opens every file of an output folder with a current GDAL, Arrow and GeoPandas.

    in_python.py OUTPUTS

Checks that all formats hold the same features, fields and geometries as the GeoJSON layers, in the
coordinate reference system of the site's planet, or in that of output.crs where PROJ takes the
GeoJSON's places to; that every polygon is valid, and that the STAC item has what its specification
requires.
"""

import csv
import json
import sys
from pathlib import Path

import geopandas
import pyarrow.parquet
import pyogrio
import pyproj
from shapely import hausdorff_distance, transform
from shapely.geometry import Point, shape
from shapely.geometry.polygon import orient

# Places in lengths have 4 decimals, and those of GeoJSON they are compared with 9 of a degree; edges
# get corners where they would stray by a millimetre.
MAX_OFF = 0.0005
MAX_EDGE_OFF = 0.0015


def expect(what, found, expected):
    if found != expected:
        sys.exit(f"{what}: found {found!r}, expected {expected!r}")


def check_geojson(path, body):
    """RFC 7946: a feature collection of valid polygons with the right-hand rule."""
    text = json.loads(path.read_text())
    expect(f"{path.name}: type", text["type"], "FeatureCollection")
    expect(f"{path.name}: crs member", "crs" in text, body != "earth")
    ids = [feature["id"] for feature in text["features"]]
    expect(f"{path.name}: ids are sorted", ids, sorted(ids))
    expect(f"{path.name}: ids are unique", len(set(ids)), len(ids))
    types = {f["geometry"]["type"] for f in text["features"] if f["geometry"]}
    expect(f"{path.name}: one geometry type", len(types) <= 1, True)
    for feature in text["features"]:
        if feature["geometry"] is None:
            continue
        geometry = shape(feature["geometry"])
        shown = f"{path.name} {feature['id']}"
        expect(f"{shown}: is valid", geometry.is_valid, True)
        for part in getattr(geometry, "geoms", [geometry]):
            if part.geom_type == "Polygon":
                same = orient(part).exterior.coords[:] == part.exterior.coords[:]
                expect(f"{shown}: winds counter-clockwise", same, True)
    return text["features"]


def check_place(shown, found, expected, moved):
    """The same geometry, or where it was taken to another system, as near as its decimals allow."""
    if moved is None:
        if not expected.equals(found):
            sys.exit(f"{shown}: found {found}, expected {expected}")
        return 0.0
    expected = transform(expected, moved, interleaved=False)
    expect(f"{shown}: is valid", found.is_valid, True)
    is_point = expected.geom_type == "Point"
    # Corners that edges were given are no difference: each outline is held against the other's.
    a, b = (found, expected) if is_point else (found.segmentize(0.05), expected.segmentize(0.05))
    off = hausdorff_distance(a, b)
    if off > (MAX_OFF if is_point else MAX_EDGE_OFF):
        sys.exit(f"{shown}: found {found}, {off} m from the GeoJSON's place {expected}")
    return off


def check_frame(shown, frame, features, crs, moved):
    """Returns how far the farthest place is from the GeoJSON's."""
    expect(f"{shown}: features", len(frame), len(features))
    if moved is not None:
        expect(f"{shown}: is in {crs.name}", frame.crs.equals(crs, ignore_axis_order=True), True)
    if not frame.crs.equals(crs, ignore_axis_order=True):
        found = frame.crs.to_wkt()
        if frame.crs.ellipsoid.semi_major_metre != crs.ellipsoid.semi_major_metre:
            sys.exit(f"{shown}: found {found}, expected {crs.to_wkt()}")
    if not features:
        return 0.0
    worst = 0.0
    key = list(features[0]["properties"])[0]
    places = {f["id"]: f["geometry"] and shape(f["geometry"]) for f in features}
    for row in frame.itertuples():
        values = row._asdict()
        id = values[key]
        if key == "image_id" and "det_id" in values:
            id = f"{id}/{values['det_id']}"
        place = places[id]
        if place is None or values["geometry"] is None or values["geometry"].is_empty:
            empty = place is None and (values["geometry"] is None or values["geometry"].is_empty)
            expect(f"{shown} {id}: has no geometry", empty, True)
        else:
            off = check_place(f"{shown} {id}", values["geometry"], place, moved)
            worst = max(worst, off)
    fields = list(features[0]["properties"])
    expect(f"{shown}: fields", [c for c in frame.columns if c not in ("geometry", "bbox")], fields)
    for field in fields:
        if not field.endswith(("_m", "_deg", "_px", "_m2", "p_exist", "score")):
            continue
        found = sum(v for v in frame[field] if v == v and v is not None)
        wanted = sum(f["properties"][field] or 0.0 for f in features)
        if abs(found - wanted) > 1e-6 * max(1.0, abs(wanted)):
            sys.exit(f"{shown}: sum of {field}: found {found}, expected {wanted}")
    return worst


def check_table(path, features, moved):
    """Points of a CSV by the columns that name their units."""
    lines = list(csv.DictReader(path.open()))
    expect(f"{path.name}: rows", len(lines), len(features))
    if not features or features[0]["geometry"] is None or features[0]["geometry"]["type"] != "Point":
        return
    x, y = ("lon_deg", "lat_deg") if moved is None else ("easting_m", "northing_m")
    for line, feature in zip(lines, features):
        place = shape(feature["geometry"])
        found = Point(float(line[x]), float(line[y]))
        check_place(f"{path.name} {feature['id']}", found, place, moved)


def check_stac(folder, body):
    path = folder / "stac.json"
    if not path.exists():
        return
    import pystac

    item = pystac.Item.from_file(str(path))
    expect("stac.json: version", json.loads(path.read_text())["stac_version"], "1.0.0")
    west, south, east, north = item.bbox
    expect("stac.json: box", south <= north and abs(west) <= 180 and abs(east) <= 180, True)
    for asset in item.assets.values():
        expect(f"stac.json: {asset.href} is there", (folder / asset.href).exists(), True)
    times = item.common_metadata
    expect("stac.json: ordered", times.start_datetime <= times.end_datetime, True)
    expect("stac.json: target", item.properties.get("ssys:targets"),
           None if body == "earth" else [body.capitalize()])
    print(f"stac.json: {item.id}, {times.start_datetime} to {times.end_datetime}")


def main(folder):
    run = json.loads((folder / "run.json").read_text())
    site = run["site"]
    crs, moved = pyproj.CRS(site["crs"]), None
    asked = run["config"]["output"].get("crs")
    if asked is not None:
        own, crs = crs, pyproj.CRS(asked)
        moved = pyproj.Transformer.from_crs(own, crs, always_xy=True).transform
    package = folder / "rockmap.gpkg"
    expect("rockmap.gpkg: is there", package.exists(), True)
    held = {name for name, _ in pyogrio.list_layers(package)}
    for path in sorted(folder.glob("*.geojson")):
        name = path.stem
        features = check_geojson(path, site["body"])
        frames = {
            "rockmap.gpkg": geopandas.read_file(package, layer=name),
            f"{name}.fgb": geopandas.read_file(folder / f"{name}.fgb"),
            f"{name}.parquet": geopandas.read_parquet(folder / f"{name}.parquet"),
        }
        off = max(
            check_frame(f"{file} {name}", frame, features, crs, moved)
            for file, frame in frames.items()
        )
        table = pyarrow.parquet.read_table(folder / f"{name}.parquet")
        table.validate(full=True)
        check_table(folder / f"{name}.csv", features, moved)
        expect(f"rockmap.gpkg: holds {name}", name in held, True)
        where = "" if moved is None else f", within {1000 * off:.2f} mm of the GeoJSON in {crs.name}"
        print(f"{name:12} {len(features):6}  the same in all formats{where}")
    if "evidence" in held:
        evidence = pyogrio.read_dataframe(package, layer="evidence", read_geometry=False)
        table = pyarrow.parquet.read_table(folder / "evidence.parquet")
        rows = (folder / "evidence.csv").read_text().count("\n") - 1
        expect("evidence: rows", (len(evidence), table.num_rows), (rows, rows))
        print(f"{'evidence':12} {rows:6}  the same in all formats")
    check_stac(folder, site["body"])


if __name__ == "__main__":
    main(Path(sys.argv[1]))
