//! The output folder, which appears whole or not at all.

use std::fs;
use std::path::{Path, PathBuf};

use super::Product;
use crate::error::{Error, Fault, Place};

/// An output folder in the making: a hidden sibling that takes the place of the real one when
/// everything in it is written, and vanishes if it never is.
pub struct Folder {
    target: PathBuf,
    making: PathBuf,
    is_done: bool,
}

/// The file by which a folder is known to be rockmap's own.
const MANIFEST: &str = "run.json";

impl Folder {
    /// Claims a folder before anything is computed for it. It must be absent, empty, or one that
    /// rockmap wrote.
    ///
    /// # Errors
    /// A folder with other things in it, or one that cannot be made.
    pub fn claim(target: &Path) -> Result<Self, Error> {
        if target.exists() && !target.is_dir() {
            let not_a_folder = std::io::Error::from(std::io::ErrorKind::NotADirectory);
            return Err(Error::io(target, "write", not_a_folder));
        }
        if !is_empty(target)? && !target.join(MANIFEST).exists() {
            let place = Place::file(target.display().to_string());
            let expected = "an empty folder, or one that rockmap wrote";
            return Err(Fault::found(place, "", "a folder with other files", expected).into());
        }
        let absolute = std::path::absolute(target).map_err(|e| Error::io(target, "write", e))?;
        let (Some(parent), Some(name)) = (absolute.parent(), absolute.file_name()) else {
            let no_name = std::io::Error::from(std::io::ErrorKind::InvalidInput);
            return Err(Error::io(target, "write", no_name));
        };
        let making = parent.join(format!(".{}.partial", name.to_string_lossy()));
        fs::create_dir_all(parent).map_err(|e| Error::io(parent, "create", e))?;
        remove(&making)?;
        fs::create_dir(&making).map_err(|e| Error::io(&making, "create", e))?;
        Ok(Self {
            target: absolute,
            making,
            is_done: false,
        })
    }

    /// The folder it will be.
    pub fn target(&self) -> &Path {
        &self.target
    }

    /// The run that wrote the folder as it stands, if one did.
    pub fn earlier_run(&self) -> Option<String> {
        let text = fs::read_to_string(self.target.join(MANIFEST)).ok()?;
        let manifest: serde_json::Value = serde_json::from_str(&text).ok()?;
        Some(manifest.get("run_id")?.as_str()?.to_owned())
    }

    /// Where a file of the folder is written to, its own folder made.
    ///
    /// # Errors
    /// A folder that cannot be made.
    pub fn path_of(&self, name: &Path) -> Result<PathBuf, Error> {
        let path = self.making.join(name);
        if let Some(parent) = path.parent() {
            fs::create_dir_all(parent).map_err(|e| Error::io(parent, "create", e))?;
        }
        Ok(path)
    }

    /// Writes a product.
    ///
    /// # Errors
    /// What the system says.
    pub fn write(&self, product: &Product) -> Result<(), Error> {
        let path = self.path_of(Path::new(&product.name))?;
        fs::write(&path, &product.content).map_err(|e| Error::io(&path, "write", e))
    }

    /// Puts the folder in its place; what stood there goes.
    ///
    /// # Errors
    /// What the system says; then what stood there stands again.
    pub fn publish(mut self) -> Result<PathBuf, Error> {
        let old = self.making.with_extension("old");
        remove(&old)?;
        let replaces = self.target.exists();
        if replaces {
            fs::rename(&self.target, &old).map_err(|e| Error::io(&self.target, "replace", e))?;
        }
        if let Err(error) = fs::rename(&self.making, &self.target) {
            if replaces {
                fs::rename(&old, &self.target).map_err(|e| Error::io(&old, "restore", e))?;
            }
            return Err(Error::io(&self.target, "write", error));
        }
        self.is_done = true;
        remove(&old)?;
        Ok(short(&self.target))
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        if !self.is_done {
            // Nothing more can be done about a folder that cannot be removed.
            let _ = fs::remove_dir_all(&self.making);
        }
    }
}

/// A folder as one would type it: without detours, and from here where it lies below.
fn short(folder: &Path) -> PathBuf {
    let Ok(plain) = folder.canonicalize() else {
        return folder.to_owned();
    };
    let here = std::env::current_dir().and_then(|here| here.canonicalize());
    match here
        .ok()
        .and_then(|here| Some(plain.strip_prefix(here).ok()?.to_owned()))
    {
        Some(below) if below != Path::new("") => below,
        _ => plain,
    }
}

fn is_empty(folder: &Path) -> Result<bool, Error> {
    match fs::read_dir(folder) {
        Ok(mut entries) => Ok(entries.next().is_none()),
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => Ok(true),
        Err(e) => Err(Error::io(folder, "read", e)),
    }
}

fn remove(folder: &Path) -> Result<(), Error> {
    match fs::remove_dir_all(folder) {
        Err(e) if e.kind() != std::io::ErrorKind::NotFound => Err(Error::io(folder, "remove", e)),
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn product(text: &str) -> Product {
        Product::new(MANIFEST, format!("{{\"run_id\": {text:?}}}"))
    }

    #[test]
    fn appears_whole_or_not_at_all() {
        let home = tempfile::tempdir().unwrap();
        let target = home.path().join("map");
        let folder = Folder::claim(&target).unwrap();
        folder.write(&product("a")).unwrap();
        assert!(!target.exists());
        drop(folder);
        assert_eq!(fs::read_dir(home.path()).unwrap().count(), 0);

        let folder = Folder::claim(&target).unwrap();
        folder.write(&product("a")).unwrap();
        folder.publish().unwrap();
        let again = Folder::claim(&target).unwrap();
        assert_eq!(again.earlier_run().as_deref(), Some("a"));
        again.write(&product("b")).unwrap();
        again.publish().unwrap();
        assert_eq!(fs::read_dir(home.path()).unwrap().count(), 1);
        assert!(
            fs::read_to_string(target.join(MANIFEST))
                .unwrap()
                .contains('b')
        );
    }

    #[test]
    fn a_folder_with_other_things_is_left_alone() {
        let home = tempfile::tempdir().unwrap();
        fs::write(home.path().join("thesis.tex"), "words").unwrap();
        let error = Folder::claim(home.path()).err().unwrap().to_string();
        assert!(error.ends_with(
            ": found a folder with other files, expected an empty folder, or one that rockmap wrote"
        ));
    }
}
