//! The pictures of a run: whether they are there, of the right size, and what is in them.

use std::collections::HashMap;

use rayon::prelude::*;
use serde::Serialize;
use sha2::{Digest, Sha256};

use super::digest::hexadecimal;
use super::read::Inputs;
use crate::input::{Reason, Reject};
use crate::publish::Picture;
use crate::view::View;

/// The pictures of a run, taken together.
#[derive(Debug, Clone, Default, Serialize)]
pub struct PictureDigest {
    /// How many are at hand.
    pub count: usize,
    /// Their size together.
    pub bytes: u64,
    /// SHA-256 over the SHA-256 of each, in the order of the views.
    pub sha256: String,
}

impl Inputs {
    /// Looks at the header of every picture. One that is missing or no picture costs a warning and
    /// the view stays; one whose size is not its camera's belongs to another camera, and the view
    /// goes.
    pub(super) fn check_pictures(
        &mut self,
        hash: bool,
        rejected_images: &mut HashMap<String, Reason>,
    ) {
        let looked: Vec<_> = self
            .views
            .par_iter()
            .map(|view| {
                let picture = view.picture.as_ref()?;
                let size = Picture::size_of(&picture.path, &picture.name);
                let content = match (&size, hash) {
                    (Ok(_), true) => std::fs::read(&picture.path).ok(),
                    _ => None,
                };
                let digest = content.map(|c| (c.len() as u64, Sha256::digest(&c)));
                Some((size.map_err(|e| e.to_string()), digest))
            })
            .collect();
        let mut all = Sha256::new();
        let mut kept = Vec::with_capacity(self.views.len());
        for (mut view, looked) in std::mem::take(&mut self.views).into_iter().zip(looked) {
            match looked {
                None => {}
                Some((Err(error), _)) => {
                    self.warnings
                        .push(format!("image {}: {error}", view.image_id));
                    view.picture = None;
                }
                Some((Ok((width, height)), digest)) => {
                    if let Some(camera) = &view.camera
                        && (camera.width, camera.height) != (width, height)
                    {
                        let detail = format!(
                            "found a picture of {width}x{height}, expected {}x{} as camera {} has",
                            camera.width, camera.height, camera.name
                        );
                        self.rejects
                            .push(self.image_reject(&view, Reason::PictureSize, detail));
                        rejected_images.insert(view.image_id.clone(), Reason::PictureSize);
                        continue;
                    }
                    if let Some((bytes, digest)) = digest {
                        self.pictures.count += 1;
                        self.pictures.bytes += bytes;
                        all.update(digest);
                        if let Some(picture) = &mut view.picture {
                            picture.sha256 = Some(digest.into());
                        }
                    }
                }
            }
            kept.push(view);
        }
        self.views = kept;
        self.pictures.sha256 = hexadecimal(&all.finalize());
    }

    fn image_reject(&self, view: &View, reason: Reason, detail: String) -> Reject {
        Reject {
            file: view.listed.0.clone(),
            line: Some(view.listed.1),
            record: view.image_id.clone(),
            reason,
            detail,
        }
    }
}
