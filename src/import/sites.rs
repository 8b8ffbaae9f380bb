//! Places told in several site frames, told in one.

use std::collections::BTreeMap;

use super::ImportedImage;
use crate::camera::SiteLink;
use crate::error::{Fault, Place};
use crate::frame::{Enu, Vector};

/// Tells the places of all pictures in the site frame of the first that has one. A fault for every
/// picture whose site no chain of labels ties to it; `files` name the files of the pictures.
pub(super) fn join(images: &mut [ImportedImage], files: &[String]) -> Vec<Fault> {
    let placed = |i: &ImportedImage| i.image.pose.site.filter(|_| i.image.pose.place.is_some());
    let first = images.iter().position(|i| placed(i).is_some());
    let Some((first, site)) = first.and_then(|at| Some((at, placed(&images[at])?))) else {
        return Vec::new();
    };
    let links: Vec<SiteLink> = images.iter().filter_map(|i| i.image.link).collect();
    let origins = origins(site, &links);
    let mut faults = Vec::new();
    for (image, file) in images.iter_mut().zip(files) {
        let Some(own) = placed(image) else {
            continue;
        };
        let Some(origin) = origins.get(&own) else {
            let other = &files[first];
            let expected = format!(
                "{site}, that of {other}, or a label that says where the one lies in the other"
            );
            faults.push(Fault::found(Place::file(file), "site", own, expected));
            continue;
        };
        let pose = &mut image.image.pose;
        pose.place = pose.place.map(|place| place + *origin);
        pose.site = Some(site);
    }
    faults
}

/// Where the origins of all sites that hang together with `site` lie in it.
fn origins(site: u32, links: &[SiteLink]) -> BTreeMap<u32, Vector<Enu>> {
    let mut origins = BTreeMap::from([(site, Vector::new(0.0, 0.0, 0.0))]);
    // Every round reaches at least one more site, or none ever will.
    for _ in links {
        for link in links {
            let (here, there) = (origins.get(&link.site), origins.get(&link.reference));
            match (here.copied(), there.copied()) {
                (None, Some(reference)) => {
                    origins.insert(link.site, reference + link.offset);
                }
                (Some(here), None) => {
                    origins.insert(link.reference, here - link.offset);
                }
                _ => {}
            }
        }
    }
    origins
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use crate::frame::Point;

    const SITE: &str = "GROUP = SITE_COORDINATE_SYSTEM_PARMS
  COORDINATE_SYSTEM_NAME = SITE_FRAME
  COORDINATE_SYSTEM_INDEX = 3
  ORIGIN_OFFSET_VECTOR = (100.0,-40.0,5.0)
  ORIGIN_ROTATION_QUATERNION = (1.0,0.0,0.0,0.0)
  REFERENCE_COORD_SYSTEM_NAME = SITE_FRAME
  REFERENCE_COORD_SYSTEM_INDEX = 2
END_GROUP = SITE_COORDINATE_SYSTEM_PARMS
END
";

    /// The same rover, in site 2 at ENU (17.75, 11.5, 0.5), and in site 3, whose origin lies 100 m
    /// north, 40 m west and 5 m below that of site 2.
    #[test]
    fn sites_are_joined_by_what_labels_say() {
        let folder = tempfile::tempdir().unwrap();
        let sample = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/formats/rover.lbl");
        let text = std::fs::read_to_string(sample).unwrap();
        let other = text
            .replace("INDEX = 2\n", "INDEX = 3\n")
            .replace("2N126400000", "2N126400001");
        let tied = other.replace("\nEND\n", &format!("\n{SITE}"));
        let write = |name: &str, text: &str| -> PathBuf {
            let path = folder.path().join(name);
            std::fs::write(&path, text).unwrap();
            path
        };
        let first = write("a.lbl", &text);
        let (tied, lost) = (write("b.lbl", &tied), write("c.lbl", &other));
        let places = |files: &[PathBuf]| -> Vec<Point<crate::frame::Enu>> {
            let images = super::super::read(files, None).unwrap().images;
            images.iter().map(|i| i.image.pose.place.unwrap()).collect()
        };
        let [a, b] = places(&[first.clone(), tied.clone()])[..] else {
            panic!("two places");
        };
        assert!(a.distance(Point::new(17.75, 11.5, 0.5)) < 1e-12);
        assert!(b.distance(Point::new(-22.25, 111.5, -4.5)) < 1e-12);
        let [b, a] = places(&[tied, first.clone()])[..] else {
            panic!("two places");
        };
        assert!(b.distance(Point::new(17.75, 11.5, 0.5)) < 1e-12);
        assert!(a.distance(Point::new(57.75, -88.5, 5.5)) < 1e-12);
        let error = super::super::read(&[first.clone(), lost.clone()], None).unwrap_err();
        assert_eq!(
            error.to_string(),
            format!(
                "{}: site: found 3, expected 2, that of {}, or a label that says where the one lies in the other",
                lost.display(),
                first.display()
            )
        );
    }
}
