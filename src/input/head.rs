//! What tells the format of a file, and what a file of another project calls an image.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use crate::error::{Error, Fault, Place};

/// The first character of a file that is not blank; `None` where there is none.
///
/// # Errors
/// A file that cannot be read.
pub(crate) fn first_character(path: &Path) -> Result<Option<char>, Error> {
    let failed = |e| Error::io(path, "read", e);
    let mut file = File::open(path).map_err(failed)?;
    let mut head = Vec::new();
    file.by_ref()
        .take(4096)
        .read_to_end(&mut head)
        .map_err(failed)?;
    let text = String::from_utf8_lossy(&head);
    let mut characters = text.trim_start_matches('\u{feff}').chars();
    Ok(characters.find(|c| !c.is_whitespace()))
}

/// The text of a file.
///
/// # Errors
/// A file that cannot be read, or is no text.
pub(crate) fn text(path: &Path, shown: &str) -> Result<String, Error> {
    let bytes = std::fs::read(path).map_err(|e| Error::io(path, "read", e))?;
    String::from_utf8(bytes).map_err(|_| {
        let found = "bytes that are not UTF-8";
        Fault::found(Place::file(shown), "", found, "text").into()
    })
}

/// The image that a file name stands for: the name without its extension, with its folders.
pub(crate) fn image_id_of(file_name: &str) -> String {
    let folders = file_name.rfind(['/', '\\']).map_or(0, |at| at + 1);
    match file_name[folders..].rfind('.') {
        Some(dot) if dot > 0 => file_name[..folders + dot].to_owned(),
        _ => file_name.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::image_id_of;

    #[test]
    fn an_image_is_its_file_without_the_extension() {
        assert_eq!(image_id_of("left/r_0007.png"), "left/r_0007");
        assert_eq!(image_id_of("a.b.jpg"), "a.b");
        assert_eq!(image_id_of("v1.2/r"), "v1.2/r");
        assert_eq!(image_id_of(".hidden"), ".hidden");
    }
}
