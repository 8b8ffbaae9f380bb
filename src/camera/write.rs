//! Writes cameras.toml.

use std::path::Path;

use toml_edit::{Array, DocumentMut, InlineTable, Item, Table, Value, value};

use super::{Cahv, Camera, Cameras, Intrinsics, Lens, Linearity, Mount, Readout, Reduction};
use crate::error::Error;

/// Writes cameras as a cameras.toml, which [`super::read_camera_file`] reads back as the same cameras.
///
/// # Errors
/// A file that cannot be written.
pub fn write_cameras(path: &Path, cameras: &Cameras) -> Result<(), Error> {
    std::fs::write(path, cameras_to_toml(cameras)).map_err(|e| Error::io(path, "write", e))
}

/// The text of a cameras.toml. A CAHV camera that stands on another mount than its vectors give is
/// written with vectors turned to that mount.
pub fn cameras_to_toml(cameras: &Cameras) -> String {
    let mut all = Table::new();
    all.set_implicit(true);
    for (name, camera) in cameras {
        all.insert(name, Item::Table(table(camera)));
    }
    let mut document = DocumentMut::new();
    document.insert("cameras", Item::Table(all));
    document.to_string()
}

fn table(camera: &Camera) -> Table {
    let mut table = Table::new();
    table.insert("model", value(camera.lens.model()));
    let whole = || Readout::whole(camera.width, camera.height);
    readout(&mut table, &camera.readout.unwrap_or_else(whole));
    match &camera.lens {
        Lens::Pinhole(lens) => intrinsics(&mut table, lens.intrinsics()),
        Lens::BrownConrady(lens) => {
            intrinsics(&mut table, lens.intrinsics());
            numbers(&mut table, "distortion", lens.distortion());
        }
        Lens::Fisheye(lens) => {
            intrinsics(&mut table, lens.intrinsics());
            numbers(&mut table, "distortion", &lens.distortion());
        }
        Lens::Equirectangular(_) => {}
        Lens::Cahv(lens) => vectors(&mut table, lens, &camera.mount),
        Lens::Cahvor(lens) => {
            vectors(&mut table, lens.linear(), &camera.mount);
            numbers(&mut table, "O", &lens.optical_axis_on(&camera.mount));
            numbers(&mut table, "R", &lens.distortion());
        }
        Lens::Cahvore(lens) => {
            vectors(&mut table, lens.linear(), &camera.mount);
            numbers(&mut table, "O", &lens.optical_axis_on(&camera.mount));
            numbers(&mut table, "R", &lens.distortion());
            numbers(&mut table, "E", &lens.pupil());
            linearity(&mut table, lens.linearity());
        }
    }
    let by_vectors = matches!(
        camera.lens,
        Lens::Cahv(_) | Lens::Cahvor(_) | Lens::Cahvore(_)
    );
    mount(&mut table, &camera.mount, by_vectors);
    table
}

/// The size of the sensor, and what of it the pictures show.
fn readout(table: &mut Table, readout: &Readout) {
    let [width, height] = readout.sensor();
    table.insert("width", value(i64::from(width)));
    table.insert("height", value(i64::from(height)));
    let part = readout.subframe();
    if [part.width, part.height] != [width, height] {
        let mut subframe = InlineTable::new();
        for (key, number) in [
            ("first_u_px", part.first_u_px),
            ("first_v_px", part.first_v_px),
            ("width", part.width),
            ("height", part.height),
        ] {
            subframe.insert(key, i64::from(number).into());
        }
        table.insert("subframe", value(subframe));
    }
    let (key, [columns, rows]) = match readout.reduction() {
        Reduction::Full => return,
        Reduction::Binning(by) => ("binning", by),
        Reduction::Downsampling(by) => ("downsampling", by),
    };
    let factors = if columns == rows {
        Value::from(i64::from(columns))
    } else {
        Value::from_iter([i64::from(columns), i64::from(rows)])
    };
    table.insert(key, value(factors));
}

fn intrinsics(table: &mut Table, Intrinsics { fx, fy, cx, cy }: Intrinsics) {
    for (key, number) in [("fx", fx), ("fy", fy), ("cx", cx), ("cy", cy)] {
        table.insert(key, value(number));
    }
}

fn vectors(table: &mut Table, lens: &Cahv, mount: &Mount) {
    let vectors = lens.vectors_on(mount);
    table.insert("axes", value(vectors.axes.as_str()));
    numbers(table, "C", &vectors.centre);
    numbers(table, "A", &vectors.axis);
    numbers(table, "H", &vectors.horizontal);
    numbers(table, "V", &vectors.vertical);
}

fn linearity(table: &mut Table, linearity: Linearity) {
    let mtype = match linearity {
        Linearity::Perspective => 1,
        Linearity::Fisheye => 2,
        Linearity::General(_) => 3,
    };
    table.insert("mtype", value(mtype));
    if let Linearity::General(l) = linearity {
        table.insert("linearity", value(l));
    }
}

fn mount(camera: &mut Table, mount: &Mount, by_vectors: bool) {
    let mut table = Table::new();
    if !by_vectors {
        let translation: [f64; 3] = mount.translation().xyz.into();
        numbers(&mut table, "translation_m", &translation);
        numbers(&mut table, "quaternion", &mount.quaternion());
    }
    if let Some(pivot) = mount.pivot() {
        let pivot: [f64; 3] = pivot.xyz.into();
        numbers(&mut table, "pivot_m", &pivot);
    }
    if !table.is_empty() {
        camera.insert("mount", Item::Table(table));
    }
}

fn numbers(table: &mut Table, key: &str, numbers: &[f64]) {
    let list: Array = numbers.iter().copied().map(Value::from).collect();
    table.insert(key, value(list));
}
