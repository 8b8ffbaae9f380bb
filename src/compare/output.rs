//! What a comparison writes: a layer of all objects, and a summary.

use std::fmt;
use std::path::Path;

use serde_json::{Map, Value, json};
use sha2::{Digest, Sha256};

use super::{Change, Changes, Epoch, Status};
use crate::error::Error;
use crate::evaluate::Estimate;
use crate::frame::{Geodetic, Planet, Site};
use crate::pipeline::{hexadecimal, may_replace};
use crate::publish::layer::{Column, Geometry, Kind, lon_lat};
use crate::publish::report::{changes_page, with_changes};
use crate::publish::{Folder, Format, Layer, Product, qgis};

/// What a row of the layer is made from.
type Row<'a> = (&'a Change, Ends<'a>);
type OfChange<'a> = Column<'a, Row<'a>>;

/// An object in the earlier and the later map.
#[derive(Clone, Copy)]
struct Ends<'a> {
    before: Option<&'a Estimate>,
    after: Option<&'a Estimate>,
}

/// The layer `compare`: every object where it is in the later map, or where it was in the earlier
/// one if it is in that alone.
pub fn layer(changes: &Changes, before: &Epoch, after: &Epoch) -> Layer {
    let mut columns: Vec<OfChange<'_>> = vec![OfChange::text(
        "status",
        "same, moved, new, gone or unseen",
        |(c, _)| Some(c.status.as_str().to_owned()),
    )];
    columns.extend(end_columns());
    columns.extend(offset_columns());
    let rows = changes.changes.iter().map(|change| {
        let ends = Ends {
            before: change.before.map(|i| &before.map.estimates[i]),
            after: change.after.map(|j| &after.map.estimates[j]),
        };
        let shown = ends.after.or(ends.before);
        let id = shown.map_or("", |e| e.rock_id.as_str());
        let place = shown.map_or(Geodetic::from_degrees(0.0, 0.0, 0.0), |e| e.place);
        // Names repeat between the maps, so one that is of the earlier alone says so.
        let id = if ends.after.is_some() {
            format!("b:{id}")
        } else {
            format!("a:{id}")
        };
        (
            id,
            Some(Geometry::Point(lon_lat(place, before.map.planet))),
            (change, ends),
        )
    });
    let about = (
        "compare",
        "Changes",
        "what became of every object between two maps",
    );
    Layer::new(about, Some(Kind::Point), before.map.planet).filled(columns, rows)
}

fn end_columns<'a>() -> Vec<OfChange<'a>> {
    vec![
        OfChange::text("rock_id_a", "its name in the earlier map", |(_, e)| {
            e.before.map(|a| a.rock_id.clone())
        }),
        OfChange::text("rock_id_b", "its name in the later map", |(_, e)| {
            e.after.map(|b| b.rock_id.clone())
        }),
        OfChange::text(
            "class",
            "class, by the later map that says one",
            |(_, e)| {
                let class = |e: Option<&Estimate>| e.and_then(|e| e.class.clone());
                class(e.after).or_else(|| class(e.before))
            },
        ),
        OfChange::real("p_exist_a", 4, "probability that it existed", |(_, e)| {
            e.before.and_then(|a| a.p_exist)
        }),
        OfChange::real("p_exist_b", 4, "probability that it exists", |(_, e)| {
            e.after.and_then(|b| b.p_exist)
        }),
    ]
}

fn offset_columns<'a>() -> Vec<OfChange<'a>> {
    let count = |n: Option<usize>| {
        #[expect(clippy::cast_precision_loss, reason = "a count of views")]
        n.map(|n| n as f64)
    };
    vec![
        OfChange::real(
            "distance_m",
            4,
            "from its earlier place to its later, less the common shift, m",
            |(c, _)| c.offset_m.map(|o| o.norm()),
        ),
        OfChange::real("east_m", 4, "the same to the east, m", |(c, _)| {
            c.offset_m.map(|o| o.x)
        }),
        OfChange::real("north_m", 4, "the same to the north, m", |(c, _)| {
            c.offset_m.map(|o| o.y)
        }),
        OfChange::real(
            "sigma",
            4,
            "the same in standard deviations (Mahalanobis distance)",
            |(c, _)| c.mahalanobis,
        ),
        OfChange::real(
            "n_covered_a",
            0,
            "earlier views that cover it",
            move |(c, _)| count(c.n_covered_before),
        ),
        OfChange::real(
            "n_covered_b",
            0,
            "later views that cover it",
            move |(c, _)| count(c.n_covered_after),
        ),
    ]
}

/// The files of a comparison: compare.geojson with its style, compare.csv, compare.json, report.html
/// and run.json, by which the folder is known.
///
/// # Errors
/// What cannot be encoded.
pub fn products(changes: &Changes, before: &Epoch, after: &Epoch) -> Result<Vec<Product>, Error> {
    let layers = [layer(changes, before, after)];
    let mut products = Format::GeoJson.write(&layers)?;
    products.extend(Format::Csv.write(&layers)?);
    products.push(Product::new("compare.qml", qgis::qml(&layers[0])));
    let summary = summary(changes, before, after);
    products.push(Product::new("compare.json", format!("{summary:#}\n")));
    products.push(Product::new("report.html", report(changes, before, after)));
    let manifest = json!({
        "run_id": run_id(changes, before, after),
        "program": "rockmap",
        "version": env!("CARGO_PKG_VERSION"),
        "command": "compare",
        "outputs": ["compare.csv", "compare.geojson", "compare.json", "compare.qml", "report.html", "run.json"],
    });
    products.push(Product::new("run.json", format!("{manifest:#}\n")));
    Ok(products)
}

/// The report of the later map with a section on what changed, or a page of that section alone where
/// that map has no report.
fn report(changes: &Changes, before: &Epoch, after: &Epoch) -> String {
    let told = |origin: Option<Geodetic>| told(changes, (before, after), origin);
    match &after.report {
        Some(report) => with_changes(report.clone(), told(origin(report, before.map.planet))),
        None => changes_page(&after.name, &told(None)),
    }
}

/// The origin of a report's map.
fn origin(report: &Value, planet: Planet) -> Option<Geodetic> {
    let origin = &report["manifest"]["site"]["origin"];
    let [lat_deg, lon_deg, height_m] =
        ["lat_deg", "lon_deg", "height_m"].map(|key| origin[key].as_f64());
    Some(planet.place(lat_deg?, lon_deg?, height_m?))
}

/// The comparison as a page takes it: columns with an entry an object; places are east and north
/// of the origin (metres), by default of the first object.
fn told(changes: &Changes, (before, after): (&Epoch, &Epoch), origin: Option<Geodetic>) -> Value {
    let all = || before.map.estimates.iter().chain(&after.map.estimates);
    let first = all().next().map(|e| e.place);
    let nowhere = Geodetic::from_degrees(0.0, 0.0, 0.0);
    let site = Site::new(before.map.planet, origin.or(first).unwrap_or(nowhere));
    let place = |e: Option<&Estimate>| {
        e.map(|e| {
            let at = site.enu(Geodetic {
                height_m: site.origin().height_m,
                ..e.place
            });
            let at = at.xyz;
            [at.x, at.y].map(|x| (x * 1e3).round() / 1e3 + 0.0)
        })
    };
    let of =
        |value: &dyn Fn(&Change) -> Value| -> Value { changes.changes.iter().map(value).collect() };
    let was = |c: &Change| c.before.map(|i| &before.map.estimates[i]);
    let now = |c: &Change| c.after.map(|j| &after.map.estimates[j]);
    json!({
        "summary": summary(changes, before, after),
        "status": of(&|c| c.status.as_str().into()),
        "id_a": of(&|c| json!(was(c).map(|e| &e.rock_id))),
        "id_b": of(&|c| json!(now(c).map(|e| &e.rock_id))),
        "p_exist_a": of(&|c| json!(was(c).and_then(|e| e.p_exist))),
        "p_exist_b": of(&|c| json!(now(c).and_then(|e| e.p_exist))),
        "distance_m": of(&|c| json!(c.offset_m.map(|o| o.norm()))),
        "sigma": of(&|c| json!(c.mahalanobis)),
        "was_m": of(&|c| json!(place(was(c)))),
        "now_m": of(&|c| json!(place(now(c)))),
    })
}

/// Writes a comparison's files into a folder, which appears whole or not at all.
///
/// # Errors
/// A folder with other things in it or, without `force`, another comparison; one that cannot be
/// written.
pub fn write(
    changes: &Changes,
    before: &Epoch,
    after: &Epoch,
    out: &Path,
    force: bool,
) -> Result<(), Error> {
    let folder = Folder::claim(out)?;
    may_replace(&folder, &run_id(changes, before, after), force)?;
    for product in products(changes, before, after)? {
        folder.write(&product)?;
    }
    folder.publish()?;
    Ok(())
}

/// Names a comparison by what it is made from.
fn run_id(changes: &Changes, before: &Epoch, after: &Epoch) -> String {
    let identity = json!({
        "command": "compare",
        "version": env!("CARGO_PKG_VERSION"),
        "options": changes.options,
        "maps": [before.sha256, after.sha256],
    });
    hexadecimal(&Sha256::digest(identity.to_string()))[..16].to_owned()
}

/// The summary: options, maps, counts by status, the common shift, how well the same objects agree.
pub fn summary(changes: &Changes, before: &Epoch, after: &Epoch) -> Value {
    let counts: Map<String, Value> = Status::ALL
        .into_iter()
        .map(|status| (status.as_str().to_owned(), changes.count(status).into()))
        .collect();
    let map = |epoch: &Epoch| {
        json!({
            "map": epoch.name,
            "n_objects": epoch.map.estimates.len(),
            "footprints": epoch.coverage.is_some(),
            "sha256": epoch.sha256,
        })
    };
    json!({
        "a": map(before),
        "b": map(after),
        "options": changes.options,
        "counts": counts,
        "shift": changes.shift,
        "agreement": {
            "rms_m": changes.rms_m(),
            "mean_d2": changes.mean_d2(),
        },
    })
}

impl fmt::Display for Changes {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for status in Status::ALL {
            writeln!(f, "{:<18}{}", status.as_str(), self.count(status))?;
        }
        if let Some(shift) = &self.shift {
            let (east, north) = (shift.east_m, shift.north_m);
            let (se, sn) = (shift.sigma_east_m, shift.sigma_north_m);
            writeln!(f, "{:<18}{east:.3} m east (sigma {se:.3})", "shift")?;
            writeln!(f, "{:<18}{north:.3} m north (sigma {sn:.3})", "")?;
            writeln!(f, "{:<18}{} objects", "  agreed on by", shift.n_pairs)?;
        }
        if let (Some(rms_m), Some(mean_d2)) = (self.rms_m(), self.mean_d2()) {
            writeln!(f, "{:<18}{rms_m:.3} m", "rms of the same")?;
            writeln!(f, "{:<18}{mean_d2:.2} (2 if sigmas are right)", "mean d2")?;
        }
        Ok(())
    }
}
