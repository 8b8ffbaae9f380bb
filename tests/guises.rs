//! One site in many guises: whatever coordinates, norths, heights and bodies its files are in, the map
//! is the same to a millimetre.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use std::process::Command;

use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};
use rockmap::frame::{Crs, Enu, Geodetic, LocalEnu, Planet, Point, Rotation, Site, VerticalDatum};
use rockmap::pipeline::{self, Config, Overrides, Silent};
use rockmap::terrain::{Affine, HeightGrid, Posts, write_geotiff};
use serde_json::Value;
use tempfile::TempDir;

const CAMERA: &str = "[cameras.mast]\nmodel = \"pinhole\"\nwidth = 800\nheight = 600\nfx = 600.0\n\
    fy = 600.0\ncx = 399.5\ncy = 299.5\n[cameras.mast.mount]\ntranslation_m = [0.3, 0.1, 1.5]\n\
    quaternion = [0.5, -0.5, 0.5, -0.5]\n";

/// A site as it is: where its poses and rocks are, in no guise yet.
struct World {
    site: Site,
    poses: Vec<(Geodetic, [f64; 3])>,
    detections: String,
    terrain: HeightGrid,
}

/// Body axes (forward, left, up) into east, north, up, from aerospace angles in degrees.
fn attitude([roll, pitch, yaw]: [f64; 3]) -> Matrix3<f64> {
    let [roll, pitch, yaw] = [roll, pitch, yaw].map(f64::to_radians);
    let ned_from_frd = Rotation3::from_euler_angles(roll, pitch, yaw).into_inner();
    enu_from_ned() * ned_from_frd * Matrix3::from_diagonal(&Vector3::new(1.0, -1.0, -1.0))
}

fn enu_from_ned() -> Matrix3<f64> {
    Matrix3::new(0.0, 1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, -1.0)
}

fn hill_m(east: f64, north: f64) -> f64 {
    0.4 * (east / 9.0).sin() + 0.3 * (north / 7.0).cos()
}

impl World {
    /// A rover of six stops before a handful of rocks, on hills in a raster of the map `crs`.
    fn new(planet: Planet, origin: Geodetic, crs: &str) -> Self {
        let site = Site::new(planet, origin);
        let map = Crs::new(crs, planet).unwrap();
        let (x, y) = map.xy(origin.lon, origin.lat).unwrap();
        let affine = Affine::north_up((x - 40.0).round(), (y + 40.0).round(), 1.0);
        let heights = (0..81 * 81).map(|i: u32| {
            let (x, y) = affine.apply(f64::from(i % 81), f64::from(i / 81));
            let (lon, lat) = map.lon_lat(x, y).unwrap();
            let at = site.enu(Geodetic { lat, lon, ..origin });
            origin.height_m + hill_m(at.xyz.x, at.xyz.y)
        });
        let heights = Posts::F64(heights.collect());
        let terrain = HeightGrid::new(81, 81, heights, affine, crs).unwrap();
        let ground = rockmap::terrain::Terrain::from_grids(site, vec![terrain.clone()], None);
        let ground = ground.unwrap();
        let mut world = Self {
            site,
            poses: Vec::new(),
            detections: "image_id,det_id,class,score,u_px,v_px\n".to_owned(),
            terrain,
        };
        let rocks: Vec<Point<Enu>> = [
            (-4.0, 9.0),
            (-1.5, 7.0),
            (0.5, 10.5),
            (2.5, 8.0),
            (5.0, 9.5),
        ]
        .into_iter()
        .map(|(east, north)| ground.ground_at(east, north).unwrap().point)
        .collect();
        for stop in 0..6 {
            let share = f64::from(stop) - 2.5;
            let on_ground = ground.ground_at(2.0 * share, 0.3 * share).unwrap().point;
            let place = site.geodetic(Point::new(
                on_ground.xyz.x,
                on_ground.xyz.y,
                on_ground.xyz.z + 0.5,
            ));
            let angles = [1.5 - 0.4 * share, -12.0 + 0.7 * share, -9.0 * share];
            world.see(stop, place, angles, &rocks);
            world.poses.push((place, angles));
        }
        world
    }

    /// The pixels of the rocks in the picture of a stop.
    fn see(&mut self, stop: i32, place: Geodetic, angles: [f64; 3], rocks: &[Point<Enu>]) {
        let enu_from_body = self.site.enu_from_local(place).matrix() * attitude(angles);
        let camera = self.site.enu(place).xyz + enu_from_body * Vector3::new(0.3, 0.1, 1.5);
        for (number, rock) in rocks.iter().enumerate() {
            let body = enu_from_body.transpose() * (rock.xyz - camera);
            // Camera axes are right, down, forward.
            let (u, v) = (
                399.5 - 600.0 * body.y / body.x,
                299.5 - 600.0 * body.z / body.x,
            );
            if body.x > 0.0 && (0.0..799.0).contains(&u) && (0.0..599.0).contains(&v) {
                writeln!(self.detections, "i{stop},d{number},rock,0.9,{u:.9},{v:.9}").unwrap();
            }
        }
    }

    /// Runs the pipeline on the site in a guise; rocks by longitude and latitude in degrees and
    /// height, west to east, and the map's text.
    fn map(&self, guise: &Guise) -> (Vec<[f64; 3]>, Value) {
        let home = self.write(guise);
        if let Some(offset_s) = guise.clock_offset_s {
            self.by_time(home.path(), offset_s);
        }
        let overrides = Overrides {
            out: Some(home.path().join("out")),
            ..Overrides::default()
        };
        let config = Config::read(&home.path().join("run.toml"), &overrides).unwrap();
        let summary = pipeline::run(&config, false, &Silent).unwrap();
        assert!(summary.rejected().is_empty(), "{}", guise.name);
        rocks(home.path())
    }

    fn write(&self, guise: &Guise) -> TempDir {
        let home = tempfile::tempdir().unwrap();
        let file = |name: &str| home.path().join(name);
        let mut poses = format!("image_id,{}\n", guise.columns);
        for (stop, &(place, angles)) in self.poses.iter().enumerate() {
            writeln!(poses, "i{stop},{}", (guise.pose)(place, angles)).unwrap();
        }
        fs::write(file("poses.csv"), poses).unwrap();
        fs::write(file("cameras.toml"), CAMERA).unwrap();
        fs::write(file("detections.csv"), &self.detections).unwrap();
        let terrain = guise.terrain.as_ref().unwrap_or(&self.terrain);
        write_geotiff(&file("terrain.tif"), terrain, self.site.planet()).unwrap();
        let origin = self.site.origin();
        let (lat_deg, lon_deg) = guise.planet.lat_lon_deg(origin);
        let run = format!(
            "[site]\nbody = \"{}\"\norigin = {{ lat_deg = {lat_deg:?}, lon_deg = {lon_deg:?}, \
             height_m = {:?} }}\n{}\n[input]\nposes = \"poses.csv\"\ncameras = \"cameras.toml\"\n\
             detections = \"detections.csv\"\n{}\n[terrain]\npath = \"terrain.tif\"\n[output]\n\
             annotate = false\n",
            guise.planet.name, guise.origin_height_m, guise.site, guise.input
        );
        fs::write(file("run.toml"), run).unwrap();
        for (name, bytes) in &guise.files {
            fs::write(file(name), bytes).unwrap();
        }
        home
    }

    /// Turns poses of images into a log, whose clock is ahead of that of the images.
    fn by_time(&self, home: &Path, offset_s: f64) {
        let poses = fs::read_to_string(home.join("poses.csv")).unwrap();
        let mut log = poses.replacen("image_id", "time", 1);
        let mut images = "image_id,time,camera,path\n".to_owned();
        for stop in 0..self.poses.len() {
            let time_s = 1_128_870_000.5 + 10.0 * stop as f64;
            log = log.replace(&format!("\ni{stop},"), &format!("\n{time_s},"));
            writeln!(images, "i{stop},{},mast,", time_s - offset_s).unwrap();
        }
        fs::write(home.join("poses.csv"), log).unwrap();
        fs::write(home.join("images.csv"), images).unwrap();
    }

    /// A log of poses by a clock that is half a minute ahead.
    fn by_another_clock(&self) -> Guise {
        Guise {
            name: "clock".to_owned(),
            input: "images = \"images.csv\"\nclock_offset_s = 37.25".to_owned(),
            clock_offset_s: Some(37.25),
            ..self.plain(self.site.planet())
        }
    }

    /// Longitude and latitude as the planet's files have them, and true angles.
    fn plain(&self, planet: Planet) -> Guise {
        let pose = move |place: Geodetic, [roll, pitch, yaw]: [f64; 3]| {
            let (lat, lon) = planet.lat_lon_deg(place);
            let height = place.height_m;
            format!("{lat:.13},{lon:.13},{height:.6},{roll:.9},{pitch:.9},{yaw:.9}")
        };
        Guise {
            name: "geodetic".to_owned(),
            planet,
            columns: "lat_deg,lon_deg,alt_m,roll_deg,pitch_deg,yaw_deg",
            pose: Box::new(pose),
            site: String::new(),
            input: String::new(),
            terrain: None,
            origin_height_m: self.site.origin().height_m,
            files: Vec::new(),
            clock_offset_s: None,
        }
    }

    /// Eastings and northings of a map, and headings from its north.
    fn gridded(&self, definition: &str) -> Guise {
        let crs = Crs::new(definition, self.site.planet()).unwrap();
        let pose = move |place: Geodetic, [roll, pitch, yaw]: [f64; 3]| {
            let (x, y) = crs.xy(place.lon, place.lat).unwrap();
            let yaw = yaw - crs.convergence(place).unwrap().to_degrees();
            // Readers take headings within a turn.
            let yaw = (yaw + 180.0).rem_euclid(360.0) - 180.0;
            format!(
                "{x:.6},{y:.6},{:.6},{roll:.9},{pitch:.9},{yaw:.9}",
                place.height_m
            )
        };
        Guise {
            name: definition.to_owned(),
            columns: "easting_m,northing_m,height_m,roll_deg,pitch_deg,yaw_deg",
            pose: Box::new(pose),
            site: format!("crs = \"{definition}\"\nnorth = \"grid\""),
            ..self.plain(self.site.planet())
        }
    }

    /// Offsets from the origin with quaternions into its axes.
    fn offsets(&self) -> Guise {
        let site = self.site;
        let pose = move |place: Geodetic, angles: [f64; 3]| {
            let at = site.enu(place).xyz;
            let local = Rotation::<LocalEnu, rockmap::frame::Body>::from_matrix(attitude(angles));
            let [w, x, y, z] = (site.enu_from_local(place) * local).scalar_first();
            format!(
                "{:.7},{:.7},{:.7},{w:.12},{x:.12},{y:.12},{z:.12}",
                at.x, at.y, at.z
            )
        };
        Guise {
            name: "offsets east, north, up".to_owned(),
            columns: "x_m,y_m,z_m,qw,qx,qy,qz",
            pose: Box::new(pose),
            ..self.plain(self.site.planet())
        }
    }

    /// A log of north, east, down and of forward-right-down attitudes in the origin's axes.
    fn north_east_down(&self) -> Guise {
        let site = self.site;
        let pose = move |place: Geodetic, angles: [f64; 3]| {
            let ned = enu_from_ned() * site.enu(place).xyz;
            let enu_from_body = site.enu_from_local(place).matrix() * attitude(angles);
            let flip = Matrix3::from_diagonal(&Vector3::new(1.0, -1.0, -1.0));
            let ned_from_frd = enu_from_ned() * enu_from_body * flip;
            let (roll, pitch, yaw) = UnitQuaternion::from_rotation_matrix(
                &Rotation3::from_matrix_unchecked(ned_from_frd),
            )
            .euler_angles();
            let [roll, pitch, yaw] = [roll, pitch, yaw].map(f64::to_degrees);
            format!(
                "{:.7},{:.7},{:.7},{roll:.9},{pitch:.9},{yaw:.9}",
                ned.y, ned.x, -ned.z
            )
        };
        Guise {
            name: "north, east, down".to_owned(),
            columns: "x_m,y_m,z_m,roll_deg,pitch_deg,yaw_deg",
            pose: Box::new(pose),
            ..self.plain(self.site.planet())
        }
    }

    /// A compass with a declination, on a mount that is turned.
    fn magnetic(&self) -> Guise {
        let plain = self.plain(self.site.planet());
        let of_true = plain.pose;
        let pose = move |place: Geodetic, [roll, pitch, yaw]: [f64; 3]| {
            of_true(place, [roll, pitch, yaw - 3.75 + 1.25])
        };
        Guise {
            name: "magnetic".to_owned(),
            pose: Box::new(pose),
            site: "north = \"magnetic\"\ndeclination_deg = 3.75".to_owned(),
            input: "heading_bias_deg = -1.25".to_owned(),
            ..self.plain(self.site.planet())
        }
    }

    /// All heights above a geoid that slopes away under the site.
    fn above_geoid(&self) -> Guise {
        let origin = self.site.origin();
        let bytes = gtx(origin);
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("geoid.gtx"), &bytes).unwrap();
        let datum = VerticalDatum::from_grid(&folder.path().join("geoid.gtx"), "geoid.gtx", origin)
            .unwrap();
        let own = Crs::new(self.terrain.crs(), self.site.planet()).unwrap();
        let heights = (0..81 * 81).map(|i: u32| {
            let (c, r) = (i % 81, i / 81);
            let (x, y) = self
                .terrain
                .crs_from_post()
                .apply(f64::from(c), f64::from(r));
            let (lon, lat) = own.lon_lat(x, y).unwrap();
            let height_m = self.terrain.height_m(c as usize, r as usize);
            datum.height_m(Geodetic { lat, lon, height_m }).unwrap()
        });
        let affine = self.terrain.crs_from_post();
        let heights = Posts::F64(heights.collect());
        let terrain = HeightGrid::new(81, 81, heights, affine, self.terrain.crs()).unwrap();
        let origin_height_m = datum.height_m(origin).unwrap();
        let _keep = folder;
        let plain = self.plain(self.site.planet());
        let of_ellipsoid = plain.pose;
        let pose = move |place: Geodetic, angles: [f64; 3]| {
            let height_m = datum.height_m(place).unwrap();
            of_ellipsoid(Geodetic { height_m, ..place }, angles)
        };
        Guise {
            name: "geoid".to_owned(),
            pose: Box::new(pose),
            site: "height = \"geoid.gtx\"".to_owned(),
            terrain: Some(terrain),
            origin_height_m,
            files: vec![("geoid.gtx".to_owned(), bytes)],
            ..self.plain(self.site.planet())
        }
    }

    /// Every guise gives the map of the first to a millimetre.
    fn is_the_same_in(&self, guises: &[Guise]) -> Value {
        let (expected, layer) = self.map(&self.plain(self.site.planet()));
        assert_eq!(expected.len(), 5);
        for guise in guises {
            let (found, _) = self.map(guise);
            assert_eq!(found.len(), expected.len(), "{}", guise.name);
            for (a, b) in expected.iter().zip(&found) {
                let at = |planet: Planet, p: &[f64; 3]| {
                    self.site.enu(planet.eastward().place(p[1], p[0], 0.0))
                };
                let apart = at(self.site.planet(), a).distance(at(guise.planet, b));
                assert!(apart < 1e-3, "{}: {apart} m", guise.name);
                let lifted = guise.origin_height_m - self.site.origin().height_m;
                // The geoid slopes by 5 cm a kilometre.
                let slack = if lifted == 0.0 { 1e-3 } else { 2e-3 };
                assert!(
                    (b[2] - a[2] - lifted).abs() < slack,
                    "{}: {a:?} {b:?}",
                    guise.name
                );
            }
        }
        layer
    }
}

/// How the files of a site are written.
struct Guise {
    name: String,
    planet: Planet,
    columns: &'static str,
    pose: Box<dyn Fn(Geodetic, [f64; 3]) -> String>,
    site: String,
    input: String,
    terrain: Option<HeightGrid>,
    origin_height_m: f64,
    files: Vec<(String, Vec<u8>)>,
    clock_offset_s: Option<f64>,
}

/// A GTX grid around a place (PROJ: `vgridshift`): 40 m, and half a metre more a degree northwards.
fn gtx(around: Geodetic) -> Vec<u8> {
    let (south, west) = (
        (around.lat_deg() - 2.0).round(),
        (around.lon_deg() - 2.0).round(),
    );
    let mut bytes: Vec<u8> = [south, west, 1.0, 1.0]
        .into_iter()
        .flat_map(f64::to_be_bytes)
        .collect();
    bytes.extend([5i32, 5].into_iter().flat_map(i32::to_be_bytes));
    for row in 0u8..5 {
        bytes.extend(
            [40.0 + 0.5 * f32::from(row); 5]
                .into_iter()
                .flat_map(f32::to_be_bytes),
        );
    }
    bytes
}

/// The same undulations around 49 degrees north, 8.4 degrees east, from the north on.
fn geotiff_geoid() -> HeightGrid {
    let posts = (0u8..5).flat_map(|row| [42.0 - 0.5 * f32::from(row); 5]);
    let map = Affine::north_up(6.0, 51.0, 1.0);
    HeightGrid::new(5, 5, Posts::F32(posts.collect()), map, "EPSG:4326").unwrap()
}

fn rocks(home: &Path) -> (Vec<[f64; 3]>, Value) {
    let text = fs::read_to_string(home.join("out/rocks.geojson")).unwrap();
    let layer: Value = serde_json::from_str(&text).unwrap();
    let mut rocks: Vec<[f64; 3]> = layer["features"]
        .as_array()
        .unwrap()
        .iter()
        .map(|rock| {
            let at = &rock["geometry"]["coordinates"];
            let height = &rock["properties"]["height_m"];
            [&at[0], &at[1], height].map(|v| v.as_f64().unwrap())
        })
        .collect();
    rocks.sort_by(|a, b| a[0].total_cmp(&b[0]));
    (rocks, layer)
}

#[test]
fn a_site_on_earth() {
    // Between the meridians of zones 31 and 32, with a convergence of several degrees in both.
    let world = World::new(
        Planet::EARTH,
        Geodetic::from_degrees(49.0, 6.1, 312.0),
        "EPSG:32632",
    );
    let layer = world.is_the_same_in(&[
        world.gridded("EPSG:32632"),
        world.gridded("EPSG:32631"),
        world.gridded("EPSG:3035"),
        world.gridded("EPSG:2154"),
        world.offsets(),
        world.north_east_down(),
        world.magnetic(),
        world.by_another_clock(),
        world.above_geoid(),
    ]);
    assert!(layer.get("crs").is_none());
}

#[test]
fn a_site_on_mars() {
    let world = World::new(
        Planet::MARS,
        Geodetic::from_degrees(18.44, 77.45, -2_560.0),
        "IAU_2015:49910",
    );
    let layer = world.is_the_same_in(&[
        world.gridded("IAU_2015:49910"),
        world.gridded("+proj=tmerc +lon_0=75 +R=3396190 +no_defs +type=crs"),
        world.offsets(),
        world.north_east_down(),
        world.magnetic(),
        world.above_geoid(),
    ]);
    let urn = &layer["crs"]["properties"]["name"];
    assert_eq!(urn, "urn:ogc:def:crs:IAU:2015:49900");
}

#[test]
fn a_site_near_the_pole_of_the_moon() {
    let world = World::new(
        Planet::MOON,
        Geodetic::from_degrees(-85.4, 31.7, 1_200.0),
        "IAU_2015:30135",
    );
    let layer = world.is_the_same_in(&[
        world.gridded("IAU_2015:30135"),
        world.gridded("+proj=tmerc +lon_0=25 +R=1737400 +no_defs +type=crs"),
        world.offsets(),
        world.north_east_down(),
        world.above_geoid(),
    ]);
    let urn = &layer["crs"]["properties"]["name"];
    assert_eq!(urn, "urn:ogc:def:crs:IAU:2015:30100");
}

/// Planetographic latitudes with westward longitudes, and planetocentric ones, of one ellipsoid.
#[test]
fn a_site_on_the_ellipsoid_of_mars() {
    let ographic = Planet::named("IAU_2015:49901").unwrap();
    let ocentric = Planet::named("IAU_2015:49902").unwrap();
    let world = World::new(
        ographic,
        Geodetic::from_degrees(-41.0, 77.45, 800.0),
        "IAU_2015:49910",
    );
    let layer = world.is_the_same_in(&[world.plain(ocentric), world.offsets()]);
    let urn = &layer["crs"]["properties"]["name"];
    assert_eq!(urn, "urn:ogc:def:crs:IAU:2015:49901");
}

/// The geodesy table made with pyproj: the first place's map coordinates, planet-centred coordinates,
/// and the second place in the first's east, north, up.
#[test]
fn the_geodesy_table_to_a_millimetre() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let data = std::env::var("ROCKMAP_DATA").unwrap_or_else(|_| "../shared/data".to_owned());
    let table = root.join(data).join("../vectors/geodesy_vectors.csv");
    let Ok(text) = fs::read_to_string(&table) else {
        println!("skipped: there is no {}", table.display());
        return;
    };
    let mut rows = 0;
    for line in text.lines().skip(1) {
        let v: Vec<f64> = line.split(',').map(|w| w.parse().unwrap()).collect();
        let place = Geodetic::from_degrees(v[0], v[1], v[2]);
        let ecef = Planet::EARTH.ellipsoid.to_ecef(place).xyz;
        assert!(
            (ecef - Vector3::new(v[3], v[4], v[5])).norm() < 1e-3,
            "{line}"
        );
        let utm = Crs::new(&format!("EPSG:{}", v[6]), Planet::EARTH).unwrap();
        let (x, y) = utm.xy(place.lon, place.lat).unwrap();
        assert!((x - v[7]).hypot(y - v[8]) < 1e-3, "{line}");
        let second = Geodetic::from_degrees(v[9], v[10], v[2] + 3.2);
        let enu = Site::new(Planet::EARTH, place).enu(second).xyz;
        assert!(
            (enu - Vector3::new(v[13], v[14], v[15])).norm() < 1e-3,
            "{line}"
        );
        rows += 1;
    }
    assert!(rows >= 9);
}

/// Real codes find their grids through `PROJ_DATA`, and say so where they do not.
#[test]
fn a_geoid_by_its_code() {
    let origin = Geodetic::from_degrees(49.0, 8.4, 115.0);
    let world = World::new(Planet::EARTH, origin, "EPSG:32632");
    let mut guise = world.plain(Planet::EARTH);
    guise.site = "height = \"EPSG:5773\"".to_owned();
    let home = world.write(&guise);
    let run = |grids: &Path| {
        Command::new(env!("CARGO_BIN_EXE_rockmap"))
            .args(["run", "run.toml", "--out", "out", "--force"])
            .current_dir(home.path())
            .env("PROJ_DATA", grids)
            .env("PROJ_SKIP_READ_USER_WRITABLE_DIRECTORY", "YES")
            .output()
            .unwrap()
    };
    let empty = tempfile::tempdir().unwrap();
    let output = run(empty.path());
    let error = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2), "{error}");
    let expected =
        "site.height: found \"EPSG:5773\" without its grid, expected one of us_nga_egm96_15.tif";
    assert!(
        error.contains(expected) && error.contains("PROJ_DATA"),
        "{error}"
    );
    assert!(
        error.contains(&empty.path().display().to_string()),
        "{error}"
    );
    for name in ["egm96_15.gtx", "us_nga_egm96_15.tif"] {
        let grids = tempfile::tempdir().unwrap();
        let path = grids.path().join(name);
        if name.ends_with("gtx") {
            fs::write(path, gtx(origin)).unwrap();
        } else {
            write_geotiff(&path, &geotiff_geoid(), Planet::EARTH).unwrap();
        }
        let output = run(grids.path());
        let said = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(0), "{said}");
        let manifest = fs::read_to_string(home.path().join("out/run.json")).unwrap();
        let manifest: Value = serde_json::from_str(&manifest).unwrap();
        assert_eq!(manifest["site"]["heights"], "EPSG:5773");
        // 41 m at 49 degrees: the origin's ellipsoidal height.
        let height = manifest["site"]["origin"]["height_m"].as_f64().unwrap();
        assert!((height - 115.0 - 41.0).abs() < 1e-3, "{height}");
        let inputs = manifest["inputs"].as_array().unwrap();
        assert!(
            inputs.iter().any(|file| file["kind"] == "geoid"),
            "{inputs:?}"
        );
        // Heights of the map are above the geoid again.
        let (found, _) = rocks(home.path());
        assert!(
            found.iter().all(|rock| (114.0..116.0).contains(&rock[2])),
            "{found:?}"
        );
    }
}
