//! The bounds of real data sets, through the pipeline.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::path::{Path, PathBuf};

use rockmap::evaluate::{
    Comparison, Options, Report, Truth, associate, read_ignored, read_labels, read_truth,
};
use rockmap::frame::{Geodetic, Point, Site};
use rockmap::pipeline::{Bound, Bounded, Config, Overrides, Silent, bound};

/// The folder of a data set, or `None` with one line that says so.
fn data(set: &str) -> Option<PathBuf> {
    let data =
        std::env::var_os("ROCKMAP_DATA").map_or_else(|| "../shared/data".into(), PathBuf::from);
    let folder = data.join(set);
    if folder.is_dir() {
        return Some(folder);
    }
    println!("skipped: {} is not there", folder.display());
    None
}

/// Solves a bound and holds it against the truth.
fn score(folder: &Path, pipeline: &str, kind: Bound) -> (Report, Bounded) {
    let pipeline = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("pipelines")
        .join(pipeline);
    let overrides = Overrides {
        data: Some(folder.to_owned()),
        out: None,
        set: Vec::new(),
    };
    let config = Config::read(&pipeline, &overrides).unwrap();
    let labels = folder.join("labels.csv");
    let objects = read_truth(&folder.join("truth.csv"), "truth.csv").unwrap();
    let bounded = bound(&config, &labels, &objects, kind, &Silent).unwrap();
    let options = Options::default();
    let ignore = folder.join("ignore.csv");
    let truth = Truth {
        objects,
        ignored: if ignore.exists() {
            read_ignored(&ignore, "ignore.csv").unwrap()
        } else {
            Vec::new()
        },
    };
    let comparison = Comparison::new(&bounded.map, &truth, &options).unwrap();
    let mut report = Report::new(&comparison);
    let labels = read_labels(&labels, "labels.csv").unwrap();
    report.set_association(associate(&comparison, &labels, &bounded.evidence).unwrap());
    (report, bounded)
}

fn is_clairvoyant(set: &str, pipeline: &str, n: usize, worst_m: f64) {
    let Some(folder) = data(set) else { return };
    let (report, bounded) = score(&folder, pipeline, Bound::Clairvoyant);
    let found = &report.detection;
    assert!(bounded.solver.converged, "{set}: {:?}", bounded.solver);
    assert_eq!((found.n_matched, found.n_missed, found.n_false), (n, 0, 0));
    let rmse_m = found.rmse_m.unwrap();
    assert!(rmse_m < worst_m, "{set}: {rmse_m}");
    let association = report.association.unwrap();
    assert_eq!(association.purity, Some(1.0));
    assert_eq!(association.completeness, Some(1.0));
}

/// Landmarks by range and bearing, hundreds of views of a dozen objects. With identities known and
/// poses left as they are the numpy reference comes to 0.065, 0.070 and 0.031 m.
#[test]
fn landmarks_of_mrclam() {
    is_clairvoyant("mrclam-1", "mrclam.toml", 11, 0.06);
    is_clairvoyant("mrclam-2", "mrclam.toml", 13, 0.08);
    is_clairvoyant("mrclam-3", "mrclam.toml", 14, 0.032);
}

/// Boxes in pictures from a kite. Told only what belongs together, the fair bound takes two lone false
/// boxes for objects.
#[test]
fn targets_under_a_kite() {
    is_clairvoyant("copr-kite", "copr-kite.toml", 10, 0.014);
    let Some(folder) = data("copr-kite") else {
        return;
    };
    let (report, _) = score(&folder, "copr-kite.toml", Bound::Fair);
    assert_eq!(report.detection.n_missed, 0);
    assert!(report.detection.n_false <= 2);
    assert!(report.detection.rmse_m.unwrap() < 0.014);
}

/// Two robots' looks at two landmarks, one look at a thing that moves, one false: from files to map.
#[test]
fn from_files_to_a_map() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| {
        let path = folder.path().join(name);
        std::fs::write(&path, text).unwrap();
        path
    };
    write(
        "poses.csv",
        "image_id,x_m,y_m,z_m,yaw_deg\na,0,0,0,0\nb,4,0,0,0\n",
    );
    // Landmark p lies at (0, 3), q at (4, 5); yaw 0 looks north.
    write(
        "detections.csv",
        "image_id,det_id,bearing_deg,range_m\na,0,0.0,3.0\na,1,38.65981,6.403124\n\
         b,0,-53.130102,5.0\nb,1,0.0,5.0\nb,2,20.0,2.0\nb,3,50.0,2.0\n",
    );
    let labels = write(
        "labels.csv",
        "image_id,det_id,object_id\na,0,p\na,1,q\nb,0,p\nb,1,q\nb,2,\nb,3,mover\n",
    );
    let truth = write(
        "truth.csv",
        "object_id,class,lat_deg,lon_deg\np,post,43.0,-79.0\nq,post,43.1,-79.0\n",
    );
    let truth = read_truth(&truth, "truth.csv").unwrap();
    let config = |terrain: &str| {
        let text = format!(
            "[site]\norigin = {{ lat_deg = 43.0, lon_deg = -79.0, height_m = 0.0 }}\n\
             [input]\nposes = \"poses.csv\"\ndetections = \"detections.csv\"\n{terrain}\
             [noise]\npose = {{ east_m = 0.02, north_m = 0.02, up_m = 0.0, roll_deg = 0.0, \
             pitch_deg = 0.0, yaw_deg = 1.0 }}\n"
        );
        let path = folder.path().join("pipeline.toml");
        Config::parse(&text, &path, &Overrides::default()).unwrap()
    };
    let solve = |terrain: &str, kind| bound(&config(terrain), &labels, &truth, kind, &Silent);
    let plane = "[terrain]\nplane_m = 0.0\n";
    let found = solve(plane, Bound::Clairvoyant).unwrap();
    assert_eq!((found.n_left_out, found.n_unusable), (1, 0));
    let origin = Geodetic::from_degrees(43.0, -79.0, 0.0);
    let site = Site::new(found.map.planet, origin);
    let places: Vec<_> = found
        .map
        .estimates
        .iter()
        .map(|e| site.enu(e.place))
        .collect();
    assert_eq!(places.len(), 2);
    assert!(places[0].horizontal_distance(Point::new(0.0, 3.0, 0.0)) < 1e-4);
    assert!(places[1].horizontal_distance(Point::new(4.0, 5.0, 0.0)) < 1e-4);
    assert_eq!(found.evidence.memberships.len(), 4);
    let shown = labels.display();
    assert_eq!(
        solve(plane, Bound::Fair).unwrap_err().to_string(),
        format!(
            "{shown}: found views without a camera, expected a camera for every view: \
             the fair bound weighs what a picture does not show"
        )
    );
    assert_eq!(
        solve("", Bound::Clairvoyant).unwrap_err().to_string(),
        "terrain: found none, expected one: the bounds place objects on the ground"
    );
}
