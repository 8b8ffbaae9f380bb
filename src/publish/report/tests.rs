use geo::{Rect, coord};
use nalgebra::{Matrix3, Matrix3x6, Vector3};
use serde_json::{Value, json};

use super::*;
use crate::camera::PanTilt;
use crate::detection::{Aim, Detection, Mark, MarkSigma};
use crate::footprint::{Footprint, Footprints};
use crate::frame::{Geodetic, Planet, Point, RigidTransform, Rotation, Site, Vector};
use crate::fuse::{Fusion, Member, Object};
use crate::input::Reason;
use crate::pose::{Pose, PoseSigma};
use crate::project::{Hit, Placed};
use crate::view::View;

/// A field of rocks in rows, each seen by the views whose square footprint holds it.
struct Field {
    site: Site,
    views: Vec<View>,
    placed: Vec<Placed>,
    footprints: Footprints,
    classes: Vec<Option<String>>,
    fusion: Fusion,
}

fn at(i: u32, columns: u32) -> (f64, f64) {
    (f64::from(i % columns), f64::from(i / columns))
}

fn view(site: &Site, index: u32, columns: u32) -> View {
    let (column, row) = at(index, columns);
    let to = Vector::new(10.0 * column + 5.0, 10.0 * row + 5.0, 0.0);
    let sigma = PoseSigma {
        east_m: 0.1,
        north_m: 0.1,
        up_m: 0.1,
        roll: 0.0,
        pitch: 0.0,
        yaw: 0.0,
    };
    View {
        image_id: format!("view <{index}>"),
        listed: ("poses.csv".to_owned(), u64::from(index) + 2),
        time: None,
        platform: None,
        picture: None,
        camera: None,
        head: PanTilt::default(),
        pose: Pose {
            enu_from_body: RigidTransform::new(Rotation::identity(), to),
            sigma,
            has_heading: true,
        },
        enu_from_local: site.enu_from_local(site.origin()),
    }
}

fn placed(view: usize, name: u32, east: f64, north: f64) -> Placed {
    let detection = Detection {
        image_id: format!("view <{view}>"),
        det_id: name.to_string(),
        class: None,
        score: Some(0.5),
        diameter_m: None,
        mark: Mark::Bearing(0.0),
        range_m: Some(1.0),
        sigma: MarkSigma::default(),
        file: 0,
        line: u64::from(name) + 2,
    };
    Placed {
        view,
        detection,
        hit: Hit {
            point: Point::new(east, north, 0.0),
            slant_range_m: 1.0,
            ground_range_m: 1.0,
            mark_covariance: Matrix3::identity() * 1e-4,
            by_pose: Matrix3x6::zeros(),
            by_ground_height: Vector3::zeros(),
        },
        covariance: Matrix3::identity() * 1e-4,
        diameter_m: Some(0.1 + 0.001 * f64::from(name % 700)),
    }
}

impl Field {
    /// So many rocks, ten a row and metre, each detected `looks` times by the one view above it.
    fn of(rocks: u32, looks: u32) -> Self {
        let site = Site::new(
            Planet::EARTH,
            Geodetic::from_degrees(-24.45, -69.93, 1000.0),
        );
        let columns = rocks.saturating_sub(1).isqrt() + 1;
        let view_columns = columns.div_ceil(10);
        let view_rows = rocks.div_ceil(columns).div_ceil(10);
        let views = (0..view_columns * view_rows).map(|i| view(&site, i, view_columns));
        let views: Vec<View> = views.collect();
        let squares = views.iter().map(|v| {
            let middle = v.pose.enu_from_body.origin().xyz;
            let corner = |d: f64| coord! { x: middle.x + d, y: middle.y + d };
            Footprint::new(Rect::new(corner(-5.0), corner(5.0)).to_polygon().into())
        });
        let footprints = Footprints::new(squares.collect());
        let (mut all, mut objects) = (Vec::new(), Vec::new());
        for i in 0..rocks {
            let (column, row) = at(i, columns);
            let (east, north) = (column + 0.5, row + 0.4);
            let above = (i % columns / 10 + i / columns / 10 * view_columns) as usize;
            let mut members = Vec::new();
            for look in 0..looks {
                members.push(Member {
                    observation: all.len(),
                    weight: 1.0,
                });
                let off = 0.01 * f64::from(look);
                all.push(placed(above, i * looks + look, east + off, north));
            }
            objects.push(Object {
                place: Point::new(east, north, 0.0),
                covariance: Matrix3::new(4e-4, 1e-4, 0.0, 1e-4, 9e-4, 0.0, 0.0, 0.0, 1e-4),
                class: 0,
                weight: f64::from(looks),
                size_m: None,
                p_class: None,
                p_exist: (i % 2 == 0).then_some(0.75),
                members,
            });
        }
        let fusion = Fusion {
            objects,
            solver: Vec::new(),
            belief: None,
        };
        Self {
            site,
            views,
            placed: all,
            footprints,
            classes: vec![None],
            fusion,
        }
    }

    fn page(&self) -> String {
        let scene = Scene {
            site: &self.site,
            terrain: None,
            views: &self.views,
            measured: None,
            datum: None,
            detections: &[],
            placed: &self.placed,
            footprints: &self.footprints,
            classes: &self.classes,
            aim: Aim::CENTER,
        };
        let rocks = scene.rock_map(&self.fusion);
        let rejects = [Reject {
            file: "detections.csv".into(),
            line: Some(7),
            record: "v/</script>".to_owned(),
            reason: Reason::TooFar,
            detail: "far".to_owned(),
        }];
        let plan = CropPlan::new(&scene, &rocks);
        let run = Run {
            title: "a <b> & \"c\"",
            manifest: &manifest(rocks.len(), self),
            rejects: &rejects,
            pictures: &vec![None; self.views.len()],
            plan: &plan,
            crops: &[],
        };
        let product = scene.report(&rocks, &run);
        assert_eq!(product.name, "report.html");
        String::from_utf8(product.content).unwrap()
    }
}

fn manifest(objects: usize, field: &Field) -> Value {
    json!({
        "run_id": "0123456789abcdef",
        "version": "0",
        "site": { "body": "earth" },
        "config": { "fusion": { "method": "paper" } },
        "inputs": [],
        "counts": {
            "views": field.views.len(),
            "detections_placed": field.placed.len(),
            "objects": objects,
        },
        "warnings": [],
        "solver": [],
    })
}

/// The JSON in a page.
fn data(page: &str) -> Value {
    let (_, rest) = page
        .split_once("<script type=\"application/json\" id=\"data\">")
        .unwrap();
    serde_json::from_str(rest.split_once("</script>").unwrap().0).unwrap()
}

/// A packed column of numbers of four bytes.
fn words(column: &Value) -> Vec<[u8; 4]> {
    let text = column.as_str().unwrap().split_once(':').unwrap().1;
    let value = |c: u8| match c {
        b'A'..=b'Z' => c - b'A',
        b'a'..=b'z' => c - b'a' + 26,
        b'0'..=b'9' => c - b'0' + 52,
        b'+' => 62,
        _ => 63,
    };
    let bits: Vec<u8> = text.bytes().filter(|c| *c != b'=').map(value).collect();
    let bytes = bits.chunks(4).flat_map(|four| {
        let word = four.iter().fold(0_u32, |w, &v| (w << 6) | u32::from(v));
        let word = word << (6 * (4 - four.len()));
        word.to_be_bytes()[1..four.len()].to_vec()
    });
    let bytes: Vec<u8> = bytes.collect();
    bytes
        .chunks_exact(4)
        .map(|c| [c[0], c[1], c[2], c[3]])
        .collect()
}

fn floats(column: &Value) -> Vec<f32> {
    words(column).into_iter().map(f32::from_le_bytes).collect()
}

fn indices(column: &Value) -> Vec<u32> {
    words(column).into_iter().map(u32::from_le_bytes).collect()
}

#[test]
fn the_page_holds_what_the_map_does() {
    let field = Field::of(120, 2);
    let page = data(&field.page());
    let rocks = &page["rocks"];
    assert_eq!(rocks["id"].as_array().unwrap().len(), 120);
    let (east, diameter) = (floats(&rocks["east_m"]), floats(&rocks["diameter_m"]));
    assert_eq!((east[0], east[3]), (0.5, 3.5));
    // The mean of its two detections'.
    assert!((diameter[3] - 0.1065).abs() < 1e-6, "{}", diameter[3]);
    let existence = floats(&rocks["p_exist"]);
    assert!(existence[0] == 0.75 && existence[1].is_nan());
    assert_eq!(
        floats(&rocks["covariance_m2"])[..6],
        [4e-4, 1e-4, 0.0, 9e-4, 0.0, 1e-4]
    );
    assert_eq!(indices(&rocks["members"])[..3], [0, 2, 4]);
    assert_eq!(indices(&rocks["member"])[2..4], [2, 3]);
    assert!((floats(&rocks["residual_m"])[3] - 0.01).abs() < 1e-6);
    // No camera, so no residual in a picture; two views of ten by ten metres, 11 rocks a row.
    assert!(floats(&rocks["residual_px"]).iter().all(|r| r.is_nan()));
    let detections = &page["detections"];
    assert_eq!(indices(&detections["view"])[2 * 10..2 * 12], [1, 1, 0, 0]);
    assert_eq!(page["views"]["id"][1], "view <1>");
    assert!(floats(&page["views"]["shift_m"]).iter().all(|x| x.is_nan()));
    assert_eq!(indices(&page["views"]["rings"])[..3], [0, 5, 10]);
    assert_eq!(page["rejects"]["by_reason"], json!({ "too_far": 1 }));
    assert_eq!(page["charts"]["existence"]["counts"][15], 60);
    assert_eq!(page["charts"]["sizes"]["n_rocks"], 120);
    assert_eq!(page["charts"]["residual_px"], Value::Null);
}

#[test]
fn the_page_is_sound_html_and_the_same_every_time() {
    let field = Field::of(40, 1);
    let page = field.page();
    assert_eq!(page, field.page());
    assert!(page.starts_with("<!doctype html>") && page.ends_with("</html>\n"));
    assert!(page.contains("<h1>a &lt;b&gt; &amp; &quot;c&quot;</h1>"));
    assert!(!page.contains("{{"), "a place was not filled");
    // Nothing in the data ends the script they stand in, and nothing is fetched.
    assert_eq!(page.matches("</script>").count(), 2);
    for outside in ["src=", "<link", "@import", "url(", "fetch(", "http:"] {
        let inside = page.replace("http://www.w3.org/2000/svg", "");
        assert!(!inside.contains(outside), "{outside}");
    }
    elements_close(&page, 15);
    elements_close(&changes_page("a", &json!({})), 2);
}

/// Every element that is opened is closed, in order.
fn elements_close(page: &str, ids_expected: usize) {
    let (head, rest) = page.split_once("<script type").unwrap();
    let foot = rest.rsplit_once("</script>").unwrap().1;
    let (before, after) = head.split_once("<style>").unwrap();
    let after = after.split_once("</style>").unwrap().1;
    let mut open: Vec<String> = Vec::new();
    let mut ids: Vec<String> = Vec::new();
    for tag in [before, after, foot].concat().split('<').skip(1) {
        let tag = tag.split_once('>').unwrap().0;
        let name = tag.split_whitespace().next().unwrap();
        if let Some(id) = tag.split_once(" id=\"") {
            ids.push(id.1.split('"').next().unwrap().to_owned());
        }
        match name.strip_prefix('/') {
            Some(name) => assert_eq!(open.pop().as_deref(), Some(name)),
            None if ["!doctype", "meta", "input", "br"].contains(&name) => {}
            None => open.push(name.to_owned()),
        }
    }
    assert!(open.is_empty(), "{open:?}");
    let count = ids.len();
    ids.sort();
    ids.dedup();
    assert!(count > ids_expected && ids.len() == count, "{ids:?}");
}

/// Every element that the scripts ask for by name is there.
#[test]
fn scripts_ask_for_what_is_there() {
    for (kind, least) in [(REPORT, 20), (COMPARISON, 3)] {
        let page = kind.page("", "");
        let mut asked = 0;
        for script in kind.scripts {
            let by_id = script.split("byId(\"").skip(1);
            for part in by_id.chain(script.split("  fill(\"").skip(1)) {
                let id = part.split('"').next().unwrap();
                assert!(page.contains(&format!("id=\"{id}\"")), "{id}");
                asked += 1;
            }
        }
        assert!(asked >= least, "{}: {asked}", kind.name);
    }
}

#[test]
fn a_map_of_nothing_has_a_page() {
    let page = data(&Field::of(0, 0).page());
    assert_eq!(page["rocks"]["id"], json!([]));
    assert_eq!(page["coverage"], Value::Null);
    assert_eq!(page["charts"]["sizes"], Value::Null);
}

/// With `ROCKMAP_REPORT_OF_MANY` set to a path the page is left there, for a browser to open.
#[test]
fn fifty_thousand_rocks_are_a_page_of_some_megabytes() {
    let page = Field::of(50_000, 3).page();
    assert!(page.len() < 16_000_000, "{} bytes", page.len());
    if let Some(path) = std::env::var_os("ROCKMAP_REPORT_OF_MANY") {
        std::fs::write(path, page).unwrap();
    }
}
