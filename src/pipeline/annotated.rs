//! The folder of annotated pictures: what each is called, and which of an earlier run's stand as
//! they are.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Component, Path, PathBuf};

use sha2::{Digest, Sha256};

use super::config::OutputConfig;
use super::digest::hexadecimal;
use crate::error::Error;
use crate::publish::annotate::DRAWING;
use crate::publish::picture::Format;
use crate::publish::{Annotation, Product};

/// The folder, within that of the run.
pub(super) const FOLDER: &str = "annotated";
/// The list of the pictures, within that folder.
const INDEX: &str = "index.csv";

/// An annotated picture as the list has it.
#[derive(Debug, Clone)]
pub(super) struct Row {
    /// The image.
    pub(super) image_id: String,
    /// The picture, as the run names it.
    pub(super) picture: String,
    /// The annotated one, relative to the folder, parts divided by `/`.
    pub(super) file: String,
    /// What it was drawn from: hexadecimal digits.
    pub(super) key: String,
    /// SHA-256 of its content: hexadecimal digits.
    pub(super) sha256: String,
}

/// The list of annotated pictures.
///
/// # Errors
/// A table that cannot be written.
pub(super) fn index(rows: &[Row]) -> Result<Product, Error> {
    let words = |e: &dyn std::fmt::Display| Error::Output(format!("{FOLDER}/{INDEX}: {e}"));
    let mut table = csv::Writer::from_writer(Vec::new());
    table
        .write_record(["image_id", "picture", "file", "key", "sha256"])
        .map_err(|e| words(&e))?;
    for row in rows {
        let record = [
            &row.image_id,
            &row.picture,
            &row.file,
            &row.key,
            &row.sha256,
        ];
        table.write_record(record).map_err(|e| words(&e))?;
    }
    let content = table.into_inner().map_err(|e| words(&e))?;
    Ok(Product::new(format!("{FOLDER}/{INDEX}"), content))
}

/// Everything that decides the bytes of an annotated picture, as one number.
pub(super) fn key(
    picture: [u8; 32],
    panels: &[Annotation],
    format: Format,
    output: &OutputConfig,
) -> String {
    let mut digest = Sha256::new();
    let version = env!("CARGO_PKG_VERSION");
    let quality = output.picture_quality;
    digest.update(format!("{version} {DRAWING} {format} {quality} "));
    digest.update(picture);
    for panel in panels {
        let content = panel.content();
        digest.update((content.len() as u64).to_le_bytes());
        digest.update(content);
    }
    hexadecimal(&digest.finalize())
}

/// The annotated pictures of the run that wrote a folder before.
pub(super) struct Earlier {
    folder: PathBuf,
    /// Key and content of each file; empty where there is no list, or none that can be read.
    known: BTreeMap<String, (String, String)>,
}

impl Earlier {
    /// Of the run whose outputs stand in a folder.
    pub(super) fn of(target: &Path) -> Self {
        let folder = target.join(FOLDER);
        let mut known = BTreeMap::new();
        if let Ok(mut table) = csv::Reader::from_path(folder.join(INDEX)) {
            for record in table.records().map_while(Result::ok) {
                if let (Some(file), Some(key), Some(sha256)) =
                    (record.get(2), record.get(3), record.get(4))
                {
                    known.insert(file.to_owned(), (key.to_owned(), sha256.to_owned()));
                }
            }
        }
        Self { folder, known }
    }

    /// Puts an earlier picture in its new place where it was drawn from the same, and gives its
    /// SHA-256; `None` where it was not, or is not any more what it was.
    pub(super) fn carry(&self, file: &str, key: &str, path: &Path) -> Option<String> {
        let (earlier_key, sha256) = self.known.get(file)?;
        if earlier_key != key || key.is_empty() {
            return None;
        }
        let earlier = self.folder.join(file);
        if !fs::symlink_metadata(&earlier).ok()?.is_file() {
            return None;
        }
        let content = fs::read(&earlier).ok()?;
        if hexadecimal(&Sha256::digest(&content)) != *sha256 {
            return None;
        }
        // Where the file system knows no links, or not between these folders, a copy does.
        fs::hard_link(&earlier, path)
            .or_else(|_| fs::write(path, &content))
            .ok()?;
        Some(sha256.clone())
    }
}

/// What the annotated pictures are called, in the order of their originals (`None` has none): as
/// those, with the extension of the format they are written in.
///
/// Where two would have one name, regardless of case, the one whose original is called so has it; the next
/// keeps its own extension before the new one (`a.png.jpg`), or else is numbered (`a-2.jpg`).
pub(super) fn names(originals: &[Option<&str>], format: Option<Format>) -> Vec<Option<PathBuf>> {
    let mut names = vec![None; originals.len()];
    let mut taken = BTreeSet::new();
    for is_kept in [true, false] {
        for (name, original) in names.iter_mut().zip(originals) {
            let Some(original) = original.filter(|_| name.is_none()) else {
                continue;
            };
            let path = tame(original);
            let own = Format::by_name(&path);
            let format = format.or(own).unwrap_or(Format::Png);
            let mut take = |path: PathBuf| {
                let folded = path.to_string_lossy().to_lowercase();
                taken.insert(folded).then_some(path)
            };
            if own == Some(format) {
                *name = if is_kept {
                    take(path)
                } else {
                    let extension = path.extension().unwrap_or_default().to_os_string();
                    numbered(&path, &extension.to_string_lossy(), &mut take)
                };
            } else if !is_kept {
                let extension = format.extension();
                let mut longer = path.clone().into_os_string();
                longer.push(format!(".{extension}"));
                *name = take(path.with_extension(extension))
                    .or_else(|| take(longer.into()))
                    .or_else(|| numbered(&path, extension, &mut take));
            }
        }
    }
    names
}

/// The first numbered name that is free.
fn numbered(
    path: &Path,
    extension: &str,
    take: &mut impl FnMut(PathBuf) -> Option<PathBuf>,
) -> Option<PathBuf> {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    (2..).find_map(|number: u64| take(path.with_file_name(format!("{stem}-{number}.{extension}"))))
}

/// A path with its parts divided by `/`, as pages and tables have it.
pub(super) fn slashed(path: &Path) -> String {
    let parts: Vec<_> = path.iter().map(|part| part.to_string_lossy()).collect();
    parts.join("/")
}

/// A picture's name as a path that stays below the folder it is written to.
fn tame(name: &str) -> PathBuf {
    let parts = Path::new(name).components();
    parts
        .filter_map(|part| match part {
            Component::Normal(part) => Some(part),
            _ => None,
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn named(originals: &[&str], format: Option<Format>) -> Vec<String> {
        let originals: Vec<_> = originals.iter().copied().map(Some).collect();
        let names = names(&originals, format).into_iter();
        names.map(|name| slashed(&name.unwrap())).collect()
    }

    #[test]
    fn names_stay_or_take_the_extension_of_their_format() {
        let originals = ["a/b.JPG", "c.png", "../d.tif", "e.0012", "f.jpeg"];
        assert_eq!(
            named(&originals, None),
            ["a/b.JPG", "c.png", "d.tif", "e.png", "f.jpeg"]
        );
        assert_eq!(
            named(&originals, Some(Format::Jpeg)),
            ["a/b.JPG", "c.jpg", "d.jpg", "e.jpg", "f.jpeg"]
        );
        assert_eq!(
            named(&originals, Some(Format::Tiff)),
            ["a/b.tif", "c.tif", "d.tif", "e.tif", "f.tif"]
        );
        assert_eq!(names(&[None, Some("a.jpg")], None)[0], None);
    }

    #[test]
    fn no_two_pictures_have_one_name() {
        let originals = ["a.png", "A.jpg", "../a.jpg", "a.jpg", "a.tif", "x/a.png"];
        assert_eq!(
            named(&originals, Some(Format::Jpeg)),
            [
                "a.png.jpg",
                "A.jpg",
                "a-2.jpg",
                "a-3.jpg",
                "a.tif.jpg",
                "x/a.jpg"
            ]
        );
        assert_eq!(named(&["e.001", "e.002"], None), ["e.png", "e.002.png"]);
    }

    #[test]
    fn only_what_is_known_and_unharmed_is_carried_over() {
        let home = tempfile::tempdir().unwrap();
        let folder = home.path().join(FOLDER);
        fs::create_dir(&folder).unwrap();
        fs::write(folder.join("a.jpg"), "drawn").unwrap();
        let row = Row {
            image_id: "v1".to_owned(),
            picture: "a.jpg".to_owned(),
            file: "a.jpg".to_owned(),
            key: "k".to_owned(),
            sha256: hexadecimal(&Sha256::digest("drawn")),
        };
        let list = index(std::slice::from_ref(&row)).unwrap();
        assert_eq!(list.name, "annotated/index.csv");
        fs::write(home.path().join(&list.name), &list.content).unwrap();
        let earlier = Earlier::of(home.path());
        let to = |name: &str| home.path().join(name);
        assert_eq!(earlier.carry("a.jpg", "k", &to("1")), Some(row.sha256));
        assert_eq!(fs::read(to("1")).unwrap(), b"drawn");
        assert_eq!(earlier.carry("a.jpg", "other", &to("2")), None);
        assert_eq!(earlier.carry("b.jpg", "k", &to("2")), None);
        fs::remove_file(folder.join("a.jpg")).unwrap();
        assert_eq!(earlier.carry("a.jpg", "k", &to("2")), None);
        fs::write(folder.join("a.jpg"), "harmed").unwrap();
        assert_eq!(earlier.carry("a.jpg", "k", &to("2")), None);
        assert!(!to("2").exists());

        fs::write(folder.join(INDEX), [0xff, 0, b'"', b'\n', 0xfe]).unwrap();
        assert!(Earlier::of(home.path()).known.is_empty());
        assert!(Earlier::of(&to("nowhere")).known.is_empty());
    }
}
