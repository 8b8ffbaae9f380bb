//! The pipeline file: what was typed becomes what it means, once, with all faults listed.

use std::path::{Path, PathBuf};

use serde::Serialize;

use super::formats::formats;
use super::paths::{Paths, Source};
use crate::detection::Aim;
use crate::error::{Error, Fault};
use crate::frame::{Crs, Geodetic, Planet};
use crate::input::{Asked, Document, Section};
use crate::pose::PoseSigma;
use crate::publish::Format;

/// A checked pipeline file.
#[derive(Debug, Clone, Serialize)]
pub struct Config {
    /// `[site]`.
    pub site: SiteConfig,
    /// `[input]`.
    pub input: InputConfig,
    /// `[terrain]`.
    pub terrain: TerrainConfig,
    /// `[view]`.
    pub view: ViewConfig,
    /// `[noise]`.
    pub noise: NoiseConfig,
    /// `[fusion]`.
    pub fusion: FusionConfig,
    /// `[output]`.
    pub output: OutputConfig,
}

/// `[site]`: where on which planet.
#[derive(Debug, Clone, Serialize)]
pub struct SiteConfig {
    /// Name of the site; default: the file's name.
    pub name: String,
    /// Origin of the local frame; default: the first pose.
    #[serde(serialize_with = "super::paths::origin")]
    pub origin: Option<Geodetic>,
    /// CRS of easting and northing columns.
    #[serde(serialize_with = "super::paths::crs")]
    pub crs: Option<Crs>,
    /// The planet.
    #[serde(rename = "body", serialize_with = "super::paths::planet")]
    pub planet: Planet,
}

/// `[input]`: the files.
#[derive(Debug, Clone, Serialize)]
pub struct InputConfig {
    /// The data folder, as written.
    pub data: Option<String>,
    /// Pose logs.
    pub poses: Vec<Source>,
    /// Image lists.
    pub images: Vec<Source>,
    /// Cameras.
    pub cameras: Vec<Source>,
    /// Detections.
    pub detections: Vec<Source>,
    /// The largest share of faulty records at which a run still counts as clean.
    pub max_reject_share: f64,
}

/// `[terrain]`: the ground.
#[derive(Debug, Clone, Serialize)]
pub struct TerrainConfig {
    /// Ellipsoidal height of a level ground, metres.
    pub plane_m: Option<f64>,
    /// Height models.
    pub path: Vec<Source>,
    /// How far the true ground may deviate, one standard deviation, metres.
    pub height_sigma_m: f64,
}

/// `[view]`: which point of a box counts, and how far views are trusted.
#[derive(Debug, Clone, Serialize)]
pub struct ViewConfig {
    /// The point of a box taken for the object's place.
    #[serde(serialize_with = "super::paths::aim")]
    pub aim: Aim,
    /// Least ground range, metres.
    pub min_range_m: f64,
    /// Greatest ground range, metres; none if absent.
    pub max_range_m: Option<f64>,
    /// Opening angle of views without a camera, degrees.
    pub fov_deg: f64,
    /// Least score.
    pub min_score: f64,
    /// Longest gap of a pose log to interpolate over, seconds.
    pub max_gap_s: f64,
}

/// `[noise]`: one standard deviation, where the data give none.
#[derive(Debug, Clone, Serialize)]
pub struct NoiseConfig {
    /// Of a mark's column and row, pixels.
    pub pixel_px: f64,
    /// Of a range, metres.
    pub range_m: f64,
    /// Of a bearing or azimuth, degrees.
    pub bearing_deg: f64,
    /// Of a pose.
    pub pose: PoseSigma,
}

/// `[fusion]`: the method.
#[derive(Debug, Clone, Serialize)]
pub struct FusionConfig {
    /// The method.
    pub method: Method,
    /// `em`, `paper`: the one width of the Gaussians, metres.
    pub width_m: f64,
    /// `em`, `paper`: clusters of no more total membership are not reported.
    pub min_weight: f64,
    /// `belief`: how poses are corrected.
    pub pose_correction: String,
}

/// A fusion method.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Method {
    /// Standard EM, without any view constraint.
    Em,
    /// Multiple-view EM (Thompson & Wettergreen 2005).
    Paper,
}

impl Method {
    /// All methods there are.
    pub const ALL: [Self; 2] = [Self::Em, Self::Paper];

    /// Its name in pipeline files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Em => "em",
            Self::Paper => "paper",
        }
    }
}

/// `[output]`: what is written, and where.
#[derive(Debug, Clone, Serialize)]
pub struct OutputConfig {
    /// `belief`: candidates of less existence probability are not written.
    pub min_exist: f64,
    /// The folder. Not part of what the run is, so no output names it.
    #[serde(skip)]
    pub dir: PathBuf,
    /// Map formats.
    pub formats: Vec<Format>,
    /// Whether pictures are annotated.
    pub annotate: bool,
    /// Whether every detection is written by itself too.
    pub detections: bool,
    /// Whether the pictures are laid on the ground as a mosaic.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub mosaic: bool,
    /// Side of the mosaic's pixels, metres; chosen from the data if absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mosaic_m_per_px: Option<f64>,
}

/// What the command line lays over the pipeline file.
#[derive(Debug, Clone, Default)]
pub struct Overrides {
    /// `--data`.
    pub data: Option<PathBuf>,
    /// `--out`.
    pub out: Option<PathBuf>,
    /// `--set KEY.PATH=VALUE`, in order; `--method` is one of them.
    pub set: Vec<String>,
}

impl Config {
    /// Reads and checks a pipeline file.
    ///
    /// # Errors
    /// A file that cannot be read or is not TOML, and all faults of its keys at once.
    pub fn read(path: &Path, overrides: &Overrides) -> Result<Self, Error> {
        let text = std::fs::read_to_string(path).map_err(|e| Error::io(path, "read", e))?;
        Self::parse(&text, path, overrides)
    }

    /// Checks the text of a pipeline file that stands at `path`.
    ///
    /// # Errors
    /// As [`Config::read`].
    pub fn parse(text: &str, path: &Path, overrides: &Overrides) -> Result<Self, Error> {
        let mut document = Document::parse(text, &path.display().to_string())?;
        let unset = overrides.set.iter().filter_map(|a| document.set(a).err());
        let mut faults: Vec<Fault> = unset.collect();
        let root = document.root();
        let config = Self::sections(&root, path, overrides);
        root.finish();
        faults.extend(document.into_faults());
        match config {
            Some(config) if faults.is_empty() => Ok(config),
            _ => Err(Error::Faults(faults)),
        }
    }

    /// Every key a pipeline file may have, as the reader asks for it.
    pub(super) fn keys() -> Vec<Asked> {
        // Tables that are read only where they are present are present here.
        let probe = "[site]\norigin = { lat_deg = 0, lon_deg = 0 }\n";
        let Ok(document) = Document::parse(probe, "probe") else {
            return Vec::new();
        };
        let here = Path::new("pipeline.toml");
        Self::sections(&document.root(), here, &Overrides::default());
        document.asked()
    }

    fn sections(root: &Section<'_>, path: &Path, overrides: &Overrides) -> Option<Self> {
        let site = site(root.section("site"), path);
        let input = root.section("input");
        let paths = Paths::new(&input, path, overrides);
        let input = inputs(input, &paths);
        let terrain = terrain(root.section("terrain"), &paths);
        let view = view(root.section("view"));
        let noise = noise(root.section("noise"));
        let fusion = fusion(root.section("fusion"));
        let output = output(root.section("output"), path, overrides);
        // Only now may a fault end it: all sections have told theirs.
        Some(Self {
            site: site?,
            input: input?,
            terrain,
            view,
            noise,
            fusion: fusion?,
            output: output?,
        })
    }
}

const POSITIVE: &str = "a number above zero";
const NOT_NEGATIVE: &str = "a number not below zero";

/// A number above zero. The least positive number stands in for the open bound.
fn positive(section: &Section<'_>, key: &str, default: f64) -> f64 {
    let found = section.number(key, f64::MIN_POSITIVE.., POSITIVE);
    found.unwrap_or(default)
}

fn not_negative(section: &Section<'_>, key: &str, default: f64) -> f64 {
    section.number(key, 0.0.., NOT_NEGATIVE).unwrap_or(default)
}

fn site(section: Section<'_>, path: &Path) -> Option<SiteConfig> {
    let stem = path.file_stem().map(|s| s.to_string_lossy().into_owned());
    let planet = match section.text("body") {
        None => Some(Planet::EARTH),
        Some(name) => {
            let planet = Planet::named(&name);
            if planet.is_none() {
                let known = "earth, moon (IAU_2015:30100) or mars (IAU_2015:49900); \
                             other bodies are not there yet";
                section.fault("body", format!("{name:?}"), known);
            }
            planet
        }
    };
    let crs = section.text("crs").zip(planet).and_then(|(text, planet)| {
        let crs = Crs::new(&text, planet);
        crs.map_err(|e| section.problem("crs", e.to_string())).ok()
    });
    if let Some(height) = section.text("height") {
        let expected = "no such key: vertical CRSs are not there yet, heights are ellipsoidal";
        section.fault("height", format!("{height:?}"), expected);
    }
    let origin = origin(section.section("origin"));
    let name = section.text("name").or(stem).unwrap_or_default();
    let config = planet.map(|planet| SiteConfig {
        name,
        origin,
        crs,
        planet,
    });
    section.finish();
    config
}

fn origin(section: Section<'_>) -> Option<Geodetic> {
    if !section.is_present() {
        return None;
    }
    let lat = section.number("lat_deg", -90.0..=90.0, "-90 to 90");
    let lon = section.number("lon_deg", -180.0..=360.0, "-180 to 360");
    for key in ["lat_deg", "lon_deg"] {
        if !section.has(key) {
            section.fault(key, "nothing", "a number");
        }
    }
    let height_m = section.number("height_m", .., "a number").unwrap_or(0.0);
    section.finish();
    Some(Geodetic::from_degrees(lat?, lon?, height_m))
}

fn inputs(section: Section<'_>, paths: &Paths) -> Option<InputConfig> {
    let sources = |key: &str| paths.sources(&section, key);
    let required = |key: &str| {
        let found = sources(key);
        if found.is_none() && !section.has(key) {
            section.fault(key, "nothing", "a file or a list of files");
        }
        found.filter(|list| !list.is_empty())
    };
    let (poses, detections) = (required("poses"), required("detections"));
    let config = InputConfig {
        data: section.text("data"),
        images: sources("images").unwrap_or_default(),
        cameras: sources("cameras").unwrap_or_default(),
        max_reject_share: section
            .number("max_reject_share", 0.0..=1.0, "0 to 1")
            .unwrap_or(0.1),
        poses: poses.unwrap_or_default(),
        detections: detections.unwrap_or_default(),
    };
    section.finish();
    Some(config)
}

fn terrain(section: Section<'_>, paths: &Paths) -> TerrainConfig {
    let config = TerrainConfig {
        plane_m: section.number("plane_m", .., "a number"),
        path: paths.sources(&section, "path").unwrap_or_default(),
        height_sigma_m: not_negative(&section, "height_sigma_m", 0.02),
    };
    section.finish();
    config
}

fn view(section: Section<'_>) -> ViewConfig {
    let share = section.number_or_word(
        "aim",
        &["center", "bottom"],
        0.0..=1.0,
        "a share from 0 to 1",
    );
    let aim = match share {
        Some(Ok(share)) => Aim::HeightShare(share),
        Some(Err(word)) if word == "bottom" => Aim::BOTTOM,
        _ => Aim::CENTER,
    };
    let config = ViewConfig {
        aim,
        min_range_m: not_negative(&section, "min_range_m", 0.0),
        max_range_m: section.number("max_range_m", f64::MIN_POSITIVE.., POSITIVE),
        fov_deg: section
            .number("fov_deg", f64::MIN_POSITIVE..=360.0, "above 0, to 360")
            .unwrap_or(360.0),
        min_score: section
            .number("min_score", 0.0..=1.0, "0 to 1")
            .unwrap_or(0.0),
        max_gap_s: positive(&section, "max_gap_s", 1.0),
    };
    if let Some(max) = config.max_range_m
        && max <= config.min_range_m
    {
        let expected = format!("more than min_range_m, {}", config.min_range_m);
        section.fault("max_range_m", max, expected);
    }
    section.finish();
    config
}

fn noise(section: Section<'_>) -> NoiseConfig {
    let pose = section.section("pose");
    let angle = |key, default: f64| not_negative(&pose, key, default).to_radians();
    let config = NoiseConfig {
        pixel_px: positive(&section, "pixel_px", 1.5),
        range_m: positive(&section, "range_m", 0.15),
        bearing_deg: positive(&section, "bearing_deg", 1.0),
        pose: PoseSigma {
            east_m: not_negative(&pose, "east_m", 0.05),
            north_m: not_negative(&pose, "north_m", 0.05),
            up_m: not_negative(&pose, "up_m", 0.02),
            roll: angle("roll_deg", 0.25),
            pitch: angle("pitch_deg", 0.25),
            yaw: angle("yaw_deg", 0.4),
        },
    };
    pose.finish();
    section.finish();
    config
}

fn fusion(section: Section<'_>) -> Option<FusionConfig> {
    let method = match section
        .word("method", &["em", "paper", "belief"])
        .as_deref()
    {
        Some("em") => Some(Method::Em),
        Some("belief") => {
            section.fault(
                "method",
                "\"belief\"",
                "em or paper: belief is not there yet",
            );
            None
        }
        _ => Some(Method::Paper),
    };
    let words = ["off", "per-view", "drift"];
    let config = method.map(|method| FusionConfig {
        method,
        width_m: positive(&section, "width_m", 0.2),
        min_weight: not_negative(&section, "min_weight", 1.5),
        pose_correction: section
            .word("pose_correction", &words)
            .unwrap_or_else(|| "per-view".to_owned()),
    });
    section.finish();
    config
}

fn output(section: Section<'_>, path: &Path, overrides: &Overrides) -> Option<OutputConfig> {
    let folder = path.parent().unwrap_or(Path::new(""));
    let stem = path.file_stem().unwrap_or_default();
    let written = section.text("dir").map(|dir| folder.join(dir));
    let dir = written.unwrap_or_else(|| folder.join("../outputs").join(stem));
    let formats = formats(&section);
    let config = OutputConfig {
        min_exist: section
            .number("min_exist", 0.0..=1.0, "0 to 1")
            .unwrap_or(0.05),
        dir: overrides.out.clone().unwrap_or(dir),
        formats: formats.clone().unwrap_or_default(),
        annotate: section.boolean("annotate").unwrap_or(true),
        detections: section.boolean("detections").unwrap_or(false),
        mosaic: section.boolean("mosaic").unwrap_or(false),
        mosaic_m_per_px: section.number("mosaic_m_per_px", f64::MIN_POSITIVE.., POSITIVE),
    };
    section.finish();
    formats.map(|_| config)
}
