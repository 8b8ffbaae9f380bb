//! Reads what of a sensor the pictures show: `subframe`, `binning`, `downsampling` of cameras.toml.

use super::read::{required, side};
use super::{BadReadout, Readout, Subframe};
use crate::input::Section;

/// What of the sensor, whose size is given, the pictures show.
pub(super) fn readout(
    section: &Section,
    width: Option<u32>,
    height: Option<u32>,
) -> Option<Readout> {
    let subframe = subframe(section.section("subframe"));
    let binning = factors(section, "binning");
    let downsampling = factors(section, "downsampling");
    if section.has("binning") && section.has("downsampling") {
        section.problem("downsampling", BadReadout::Both.to_string());
        return None;
    }
    let made = |key, readout: Result<Readout, BadReadout>| {
        readout
            .map_err(|bad| section.problem(key, bad.to_string()))
            .ok()
    };
    let mut readout = Readout::whole(width?, height?);
    if section.has("subframe") {
        readout = made("subframe", readout.cut(subframe?))?;
    }
    if section.has("binning") {
        readout = made("binning", readout.binned(binning?))?;
    }
    if section.has("downsampling") {
        readout = made("downsampling", readout.downsampled(downsampling?))?;
    }
    Some(readout)
}

/// `{ first_u_px = .., first_v_px = .., width = .., height = .. }`.
fn subframe(section: Section) -> Option<Subframe> {
    if !section.is_present() {
        return None;
    }
    let first = |key, expected| {
        let first = required(&section, key, expected, |s, key| {
            s.integer(key, 0..=1_000_000)
        });
        first.and_then(|first| u32::try_from(first).ok())
    };
    let first_u_px = first("first_u_px", "the first column, from 0");
    let first_v_px = first("first_v_px", "the first row, from 0");
    let (width, height) = (side(&section, "width"), side(&section, "height"));
    section.finish();
    Some(Subframe {
        first_u_px: first_u_px?,
        first_v_px: first_v_px?,
        width: width?,
        height: height?,
    })
}

fn factors(section: &Section, key: &str) -> Option<[u32; 2]> {
    let [columns, rows] = section.integer_pair(key, 1..=1_000_000)?;
    Some([u32::try_from(columns).ok()?, u32::try_from(rows).ok()?])
}

#[cfg(test)]
mod tests {
    use crate::camera::cameras_from_toml;

    const SIZE: &str = "width = 640\nheight = 480\n";

    #[test]
    fn readouts_fit_their_sensor() {
        let lens = "fx = 100\nfy = 100\ncx = 300\ncy = 200\n";
        let with = |text: &str| {
            let text = format!("[cameras.c]\nmodel = \"pinhole\"\n{SIZE}{lens}{text}");
            cameras_from_toml(&text, "cameras.toml").map(|cameras| cameras["c"].clone())
        };
        let subframe = "subframe = { first_u_px = 40, first_v_px = 0, width = 601, height = 480 }";
        let camera = with(&format!(
            "{}\nbinning = [3, 2]",
            subframe.replace("601", "600")
        ));
        let camera = camera.unwrap();
        assert_eq!([camera.width, camera.height], [200, 240]);
        let whole = with("binning = 1").unwrap();
        assert_eq!((whole.readout, whole.width), (None, 640));
        let fault = |text: &str| with(text).unwrap_err().to_string();
        assert_eq!(
            fault(subframe),
            "cameras.toml:9:1: cameras.c.subframe: found a subframe of 601x480 from column 40 and row 0, expected a part of the 640x480 there are"
        );
        assert_eq!(
            fault("subframe = { first_u_px = -1, width = 10, heigth = 10 }"),
            "cameras.toml:9:1: cameras.c.subframe.first_v_px: found nothing, expected the first row, from 0\n\
             cameras.toml:9:1: cameras.c.subframe.height: found nothing, expected the picture's size in pixels\n\
             cameras.toml:9:14: cameras.c.subframe.first_u_px: found -1, expected a whole number from 0 to 1000000\n\
             cameras.toml:9:43: cameras.c.subframe.heigth: unknown key, is height meant?"
        );
        assert_eq!(
            fault("binning = 2\ndownsampling = [2, 2]"),
            "cameras.toml:10:1: cameras.c.downsampling: pictures are binned or downsampled, not both"
        );
        assert_eq!(
            fault("downsampling = [2, 0.5]"),
            "cameras.toml:9:1: cameras.c.downsampling: found a list of 2, expected a whole number from 1 to 1000000, or a list of two"
        );
        assert_eq!(
            fault("binning = 500"),
            "cameras.toml:9:1: cameras.c.binning: found 500 by 500, expected whole numbers from 1 to the 640x480 pixels there are"
        );
    }
}
