"""Checks a run's mosaic.tif: a valid cloud-optimised GeoTIFF in the site's system, and in its place.

    mosaic.py tower OUTPUTS DATA      against an own rectification of the simulated tower's pictures
    mosaic.py targets OUTPUTS         the targets of copr-kite lie where the map says
    mosaic.py format OUTPUTS          the format alone

The rectification shares no code with the program: it takes cameras.toml and poses_true.csv, PROJ's
topocentric axes, a homography from the level ground, and the distortion of Brown and Conrady.
"""

import csv
import json
import sys
import tomllib
import warnings
from pathlib import Path

import numpy as np
import pyproj
import rasterio
from rio_cogeo.cogeo import cog_validate

# A target's centre is looked for within so many metres of its mapped place.
REACH_M = 0.6
# Pictures have no place on a map.
warnings.filterwarnings("ignore", category=rasterio.errors.NotGeoreferencedWarning)


def expect(what, found, expected=True):
    if found != expected:
        sys.exit(f"{what}: found {found!r}, expected {expected!r}")


def opened(folder):
    """The mosaic, after its format was checked."""
    path = folder / "mosaic.tif"
    valid, errors, odd = cog_validate(path, quiet=True)
    expect(f"{path}: is cloud-optimised", (valid, errors, odd), (True, [], []))
    mosaic = rasterio.open(path)
    site = json.loads((folder / "run.json").read_text())["site"]
    if site["body"] == "earth":
        zone = int((site["origin"]["lon_deg"] + 180) // 6) + 1
        half = 32700 if site["origin"]["lat_deg"] < 0 else 32600
        expect(f"{path}: crs", mosaic.crs.to_epsg(), half + zone)
    expect(f"{path}: bands", mosaic.count, 4)
    names = [c.name for c in mosaic.colorinterp]
    expect(f"{path}: colours", names, ["red", "green", "blue", "alpha"])
    check_stac(folder, mosaic)
    opacity = mosaic.read(4)
    expect(f"{path}: opacities", set(np.unique(opacity)) <= {0, 255})
    share = np.count_nonzero(opacity) / opacity.size
    print(f"{path}: {mosaic.width} x {mosaic.height} pixels of {mosaic.res[0]} m, "
          f"overviews {mosaic.overviews(1)}, {100 * share:.0f} % shown, cloud-optimised")
    return mosaic


def check_stac(folder, mosaic):
    """The catalogue's item, where there is one, places the mosaic as the file itself does."""
    path = folder / "stac.json"
    if not path.exists():
        return
    about = json.loads(path.read_text())["assets"]["mosaic.tif"]
    expect(f"{path}: shape", tuple(about["proj:shape"]), mosaic.shape)
    expect(f"{path}: transform", about["proj:transform"], list(mosaic.transform)[:6])
    if about["proj:code"] is None:
        crs = pyproj.CRS.from_json_dict(about["proj:projjson"])
    else:
        crs = pyproj.CRS(about["proj:code"])
    own = pyproj.CRS(mosaic.crs.to_wkt())
    middle = mosaic.transform * (mosaic.width / 2, mosaic.height / 2)
    off = np.subtract(pyproj.Transformer.from_crs(crs, own, always_xy=True).transform(*middle), middle)
    expect(f"{path}: system", np.hypot(*off) < 1e-4)


def targets(folder):
    """Every sure target of the map: a white cross on a black square, centred where the map has it."""
    mosaic = opened(folder)
    grey = mosaic.read([1, 2, 3]).astype(float).mean(axis=0)
    shown = mosaic.read(4) > 0
    to_map = pyproj.Transformer.from_crs(4326, mosaic.crs, always_xy=True)
    rocks = json.loads((folder / "rocks.geojson").read_text())["features"]
    offs = []
    for rock in rocks:
        p_exist = rock["properties"]["p_exist"]
        if p_exist is not None and p_exist < 0.5:
            continue
        x, y = to_map.transform(*rock["geometry"]["coordinates"])
        at = ~mosaic.transform * (x, y)
        found = cross(grey, shown, at, int(REACH_M / mosaic.res[0]))
        if found is None:
            sys.exit(f"{folder}/mosaic.tif: {rock['id']}: no target is seen at its place")
        off = float(np.hypot(found[0] - at[0], found[1] - at[1]))
        print(f"  {rock['id']}: {off:.2f} pixels from its mapped place")
        offs.append(off)
    expect("targets", len(offs), 10)
    rms, worst = float(np.sqrt(np.mean(np.square(offs)))), max(offs)
    print(f"{len(offs)} targets, {rms:.2f} pixels of {mosaic.res[0]} m from their places (RMS), "
          f"the farthest {worst:.2f}")
    expect("every target within a pixel of its mapped place", worst <= 1.0)


def cross(grey, shown, at, reach):
    """The middle of a black square with a white cross near a place, in columns and rows from the
    mosaic's corner; None where there is none.

    The pattern looks the same after half a turn about its middle, up to its small mark: the middle
    is where it correlates best with itself so turned, within the square's dark surround.
    """
    column, row = int(at[0]), int(at[1])
    r = reach
    if min(column, row) < 2 * r or column + 2 * r >= grey.shape[1] or row + 2 * r >= grey.shape[0]:
        return None
    window = grey[row - 2 * r : row + 2 * r + 1, column - 2 * r : column + 2 * r + 1]
    if not shown[row - 2 * r : row + 2 * r + 1, column - 2 * r : column + 2 * r + 1].all():
        return None
    dark = window < 0.5 * np.median(window)
    near = np.zeros_like(dark)
    near[r : 3 * r + 1, r : 3 * r + 1] = True
    if np.count_nonzero(dark & near) < 30:
        return None
    # The dark quarters tell roughly where the square is; then the correlation by half pixels.
    rows, columns = np.nonzero(dark & near)
    c0, r0 = columns.mean(), rows.mean()
    half = 0.5 * np.sqrt(np.count_nonzero(dark & near) / 0.6)
    step = 0.1
    side = np.arange(-half, half + 0.5, 0.5)
    u, v = np.meshgrid(side, side)
    best = (-2.0, 0.0, 0.0)
    for dy in np.arange(-3, 3 + step, step):
        for dx in np.arange(-3, 3 + step, step):
            a = bilinear(window, c0 + dx + u, r0 + dy + v)
            b = bilinear(window, c0 + dx - u, r0 + dy - v)
            best = max(best, (np.corrcoef(a.ravel(), b.ravel())[0, 1], dx, dy))
    correlation, dx, dy = best
    if correlation < 0.6:
        return None
    # Pixel middles are halves from the corner.
    return column - 2 * r + c0 + dx + 0.5, row - 2 * r + r0 + dy + 0.5


def bilinear(picture, u, v):
    """Values of a picture (rows, columns, ...) between its pixel middles."""
    u = np.clip(u, 0, picture.shape[1] - 1.001)
    v = np.clip(v, 0, picture.shape[0] - 1.001)
    left, top = u.astype(int), v.astype(int)
    s, t = u - left, v - top
    if picture.ndim == 3:
        s, t = s[..., None], t[..., None]
    at = lambda i, j: picture[top + j, left + i]
    return (at(0, 0) * (1 - s) + at(1, 0) * s) * (1 - t) + (at(0, 1) * (1 - s) + at(1, 1) * s) * t


def rotation(q):
    w, x, y, z = q
    return np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ])


def tower(folder, data):
    """The mosaic against a rectification by homographies, best view first."""
    mosaic = opened(folder)
    origin = json.loads((folder / "run.json").read_text())["site"]["origin"]
    lat, lon, height = origin["lat_deg"], origin["lon_deg"], origin["height_m"]
    topocentric = pyproj.Transformer.from_pipeline(
        "+proj=pipeline +step +proj=cart +ellps=WGS84 "
        f"+step +proj=topocentric +ellps=WGS84 +lat_0={lat} +lon_0={lon} +h_0={height}"
    )
    from_map = pyproj.Transformer.from_crs(mosaic.crs, 4326, always_xy=True)
    columns, rows = np.meshgrid(np.arange(mosaic.width) + 0.5, np.arange(mosaic.height) + 0.5)
    x, y = mosaic.transform * (columns, rows)
    east_deg, north_deg = from_map.transform(x, y)
    east, north, up = topocentric.transform(east_deg, north_deg, np.full_like(x, height))

    best = np.full(x.shape, -1.0)
    own = np.zeros(x.shape + (3,))
    ground = np.stack([east, north, up], axis=-1)
    for view in views(data, topocentric):
        picture, camera, turn, centre = view
        p = (ground - centre) @ turn
        with np.errstate(divide="ignore", invalid="ignore"):
            a, b = p[..., 0] / p[..., 2], p[..., 1] / p[..., 2]
        k1, k2, p1, p2, k3 = camera["distortion"]
        r2 = a * a + b * b
        radial = 1 + k1 * r2 + k2 * r2**2 + k3 * r2**3
        u = camera["fx"] * (a * radial + 2 * p1 * a * b + p2 * (r2 + 2 * a * a)) + camera["cx"]
        v = camera["fy"] * (b * radial + p1 * (r2 + 2 * b * b) + 2 * p2 * a * b) + camera["cy"]
        width, height_px = camera["width"], camera["height"]
        inside = (p[..., 2] > 0) & (u > -0.5) & (u < width - 0.5) & (v > -0.5) & (v < height_px - 0.5)
        inside &= r2 < 1.0
        # Best is what stands most steeply over the place, and near: pixels on a square metre.
        distance = np.linalg.norm(p, axis=-1)
        density = np.where(inside, (centre[2] - up) / distance**3, -1.0)
        wins = density > best
        own[wins] = bilinear(picture, u[wins], v[wins])
        best[wins] = density[wins]
    compare(mosaic, own, best > 0)


def views(data, topocentric):
    cameras = tomllib.loads((data / "cameras.toml").read_text())["cameras"]
    for row in csv.DictReader((data / "poses_true.csv").open()):
        camera = cameras[row["camera"]]
        lat, lon, alt = (float(row[k]) for k in ("lat_deg", "lon_deg", "alt_m"))
        place = np.array(topocentric.transform(lon, lat, alt))
        body = rotation([float(row[k]) for k in ("qw", "qx", "qy", "qz")])
        mount = camera["mount"]
        turn = body @ rotation(mount["quaternion"])
        centre = place + body @ np.array(mount["translation_m"])
        with rasterio.open(data / row["path"]) as file:
            picture = np.moveaxis(file.read([1, 2, 3]), 0, -1).astype(float)
        yield picture, {"distortion": [0.0] * 5, **camera}, turn, centre


def compare(mosaic, own, covered):
    theirs = np.moveaxis(mosaic.read([1, 2, 3]), 0, -1).astype(float)
    shown = mosaic.read(4) > 0
    both = shown & covered
    print(f"  shown here {np.count_nonzero(shown)}, there {np.count_nonzero(covered)}, both {np.count_nonzero(both)}")
    expect("mosaic shows little that the rectification does not",
           np.count_nonzero(shown & ~covered) <= 0.005 * np.count_nonzero(covered))
    # Far ground is left out where the pictures are coarse: all that is shown must be the same.
    difference = np.abs(theirs - own).mean(axis=-1)[both]
    middle, most = np.median(difference), np.percentile(difference, 99)
    off = shift(theirs.mean(axis=-1), own.mean(axis=-1), both)
    print(f"  grey levels apart: median {middle:.2f}, 99 % {most:.2f}; shifted by "
          f"{off[0]:+.3f}, {off[1]:+.3f} pixels")
    expect("the rectifications agree to a grey level", middle <= 1.0)
    expect("they are not shifted", max(map(abs, off)) <= 0.1)


def shift(a, b, both):
    """By how many columns and rows one picture is shifted against another: the least squares of
    differences on gradients (Lucas and Kanade 1981)."""
    gy, gx = np.gradient(b)
    inner = both.copy()
    for axis in (0, 1):
        for step in (-1, 1):
            inner &= np.roll(both, step, axis)
    d = (a - b)[inner]
    # Seams and rocks, where the two may disagree, do not count.
    calm = np.abs(d) < 12
    g = np.stack([gx[inner][calm], gy[inner][calm]], axis=1)
    return np.linalg.lstsq(g, -d[calm], rcond=None)[0]


def main(command, folder, *rest):
    if command == "tower":
        tower(Path(folder), Path(rest[0]))
    elif command == "targets":
        targets(Path(folder))
    else:
        opened(Path(folder))


if __name__ == "__main__":
    main(*sys.argv[1:])
