//! Which measurements are of one object, by the labels.

use std::collections::{BTreeMap, BTreeSet};

use crate::error::{Fault, Place};
use crate::evaluate::{DetectionKey, Labels};

/// Measurements of one object.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Group {
    /// The true object; `None` for clutter.
    pub label: Option<String>,
    /// Its measurements by index, ascending.
    pub members: Vec<usize>,
}

/// Measurements put together as the labels have them.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Partition {
    /// One group an object, and one a clutter detection, in the order of their first members.
    pub groups: Vec<Group>,
    /// How many measurements no label names, or whose object is not in the truth (things that
    /// move, for one); they are in no group.
    pub n_left_out: usize,
}

impl Partition {
    /// From the label of every measurement: `None` where there is none, `Some(None)` for clutter.
    pub fn new<'a>(labels: impl IntoIterator<Item = Option<Option<&'a str>>>) -> Self {
        let mut partition = Self::default();
        let mut known: BTreeMap<&str, usize> = BTreeMap::new();
        for (member, label) in labels.into_iter().enumerate() {
            let Some(label) = label else {
                partition.n_left_out += 1;
                continue;
            };
            if let Some(&group) = label.and_then(|name| known.get(name)) {
                partition.groups[group].members.push(member);
                continue;
            }
            if let Some(name) = label {
                known.insert(name, partition.groups.len());
            }
            partition.groups.push(Group {
                label: label.map(str::to_owned),
                members: vec![member],
            });
        }
        partition
    }

    /// Of detections named by image and detection, in the order of their measurements; objects
    /// that are not among the `known` ones are left out.
    ///
    /// # Errors
    /// Labels that do not name the image, where the same `det_id` stands in several.
    pub fn of_labels(
        labels: &Labels,
        detections: &[DetectionKey],
        known: &BTreeSet<&str>,
    ) -> Result<Self, Fault> {
        let mut keys = detections.to_vec();
        if !labels.by_image {
            keys.iter_mut().for_each(|key| key.image_id.clear());
            let mut sorted: Vec<&DetectionKey> = keys.iter().collect();
            sorted.sort_unstable();
            if let Some(twice) = sorted.windows(2).find(|pair| pair[0] == pair[1]) {
                let expected = format!(
                    "a column image_id, since det_id {} is in several images",
                    twice[0].det_id
                );
                let place = Place::line(&labels.file, 1);
                return Err(Fault::found(place, "image_id", "no such column", expected));
            }
        }
        Ok(Self::new(keys.iter().map(|key| {
            let label = labels.object_of.get(key)?.as_deref();
            label
                .is_none_or(|name| known.contains(name))
                .then_some(label)
        })))
    }

    /// The groups that are objects.
    pub fn objects(&self) -> Vec<Group> {
        let groups = self.groups.iter();
        groups.filter(|g| g.label.is_some()).cloned().collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clutter_is_by_itself_and_objects_keep_their_order() {
        let labels = [
            Some(Some("b")),
            Some(None),
            None,
            Some(Some("a")),
            Some(None),
            Some(Some("b")),
        ];
        let partition = Partition::new(labels);
        let members: Vec<&[usize]> = partition.groups.iter().map(|g| &g.members[..]).collect();
        assert_eq!(members, [&[0, 5][..], &[1], &[3], &[4]]);
        assert_eq!(partition.n_left_out, 1);
        let objects = partition.objects();
        let names: Vec<_> = objects.iter().filter_map(|g| g.label.as_deref()).collect();
        assert_eq!(names, ["b", "a"]);
    }

    fn key(image_id: &str, det_id: &str) -> DetectionKey {
        DetectionKey {
            image_id: image_id.into(),
            det_id: det_id.into(),
        }
    }

    #[test]
    fn labels_without_an_image_serve_where_det_ids_are_unique() {
        let labels = Labels {
            file: "labels.csv".into(),
            object_of: [
                (key("", "1"), Some("a".into())),
                (key("", "2"), None),
                (key("", "3"), Some("moving".into())),
            ]
            .into(),
            by_image: false,
        };
        let known = BTreeSet::from(["a"]);
        let keys = [key("x", "1"), key("y", "2"), key("y", "3"), key("y", "4")];
        let found = Partition::of_labels(&labels, &keys, &known).unwrap();
        assert_eq!((found.groups.len(), found.n_left_out), (2, 2));
        let twice = Partition::of_labels(&labels, &[key("x", "1"), key("y", "1")], &known);
        assert_eq!(
            twice.unwrap_err().to_string(),
            "labels.csv:1: image_id: found no such column, \
             expected a column image_id, since det_id 1 is in several images"
        );
    }
}
