"""Opens every file of an output folder in QGIS, without a screen, and draws the project.

    in_qgis.py OUTPUTS PICTURE.png

Checks that each layer file and each layer of the GeoPackage loads with the features, the geometry
type and the coordinate reference system that run.json's site and the GeoJSON layers have, or in
that of output.crs at the place of the GeoJSON layers; that the styles are applied by themselves,
and that the project finds its files in another folder.
"""

import json
import os
import shutil
import sys
import tempfile
from pathlib import Path

os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")
os.environ.setdefault("XDG_RUNTIME_DIR", tempfile.mkdtemp())

from qgis.core import (  # noqa: E402
    QgsApplication,
    QgsCoordinateTransform,
    QgsMapRendererParallelJob,
    QgsMapSettings,
    QgsProject,
    QgsRasterLayer,
    QgsVectorLayer,
    QgsWkbTypes,
)
from qgis.PyQt.QtCore import QSize  # noqa: E402

GEOMETRY = {
    "rocks": QgsWkbTypes.PointGeometry,
    "views": QgsWkbTypes.PointGeometry,
    "detections": QgsWkbTypes.PointGeometry,
    "traverse": QgsWkbTypes.LineGeometry,
    "ellipses": QgsWkbTypes.PolygonGeometry,
    "footprints": QgsWkbTypes.PolygonGeometry,
}
RADIUS = {"earth": 6378137.0, "moon": 1737400.0, "mars": 3396190.0}


class Fault(Exception):
    """What is not as it should be."""


def expect(what, found, expected):
    if found != expected:
        raise Fault(f"{what}: found {found!r}, expected {expected!r}")


def check_layer(shown, layer, name, count, body, crs_asked=None):
    expect(f"{shown}: is valid", layer.isValid(), True)
    expect(f"{shown}: features", layer.featureCount(), count)
    if count or "gpkg" in shown:
        expect(f"{shown}: geometry", layer.geometryType(), GEOMETRY[name])
    crs = layer.crs()
    if shown.endswith(".geojson") and body != "earth" and not crs.isValid():
        return  # An older QGIS does not know the system by its name, and claims none.
    wkt = crs.toWkt()
    if crs_asked is not None and not shown.endswith(".geojson"):
        expect(f"{shown}: geographic", crs.isGeographic(), False)
        if body == "earth":
            expect(f"{shown}: crs", crs.authid(), crs_asked)
    else:
        expect(f"{shown}: geographic", crs.isGeographic(), True)
    if str(int(RADIUS[body])) not in wkt:
        raise Fault(f"{shown}: found {wkt}, expected the system of the {body}")
    if body == "earth" and crs.isGeographic():
        expect(f"{shown}: crs", crs.authid(), "EPSG:4326")


def check_style(shown, layer, qml):
    """The renderer is the one of the style beside the file, not a default of QGIS."""
    styled = QgsVectorLayer(layer.source(), "styled", "ogr")
    _, ok = styled.loadNamedStyle(str(qml))
    expect(f"{shown}: style is readable", ok, True)
    expect(f"{shown}: renderer", layer.renderer().type(), styled.renderer().type())
    expect(f"{shown}: legend", legend(layer), legend(styled))
    expect(f"{shown}: labels", layer.labelsEnabled(), layer.name() == "rocks")


def legend(layer):
    items = layer.renderer().legendSymbolItems()
    return [(item.label(), item.symbol().color().name(), item.symbol().dump()) for item in items]


def check_box(shown, layer, folder):
    """The layer lies where QGIS takes the GeoJSON layer of its name to, within a millimetre or two."""
    if layer.featureCount() == 0:
        return
    plain = QgsVectorLayer(str(folder / f"{layer.name()}.geojson"), "plain", "ogr")
    if not plain.crs().isValid():
        return  # An older QGIS does not know the body's system in GeoJSON.
    there = QgsCoordinateTransform(plain.crs(), layer.crs(), QgsProject.instance())
    places = [f.geometry() for f in plain.getFeatures() if f.hasGeometry()]
    for place in places:
        place.transform(there)
    wanted = places[0].boundingBox()
    for place in places[1:]:
        wanted.combineExtentWith(place.boundingBox())
    found = layer.extent()
    for side in ("xMinimum", "xMaximum", "yMinimum", "yMaximum"):
        off = getattr(found, side)() - getattr(wanted, side)()
        if abs(off) > 0.002:
            raise Fault(f"{shown}: {side} found {off:+.4f} m off that of the GeoJSON layer")


def check_files(folder, body, counts, crs_asked):
    for path in sorted(folder.iterdir()):
        if path.suffix not in (".geojson", ".fgb"):
            continue
        name = path.stem
        layer = QgsVectorLayer(str(path), name, "ogr")
        if path.suffix == ".geojson" and counts[name] == 0:
            # GeoJSON without features has no columns, and QGIS takes it for a table.
            expect(f"{path.name}: is valid", layer.isValid(), True)
            continue
        check_layer(path.name, layer, name, counts[name], body, crs_asked)
        if crs_asked is not None:
            check_box(path.name, layer, folder)
        check_style(path.name, layer, path.with_suffix(".qml"))
        print(f"{path.name:32} {layer.featureCount():6}  {layer.renderer().type()}")
    for name, count in counts.items():
        source = f"{folder / 'rockmap.gpkg'}|layername={name}"
        layer = QgsVectorLayer(source, name, "ogr")
        check_layer(f"rockmap.gpkg {name}", layer, name, count, body, crs_asked)
        if crs_asked is not None:
            check_box(f"rockmap.gpkg {name}", layer, folder)
        check_style(f"rockmap.gpkg {name}", layer, folder / f"{name}.qml")
        print(f"{'rockmap.gpkg ' + name:32} {layer.featureCount():6}  {layer.renderer().type()}")


def check_tables(folder, counts, crs_asked):
    """Tables with places open as layers, too, by the columns the documentation names."""
    for name, count in counts.items():
        path = folder / f"{name}.csv"
        if not path.exists() or count == 0:
            continue
        is_point = GEOMETRY[name] == QgsWkbTypes.PointGeometry
        points = "xField=lon_deg&yField=lat_deg"
        if crs_asked is not None:
            points = "xField=easting_m&yField=northing_m"
        columns = points if is_point else "wktField=wkt"
        crs = crs_asked or "EPSG:4326"
        source = f"{path.as_uri()}?type=csv&{columns}&crs={crs}&detectTypes=yes"
        layer = QgsVectorLayer(source, name, "delimitedtext")
        expect(f"{path.name}: is valid", layer.isValid(), True)
        placed = [f for f in layer.getFeatures() if f.hasGeometry()]
        features = json.loads((folder / f"{name}.geojson").read_text())["features"]
        expect(f"{path.name}: places", len(placed), sum(f["geometry"] is not None for f in features))
        expect(f"{path.name}: geometry", layer.geometryType(), GEOMETRY[name])
        numbers = [f.name() for f in layer.fields() if f.isNumeric()]
        measures = [f.name() for f in layer.fields() if f.name().endswith(("_m", "_m2"))]
        filled = [m for m in measures if any(f[m] not in (None, "") and str(f[m]) != "NULL" for f in placed)]
        expect(f"{path.name}: measures are numbers", sorted(set(filled) - set(numbers)), [])
        print(f"{path.name:32} {len(placed):6}  by {columns}")


def draw(project, extent, picture, pixels=(1600, 1100)):
    settings = QgsMapSettings()
    settings.setLayers(project.layerTreeRoot().checkedLayers())
    settings.setDestinationCrs(project.crs())
    settings.setTransformContext(project.transformContext())
    settings.setBackgroundColor(project.backgroundColor())
    settings.setOutputSize(QSize(*pixels))
    settings.setOutputDpi(144)
    settings.setExtent(extent)
    job = QgsMapRendererParallelJob(settings)
    job.start()
    job.waitForFinished()
    expect("errors in drawing", [e.message for e in job.errors()], [])
    image = job.renderedImage()
    colours = {
        image.pixel(x, y)
        for x in range(0, image.width(), 7)
        for y in range(0, image.height(), 7)
    }
    if len(colours) < 5:
        raise Fault(f"{picture}: found {len(colours)} colours, expected a map")
    image.save(str(picture))
    print(f"drawn to {picture}")


def check_mosaic(folder, project, mosaic):
    """The lowest layer, in its own colours, with its opacity for what no picture shows."""
    expect("mosaic: is a raster", isinstance(mosaic, QgsRasterLayer) and mosaic.isValid(), True)
    expect("mosaic: moved along", str(folder) in mosaic.source(), True)
    expect("mosaic: crs", mosaic.crs() == project.crs(), True)
    expect("mosaic: is lowest", project.layerTreeRoot().layerOrder()[-1].id(), mosaic.id())
    renderer = mosaic.renderer()
    expect("mosaic: renderer", renderer.type(), "multibandcolor")
    bands = (renderer.redBand(), renderer.greenBand(), renderer.blueBand(), renderer.alphaBand())
    expect("mosaic: bands", bands, (1, 2, 3, 4))
    stretched = [e for e in (renderer.redContrastEnhancement(), renderer.blueContrastEnhancement()) if e]
    expect("mosaic: colours are as the pictures have them", stretched, [])
    print(f"{'mosaic.tif':32} {mosaic.width()} x {mosaic.height()}  {renderer.type()}")


def check_project(folder, counts, picture):
    project = QgsProject.instance()
    expect("rockmap.qgz: opens", project.read(str(folder / "rockmap.qgz")), True)
    expect("rockmap.qgz: crs is valid", project.crs().isValid(), True)
    expect("rockmap.qgz: metres", project.crs().isGeographic(), False)
    layers = {layer.id().replace("rockmap_", ""): layer for layer in project.mapLayers().values()}
    mosaic = layers.pop("mosaic", None)
    expect("rockmap.qgz: shows the mosaic", mosaic is not None, (folder / "mosaic.tif").exists())
    if mosaic is not None:
        check_mosaic(folder, project, mosaic)
    expect("rockmap.qgz: layers", sorted(layers), sorted(counts))
    for name, layer in layers.items():
        expect(f"rockmap.qgz: {name} is valid", layer.isValid(), True)
        expect(f"rockmap.qgz: {name} features", layer.featureCount(), counts[name])
        expect(f"rockmap.qgz: {name} moved along", str(folder) in layer.source(), True)
    extent = project.viewSettings().defaultViewExtent()
    draw(project, extent, picture)
    rocks = layers.get("rocks")
    if rocks is not None and rocks.featureCount():
        close = QgsMapSettings()
        close.setDestinationCrs(project.crs())
        close.setTransformContext(project.transformContext())
        box = close.layerExtentToOutputExtent(rocks, rocks.extent())
        some = list(rocks.getFeatures())[rocks.featureCount() // 2].geometry()
        centre = close.layerToMapCoordinates(rocks, some.asPoint())
        box.scale(0.25, centre)
        draw(project, box, picture.with_name(picture.stem + "-close.png"))


def main(outputs, picture):
    QgsApplication.setPrefixPath("/usr", True)
    application = QgsApplication([], False)
    application.initQgis()
    try:
        # Everything is opened where nothing was made: paths must be relative.
        with tempfile.TemporaryDirectory() as elsewhere:
            folder = Path(elsewhere) / "moved"
            shutil.copytree(outputs, folder, ignore=shutil.ignore_patterns("annotated"))
            run = json.loads((folder / "run.json").read_text())
            body, crs_asked = run["site"]["body"], run["config"]["output"].get("crs")
            counts = {
                path.stem: len(json.loads(path.read_text())["features"])
                for path in sorted(folder.glob("*.geojson"))
            }
            check_files(folder, body, counts, crs_asked)
            check_tables(folder, counts, crs_asked)
            check_project(folder, counts, picture)
            QgsProject.instance().clear()
    except Fault as fault:
        print(fault, file=sys.stderr, flush=True)
        # QGIS does not survive its own end while layers are alive.
        os._exit(1)
    application.exitQgis()


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
