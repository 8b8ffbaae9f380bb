//! Reads scene files. Every key has a default but `rocks.number` under a law that names no density;
//! all faults of a file are reported at once.

use std::path::Path;

use crate::error::{Error, Fault, Place};
use crate::frame::{Geodetic, Planet, Site};
use crate::input::{Document, Section};
use crate::pose::PoseSigma;

use super::diameters::DiameterLaw;
use super::scene::{
    Area, Border, BoxExtent, Clusters, Detector, GroundPlan, Occlusion, Palette, PictureFormat,
    PoseKey, PosePlan, RenderPlan, RockPlan, Scene, ScoreLaw, TerrainModel,
};
use super::scene_cameras::cameras;
use super::scene_platforms::platforms;

/// How many files may lie over one another.
const DEEPEST_BASE: usize = 8;

/// The largest number of rocks, stations or parents a scene may ask for.
const MOST: u64 = 1_000_000;

impl Scene {
    /// Reads a scene file, and the one it names as its `base`, if any.
    ///
    /// # Errors
    /// A file that cannot be read, or all faults of the scene.
    pub fn read(path: &Path) -> Result<Self, Error> {
        let document = load(path, &path.display().to_string(), DEEPEST_BASE)?;
        let name = path.file_stem().map(|s| s.to_string_lossy().into_owned());
        Self::from_document(document, &name.unwrap_or_default())
    }

    /// Reads a scene from text; `base` is not looked up. `shown` is the name faults call it by.
    ///
    /// # Errors
    /// All faults of the scene.
    pub fn parse(text: &str, shown: &str) -> Result<Self, Error> {
        Self::from_document(Document::parse(text, shown)?, shown)
    }

    /// Reads a scene from a document, such as one with overrides laid over it.
    ///
    /// # Errors
    /// All faults of the scene.
    pub fn from_document(document: Document, name: &str) -> Result<Self, Error> {
        let root = document.root();
        root.text("base");
        let site = site(root.section("site"));
        let cameras = cameras(&root.section("cameras"));
        let names: Vec<String> = cameras.iter().map(|c| c.name.clone()).collect();
        let scene = Self {
            name: root.text("name").unwrap_or_else(|| name.to_owned()),
            seed: root.integer("seed", 0..=1 << 53).unwrap_or(0),
            rocks: rocks(root.section("rocks")),
            ground: ground(root.section("ground"), site.origin().height_m),
            platforms: platforms(&root.section("platforms"), &names),
            poses: poses(root.section("poses")),
            detector: detector(root.section("detector")),
            render: render(root.section("render")),
            site,
            cameras,
        };
        root.finish();
        Error::check(document.into_faults())?;
        Ok(scene)
    }
}

/// The document of a scene file, laid over that of its base.
///
/// # Errors
/// A file that cannot be read or is not TOML, or bases without an end.
fn load(path: &Path, shown: &str, depth: usize) -> Result<Document, Error> {
    let text = std::fs::read_to_string(path).map_err(|e| Error::io(path, "read", e))?;
    let document = Document::parse(&text, shown)?;
    let root = document.root();
    let base = if root.has("base") {
        root.text("base")
    } else {
        None
    };
    let Some(base) = base else {
        return Ok(document);
    };
    if depth == 0 {
        let expected = format!("at most {DEEPEST_BASE} files over one another");
        return Err(Fault::found(Place::file(shown), "base", "no end", expected).into());
    }
    let below = path.parent().unwrap_or(Path::new("")).join(base);
    let below = load(&below, &below.display().to_string(), depth - 1)?;
    Ok(document.over(below))
}

pub(super) fn not_below_zero(section: &Section, key: &str, default: f64) -> f64 {
    section
        .number(key, 0.0.., "a number not below zero")
        .unwrap_or(default)
}

pub(super) fn above_zero(section: &Section, key: &str, default: f64) -> f64 {
    section
        .number(key, f64::MIN_POSITIVE.., "a number above zero")
        .unwrap_or(default)
}

fn share(section: &Section, key: &str, default: f64) -> f64 {
    section.number(key, 0.0..=1.0, "0 to 1").unwrap_or(default)
}

pub(super) fn degrees(section: &Section, key: &str, bound: f64, default: f64) -> f64 {
    let expected = format!("-{bound} to {bound}");
    section
        .number(key, -bound..=bound, &expected)
        .unwrap_or(default)
        .to_radians()
}

pub(super) fn metres(section: &Section, key: &str, default: f64) -> f64 {
    section
        .number(key, -1e5..=1e5, "-100000 to 100000")
        .unwrap_or(default)
}

/// A whole number that counts things.
pub(super) fn count(section: &Section, key: &str, least: u64) -> Option<usize> {
    section
        .integer(key, least..=MOST)
        .and_then(|n| usize::try_from(n).ok())
}

fn site(section: Section) -> Site {
    let names = Planet::ALL.map(|p| p.name);
    let planet = section.word("body", &names).and_then(|n| Planet::named(&n));
    let origin = section.section("origin");
    let lat = origin.number("lat_deg", -89.0..=89.0, "-89 to 89");
    let lon = origin.number("lon_deg", -180.0..=180.0, "-180 to 180");
    let height = origin.number("height_m", -2e4..=2e4, "-20000 to 20000");
    origin.finish();
    section.finish();
    Site::new(
        planet.unwrap_or(Planet::EARTH),
        Geodetic::from_degrees(
            lat.unwrap_or(-24.45),
            lon.unwrap_or(-69.93),
            height.unwrap_or(1000.0),
        ),
    )
}

fn rocks(section: Section) -> RockPlan {
    let area = area(section.section("area"));
    let diameter = diameter(section.section("diameter"));
    let plan = RockPlan {
        number: rock_number(&section, area, &diameter),
        area,
        diameter,
        clusters: clusters(section.section("clusters")),
        overlap: section.boolean("overlap").unwrap_or(true),
        height_ratio: section
            .number("height_ratio", 0.05..=1.0, "0.05 to 1")
            .unwrap_or(0.45),
        irregularity: share(&section, "irregularity", 0.0),
        class: section.text("class").unwrap_or_else(|| "rock".to_owned()),
    };
    section.finish();
    plan
}

fn area(section: Section) -> Area {
    let area = Area {
        west_m: metres(&section, "west_m", -2.0),
        east_m: metres(&section, "east_m", 38.0),
        south_m: metres(&section, "south_m", -9.0),
        north_m: metres(&section, "north_m", 9.0),
    };
    if area.east_m <= area.west_m {
        section.fault("east_m", area.east_m, "a number above west_m");
    }
    if area.north_m <= area.south_m {
        section.fault("north_m", area.north_m, "a number above south_m");
    }
    section.finish();
    area
}

fn diameter(section: Section) -> DiameterLaw {
    let law = section.word("law", &["exponential", "golombek_rapp"]);
    let law = if law.as_deref() == Some("golombek_rapp") {
        let (min_m, max_m) = (
            above_zero(&section, "min_m", 0.1),
            above_zero(&section, "max_m", 1.5),
        );
        if max_m <= min_m {
            section.fault("max_m", max_m, "a number above min_m");
        }
        DiameterLaw::GolombekRapp {
            coverage: section
                .number("coverage", 0.001..=0.5, "0.001 to 0.5")
                .unwrap_or(0.08),
            min_m,
            max_m,
        }
    } else {
        DiameterLaw::Exponential {
            min_m: above_zero(&section, "min_m", 0.08),
            mean_excess_m: not_below_zero(&section, "mean_excess_m", 0.12),
        }
    };
    section.finish();
    law
}

/// `number`, or what `density_per_m2` or the law makes of the area.
fn rock_number(section: &Section, area: Area, law: &DiameterLaw) -> usize {
    let number = count(section, "number", 0);
    let density = section.number("density_per_m2", 0.0..=1e4, "0 to 10000");
    if section.has("number") && section.has("density_per_m2") {
        section.problem(
            "density_per_m2",
            "found number and density_per_m2, expected one of the two",
        );
    }
    let of_area = |density: f64| {
        let number = (density * area.size_m2()).round().clamp(0.0, 1e6);
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "clamped"
        )]
        let number = number as usize;
        number
    };
    number
        .or_else(|| density.or_else(|| law.density_per_m2()).map(of_area))
        .unwrap_or(500)
}

fn clusters(section: Section) -> Option<Clusters> {
    let parents = count(&section, "parents", 1);
    let clusters = Clusters {
        parents: parents.unwrap_or(20),
        sigma_m: above_zero(&section, "sigma_m", 1.0),
        share: share(&section, "share", 1.0),
    };
    let present = section.is_present();
    section.finish();
    present.then_some(clusters)
}

fn ground(section: Section, origin_m: f64) -> GroundPlan {
    let plan = GroundPlan {
        height_m: section
            .number("height_m", -2e4..=2e4, "-20000 to 20000")
            .unwrap_or(origin_m),
        slope: degrees(&section, "slope_deg", 30.0, 0.0),
        slope_azimuth: degrees(&section, "slope_azimuth_deg", 360.0, 0.0),
        roughness_m: not_below_zero(&section, "roughness_m", 0.0),
        roughness_length_m: above_zero(&section, "roughness_length_m", 5.0),
        rock_deviation_m: not_below_zero(&section, "rock_deviation_m", 0.0),
        model: terrain_model(section.section("model")),
    };
    section.finish();
    plan
}

fn terrain_model(section: Section) -> TerrainModel {
    let kind = section.word("kind", &["plane", "raster"]);
    let raster = TerrainModel::Raster {
        post_m: above_zero(&section, "post_m", 0.25),
        error_m: not_below_zero(&section, "error_m", 0.0),
        error_length_m: above_zero(&section, "error_length_m", 10.0),
    };
    section.finish();
    if kind.as_deref() == Some("raster") {
        raster
    } else {
        TerrainModel::Plane
    }
}

fn poses(section: Section) -> PosePlan {
    let sigma = section.section("sigma");
    let angle = |key, default: f64| not_below_zero(&sigma, key, default).to_radians();
    let plan = PosePlan {
        sigma: PoseSigma {
            east_m: not_below_zero(&sigma, "east_m", 0.05),
            north_m: not_below_zero(&sigma, "north_m", 0.05),
            up_m: not_below_zero(&sigma, "up_m", 0.02),
            roll: angle("roll_deg", 0.25),
            pitch: angle("pitch_deg", 0.25),
            yaw: angle("yaw_deg", 0.4),
        },
        scale: not_below_zero(&section, "scale", 1.0),
        drift_share: share(&section, "drift_share", 0.0),
        drift_stations: above_zero(&section, "drift_stations", 8.0),
        write_sigmas: section.boolean("write_sigmas").unwrap_or(false),
        key: match section.word("key", &["image", "time"]).as_deref() {
            Some("time") => PoseKey::Time,
            _ => PoseKey::Image,
        },
    };
    sigma.finish();
    section.finish();
    plan
}

fn detector(section: Section) -> Detector {
    let detector = Detector {
        p_max: share(&section, "p_max", 0.92),
        px50: not_below_zero(&section, "px50", 25.0),
        px_width: above_zero(&section, "px_width", 6.0),
        min_range_m: not_below_zero(&section, "min_range_m", 0.0),
        max_range_m: above_zero(&section, "max_range_m", 14.0),
        clutter_per_image: section
            .number("clutter_per_image", 0.0..=1e4, "0 to 10000")
            .unwrap_or(3.0),
        clutter_px: above_zero(&section, "clutter_px", 30.0),
        clutter_sigma: not_below_zero(&section, "clutter_sigma", 0.5),
        pixel_px: not_below_zero(&section, "pixel_px", 1.5),
        outlier_share: share(&section, "outlier_share", 0.0),
        outlier_factor: not_below_zero(&section, "outlier_factor", 5.0),
        box_sigma: not_below_zero(&section, "box_sigma", 0.15),
        score_true: scores(section.section("score_true"), 0.85),
        score_false: scores(section.section("score_false"), 0.4),
        occlusion: Occlusion {
            rocks: section.boolean("rocks_hide").unwrap_or(false),
            ground: section.boolean("ground_hides").unwrap_or(false),
        },
        extent: match section.word("box", &["body", "visible"]).as_deref() {
            Some("visible") => BoxExtent::Visible,
            _ => BoxExtent::Body,
        },
        border: match section.word("border", &["keep", "clip", "drop"]).as_deref() {
            Some("clip") => Border::Clip,
            Some("drop") => Border::Drop,
            _ => Border::Keep,
        },
    };
    if detector.min_range_m >= detector.max_range_m {
        section.fault(
            "min_range_m",
            detector.min_range_m,
            "a number below max_range_m",
        );
    }
    section.finish();
    detector
}

fn scores(section: Section, median: f64) -> ScoreLaw {
    let law = ScoreLaw {
        median: section
            .number("median", 0.001..=0.999, "0.001 to 0.999")
            .unwrap_or(median),
        spread: not_below_zero(&section, "spread", 0.8),
    };
    section.finish();
    law
}

fn render(section: Section) -> Option<RenderPlan> {
    let plan = RenderPlan {
        format: match section.word("format", &["png", "jpg"]).as_deref() {
            Some("png") => PictureFormat::Png,
            _ => PictureFormat::Jpeg,
        },
        sun_azimuth: degrees(&section, "sun_azimuth_deg", 360.0, 20.0),
        sun_elevation: section
            .number("sun_elevation_deg", 5.0..=90.0, "5 to 90")
            .unwrap_or(38.0)
            .to_radians(),
        palette: match section
            .word("palette", &["desert", "mars", "moon"])
            .as_deref()
        {
            Some("mars") => Palette::Mars,
            Some("moon") => Palette::Moon,
            _ => Palette::Desert,
        },
        pebbles_per_m2: section
            .number("pebbles_per_m2", 0.0..=300.0, "0 to 300")
            .unwrap_or(60.0),
        sensor_noise: not_below_zero(&section, "sensor_noise", 1.5),
    };
    // `enabled = false` lets a scene file take a base's pictures away.
    let wanted = section.boolean("enabled").unwrap_or(true) && section.is_present();
    section.finish();
    wanted.then_some(plan)
}
