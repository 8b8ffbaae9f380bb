//! The pictures of a run: annotated, and cut for the report.

use std::path::{Path, PathBuf};
use std::sync::Mutex;

use sha2::{Digest, Sha256};

use super::Map;
use crate::error::Error;
use crate::pipeline::annotated::{self, Earlier, Row, slashed};
use crate::pipeline::digest::hexadecimal;
use crate::publish::report::CutCrop;
use crate::publish::{Annotation, Folder, Picture, annotate_panels, picture};
use crate::view::View;

/// What was made of a picture.
#[derive(Default)]
pub(super) struct Handled {
    pub(super) annotated: Option<Row>,
    pub(super) is_carried: bool,
    pub(super) crops: Vec<CutCrop>,
}

/// A picture to be drawn.
struct Plan {
    panels: Vec<Annotation>,
    format: picture::Format,
    path: PathBuf,
    /// What the list will say of it, but for its content.
    row: Row,
}

impl<'a> Map<'a> {
    /// A warning for each image that is to be annotated and is none of the run's.
    pub(super) fn unknown_images(&self) -> Vec<String> {
        let is_known = |id: &&String| self.inputs.views.iter().any(|v| v.image_id == **id);
        let only = self.config.output.annotate_only.iter();
        let unknown = only.filter(|id| !is_known(id));
        unknown
            .map(|id| {
                format!("output.annotate_only: found {id:?}, expected the image_id of a view")
            })
            .collect()
    }

    /// The views whose pictures are looked at, each with its picture.
    pub(super) fn pictures(&self) -> Vec<(usize, &View)> {
        let views = self.inputs.views.iter().enumerate();
        views
            .filter(|&(index, _)| self.names[index].is_some() || self.crops.needs(index))
            .collect()
    }

    /// The name of a view's picture, if it is to be annotated.
    pub(super) fn original(&self, view: &'a View) -> Option<&'a str> {
        let only = &self.config.output.annotate_only;
        let is_wanted = only.is_empty() || only.contains(&view.image_id);
        let picture = view.picture.as_ref().filter(|_| view.camera.is_some())?;
        is_wanted.then_some(picture.name.as_str())
    }

    /// Cuts what the report needs from one picture, and annotates it; one that cannot be decoded
    /// costs a warning.
    pub(super) fn handle(
        &self,
        (folder, earlier): (&Folder, &Earlier),
        index: usize,
        view: &View,
        warnings: &Mutex<Vec<String>>,
    ) -> Result<Handled, Error> {
        let Some(source) = &view.picture else {
            return Ok(Handled::default());
        };
        let plan = self.plan(folder, index, view)?;
        let mut handled = Handled::default();
        if let Some(plan) = &plan
            && let Some(sha256) = earlier.carry(&plan.row.file, &plan.row.key, &plan.path)
        {
            handled.is_carried = true;
            handled.annotated = Some(Row {
                sha256,
                ..plan.row.clone()
            });
            if !self.crops.needs(index) {
                return Ok(handled);
            }
        }
        let picture = match Picture::read(&source.path, &source.name) {
            Ok(picture) => picture,
            Err(error) => {
                if let Ok(mut warnings) = warnings.lock() {
                    warnings.push(format!("image {}: {error}", view.image_id));
                }
                return Ok(handled);
            }
        };
        handled.crops = self.crops.cut(index, &picture);
        if let Some(plan) = plan.filter(|_| !handled.is_carried) {
            handled.annotated = Some(self.draw(plan, picture)?);
        }
        Ok(handled)
    }

    /// What is to be drawn of a view, if anything is.
    fn plan(&self, folder: &Folder, index: usize, view: &View) -> Result<Option<Plan>, Error> {
        let (Some(name), Some(source)) = (&self.names[index], &view.picture) else {
            return Ok(None);
        };
        let output = &self.config.output;
        let panels = self
            .scene
            .panels_of(index, &self.rocks, output.annotate_layout);
        let format = picture::Format::by_name(name).unwrap_or(picture::Format::Png);
        // A picture whose content is not known is like no earlier one.
        let key = source
            .sha256
            .map(|content| annotated::key(content, &panels, format, output));
        Ok(Some(Plan {
            panels,
            format,
            path: folder.path_of(&Path::new(annotated::FOLDER).join(name))?,
            row: Row {
                image_id: view.image_id.clone(),
                picture: source.name.clone(),
                file: slashed(name),
                key: key.unwrap_or_default(),
                sha256: String::new(),
            },
        }))
    }

    /// Draws a picture and writes it.
    fn draw(&self, plan: Plan, picture: Picture) -> Result<Row, Error> {
        let words =
            |why: &dyn std::fmt::Display| Error::Output(format!("{}: {why}", plan.path.display()));
        let drawn = annotate_panels(picture, &plan.panels).map_err(|e| words(&e))?;
        let quality = self.config.output.picture_quality;
        let content = drawn.encode(plan.format, quality).map_err(|e| words(&e))?;
        std::fs::write(&plan.path, &content).map_err(|e| Error::io(&plan.path, "write", e))?;
        Ok(Row {
            sha256: hexadecimal(&Sha256::digest(&content)),
            ..plan.row
        })
    }
}
