//! Reads lenses by JPL's vectors from cameras.toml.

use super::read::{lens_made, required, required_triple};
use super::{BodyAxes, Cahv, CahvVectors, Cahvor, Cahvore, Lens, Linearity, Mount};
use crate::input::Section;

/// A lens by JPL's vectors, which place the camera too.
pub(super) fn cahv_family(section: &Section, model: &str) -> Option<(Lens, Mount)> {
    let axes = required(section, "axes", "\"flu\" or \"frd\"", |s, key| {
        s.word(key, &["flu", "frd"])
    });
    let [c, a, h, v] = ["C", "A", "H", "V"].map(|key| required_triple(section, key));
    let distorted = model != "cahv";
    let o = distorted.then(|| required_triple(section, "O")).flatten();
    let r = distorted.then(|| required_triple(section, "R")).flatten();
    let moving = model == "cahvore";
    let e = moving.then(|| required_triple(section, "E")).flatten();
    let linearity = linearity(section, moving);
    let vectors = CahvVectors {
        axes: if axes? == "frd" {
            BodyAxes::Frd
        } else {
            BodyAxes::Flu
        },
        centre: c?,
        axis: a?,
        horizontal: h?,
        vertical: v?,
    };
    if moving {
        let lens = lens_made(section, "", Cahvore::new(vectors, o?, r?, e?, linearity?))?;
        let mount = lens.linear().mount();
        return Some((Lens::Cahvore(lens), mount));
    }
    if distorted {
        let lens = lens_made(section, "", Cahvor::new(vectors, o?, r?))?;
        let mount = lens.linear().mount();
        return Some((Lens::Cahvor(lens), mount));
    }
    let lens = lens_made(section, "", Cahv::new(vectors))?;
    let mount = lens.mount();
    Some((Lens::Cahv(lens), mount))
}

/// `mtype` and `linearity`. Records of CAHV and CAHVOR cameras carry them as well and mean nothing
/// by them; records of the types 1 and 2 often leave the linearity at zero.
fn linearity(section: &Section, moving: bool) -> Option<Linearity> {
    let mtype = if moving {
        required(section, "mtype", "1, 2 or 3", |s, key| {
            s.integer(key, 1..=3)
        })
    } else {
        section.integer("mtype", 1..=3)
    };
    let given = section.number("linearity", .., "a finite number");
    let linearity = match mtype? {
        1 => Linearity::Perspective,
        2 => Linearity::Fisheye,
        _ if moving => {
            Linearity::General(required(section, "linearity", "a number", |_, _| given)?)
        }
        _ => return None,
    };
    if let (true, Some(given), Linearity::Perspective | Linearity::Fisheye) =
        (moving, given, linearity)
        && given != 0.0
        && given != linearity.value()
    {
        let expected = format!("{} (mtype = 3 takes any)", linearity.value());
        section.fault("linearity", given, expected);
    }
    Some(linearity)
}
