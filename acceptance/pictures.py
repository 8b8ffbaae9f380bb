"""Checks annotated pictures with Pillow: they open, have the size of their layout, and keep what the
camera wrote about them.

    pictures.py make DATA COPY              a copy of a data set whose pictures have EXIF and a profile
    pictures.py check OUTPUTS COPY [FORMAT] the annotated pictures of a run on it

Every third picture of the copy is a PNG. FORMAT is that of output.picture_format, if not `same`.
"""

import csv
import hashlib
import json
import shutil
import sys
from pathlib import Path

from PIL import ExifTags, Image, ImageCms

EXIF = {
    ExifTags.Base.Make: "Mast",
    ExifTags.Base.Model: "Left eye",
    ExifTags.Base.Software: "traverse 7",
    ExifTags.Base.DateTime: "2005:10:09 15:00:00",
    ExifTags.Base.Orientation: 3,
}
DETAILS = {
    ExifTags.Base.DateTimeOriginal: "2005:10:09 15:00:00",
    ExifTags.Base.ISOSpeedRatings: 100,
    ExifTags.Base.FocalLength: 8.5,
}
PLACE = {
    ExifTags.GPS.GPSLatitudeRef: "S",
    ExifTags.GPS.GPSLatitude: (24.0, 27.0, 0.0),
    ExifTags.GPS.GPSLongitudeRef: "W",
    ExifTags.GPS.GPSLongitude: (69.0, 55.0, 48.0),
}
XMP = b"<x:xmpmeta xmlns:x='adobe:ns:meta/'><rdf:RDF xmlns:rdf='http://www.w3.org/1999/02/22-rdf-syntax-ns#'/></x:xmpmeta>"
SUFFIXES = {"jpeg": ".jpg", "png": ".png", "tiff": ".tif"}


def expect(what, found, expected=True):
    if found != expected:
        sys.exit(f"{what}: found {found!r}, expected {expected!r}")


def make(data, copy):
    shutil.rmtree(copy, ignore_errors=True)
    shutil.copytree(data, copy)
    profile = ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes()
    rows = list(csv.DictReader((copy / "images.csv").open()))
    for k, row in enumerate(rows):
        path = copy / row["path"]
        with Image.open(path) as picture:
            picture.load()
        exif = Image.Exif()
        exif.update(EXIF)
        exif.get_ifd(ExifTags.IFD.Exif).update(DETAILS)
        exif.get_ifd(ExifTags.IFD.GPSInfo).update(PLACE)
        if k % 3 == 2:
            path.unlink()
            path = path.with_suffix(".png")
            row["path"] = str(path.relative_to(copy))
            picture.save(path, exif=exif)
        else:
            picture.save(path, quality=92, exif=exif, icc_profile=profile, xmp=XMP)
    with (copy / "images.csv").open("w", newline="") as file:
        writer = csv.DictWriter(file, rows[0])
        writer.writeheader()
        writer.writerows(rows)
    print(f"{len(rows)} pictures with EXIF in {copy}")


def about(picture):
    """Everything EXIF says."""
    exif = picture.getexif()
    details, place = exif.get_ifd(ExifTags.IFD.Exif), exif.get_ifd(ExifTags.IFD.GPSInfo)
    pointers = (ExifTags.IFD.Exif, ExifTags.IFD.GPSInfo)
    own = {tag: value for tag, value in exif.items() if tag not in pointers}
    return own, dict(details), dict(place)


def check(outputs, data, wanted_format):
    asked = json.loads((outputs / "run.json").read_text())["config"]["output"]
    layout = asked.get("annotate_layout", "fused")
    rows = list(csv.DictReader((outputs / "annotated" / "index.csv").open()))
    images = {row["image_id"]: row for row in csv.DictReader((data / "images.csv").open())}
    expect("index.csv: every image once", sorted(r["image_id"] for r in rows), sorted(images))
    files = {p for p in (outputs / "annotated").rglob("*") if p.is_file() and p.name != "index.csv"}
    listed = {outputs / "annotated" / row["file"] for row in rows}
    expect("index.csv lists every picture", sorted(listed), sorted(files))
    widths, kept = set(), 0
    for row in rows:
        path = outputs / "annotated" / row["file"]
        shown = row["file"]
        expect(f"{shown}: hash", row["sha256"], hashlib.sha256(path.read_bytes()).hexdigest())
        original = Image.open(data / images[row["image_id"]]["path"])
        with Image.open(path) as picture:
            picture.verify()
        picture = Image.open(path)
        picture.load()
        expect(f"{shown}: format", picture.format.lower(), wanted_format or original.format.lower())
        if wanted_format:
            expect(f"{shown}: extension", path.suffix, SUFFIXES[wanted_format])
        (width, height), own = picture.size, original.size
        expect(f"{shown}: height", height, own[1])
        # A narrow gap lies between the two.
        least, most = (2.0, 2.02) if layout == "side-by-side" else (1.0, 1.0)
        expect(f"{shown}: width {width} from {own[0]}", least <= width / own[0] <= most)
        widths.add((own[0], width))
        differs(shown, picture, original, layout)
        if picture.format != "TIFF":
            check_kept(shown, picture, original)
            kept += 1
    sizes = ", ".join(f"{a} -> {b} wide" for a, b in sorted(widths))
    print(f"{outputs}/annotated: {len(rows)} pictures, {layout}, {sizes}; EXIF kept in {kept}")


def differs(shown, picture, original, layout):
    """Something is drawn, and not everywhere: most pixels of each panel are as in the original."""
    own = original.convert("RGB")
    starts = [0, picture.width - own.width] if layout == "side-by-side" else [0]
    panels = [picture.convert("RGB").crop((x, 0, x + own.width, own.height)) for x in starts]
    plain = own.tobytes()
    for k, panel in enumerate(panels):
        drawn = panel.tobytes()
        apart = [abs(a - b) for a, b in zip(drawn[::61], plain[::61])]
        share = sum(d > 48 for d in apart) / len(apart)
        expect(f"{shown}: panel {k + 1}: a share of {share:.4f} is drawn over", 0.0005 < share < 0.5)
    expect(f"{shown}: panels differ", len({panel.tobytes() for panel in panels}), len(panels))


def check_kept(shown, picture, original):
    for part, found, expected in zip(("own", "details", "place"), about(picture), about(original)):
        expect(f"{shown}: EXIF, {part}", found, expected)
    expect(f"{shown}: EXIF says who made it", picture.getexif()[ExifTags.Base.Make], "Mast")
    if picture.format == original.format == "JPEG":
        for name in ("icc_profile", "xmp"):
            expect(f"{shown}: has {name}", bool(original.info.get(name)), True)
            expect(f"{shown}: {name}", picture.info.get(name), original.info.get(name))


def main(command, *rest):
    if command == "make":
        make(Path(rest[0]), Path(rest[1]))
    else:
        check(Path(rest[0]), Path(rest[1]), rest[2] if len(rest) > 2 else None)


if __name__ == "__main__":
    main(*sys.argv[1:])
