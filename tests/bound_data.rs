//! The bounds of real data sets, through the pipeline.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::path::{Path, PathBuf};

use rockmap::evaluate::{
    Comparison, Options, Report, Truth, associate, read_ignored, read_labels, read_truth,
};
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
fn score(
    folder: &Path,
    pipeline: &str,
    set: &[&str],
    kind: Bound,
    radius_m: f64,
) -> (Report, Bounded) {
    let pipeline = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("pipelines")
        .join(pipeline);
    let overrides = Overrides {
        data: Some(folder.to_owned()),
        out: None,
        set: set.iter().map(|s| (*s).to_owned()).collect(),
    };
    let config = Config::read(&pipeline, &overrides).unwrap();
    let labels = folder.join("labels.csv");
    let objects = read_truth(&folder.join("truth.csv"), "truth.csv").unwrap();
    let bounded = bound(&config, &labels, &objects, kind, &Silent).unwrap();
    let options = Options {
        radius_m,
        ..Options::default()
    };
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

#[test]
fn explore() {
    for (set, pipeline, radius_m) in [
        ("mrclam-1", "mrclam.toml", 0.3),
        ("mrclam-2", "mrclam.toml", 0.3),
        ("mrclam-3", "mrclam.toml", 0.3),
        ("mrclam-4", "mrclam.toml", 0.3),
        ("mrclam-5", "mrclam.toml", 0.3),
        ("mrclam-9", "mrclam.toml", 0.3),
        ("copr-kite", "copr-kite.toml", 0.3),
        ("kitti-0001", "kitti.toml", 3.0),
        ("kitti-0011", "kitti.toml", 3.0),
        ("kitti-0014", "kitti.toml", 3.0),
        ("kitti-0000", "kitti.toml", 3.0),
    ] {
        let Some(folder) = data(set) else { return };
        for kind in [Bound::Clairvoyant, Bound::Fair] {
            if kind == Bound::Fair && set.starts_with("mrclam") {
                continue;
            }
            let start = std::time::Instant::now();
            let (report, bounded) = score(&folder, pipeline, &[], kind, radius_m);
            let d = &report.detection;
            println!(
                "{set} {kind:?}: f1 {:?} rmse {:?} match {} miss {} false {} gospa {:.3} nees {:?} purity {:?} {} steps, move {:.1e} unl {} unus {} {:.2} s",
                d.f1,
                d.rmse_m,
                d.n_matched,
                d.n_missed,
                d.n_false,
                report.gospa.gospa_m,
                report.consistency.nees,
                report.association.as_ref().unwrap().purity,
                bounded.solver.iterations,
                bounded.solver.last_move_m,
                bounded.n_left_out,
                bounded.n_unusable,
                start.elapsed().as_secs_f64()
            );
        }
    }
}
