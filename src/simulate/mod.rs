//! Scenes with known truth: rocks on a ground, rovers that drive past them, a detector that misses,
//! errs and invents, and pictures of it all.
//!
//! [`Scene::read`] reads a scene file, [`simulate`] plays it, [`write()`] writes it as a data set in
//! the native formats. The same scene gives the same bytes, and a new use of randomness (pictures,
//! say) changes none of the others: every purpose has a stream of its own.

mod detector;
mod diameters;
mod field;
mod ground;
mod noise;
mod output;
mod pipeline_file;
mod random;
mod render;
mod rocks;
mod scene;
mod scene_cameras;
mod scene_file;
mod scene_platforms;
mod terrain_file;
mod traverse;

pub use detector::{Appearance, SimulatedDetection, appearance};
pub use diameters::{DiameterLaw, golombek_rapp_coverage};
pub use field::{Field, RockHit};
pub use ground::Ground;
pub use noise::SmoothSurface;
pub use output::{NO_OBJECT, write};
pub use render::{Picture, render, write_picture};
pub use rocks::{Rock, Shape};
pub use scene::{
    Area, Border, BoxExtent, Clusters, Detector, GroundPlan, Occlusion, Palette, Path,
    PictureFormat, Platform, PoseKey, PosePlan, RenderPlan, RockPlan, Scene, ScoreLaw,
    TerrainModel,
};
pub use traverse::View;

#[cfg(test)]
mod tests;

/// A scene that has been played: the truth and what the sensors made of it.
#[derive(Debug, Clone)]
pub struct Simulation {
    /// The scene.
    pub scene: Scene,
    /// The true ground and the model of it.
    pub ground: Ground,
    /// The rocks.
    pub rocks: Vec<Rock>,
    /// The images, platform by platform in the order of time.
    pub views: Vec<View>,
    /// The detector's boxes, image by image.
    pub detections: Vec<SimulatedDetection>,
    /// Of each rock: in how many images and within whose range its ground point lies.
    pub n_visible: Vec<usize>,
}

impl Simulation {
    /// How often each rock was detected.
    pub fn n_detections(&self) -> Vec<usize> {
        let mut counts = vec![0; self.rocks.len()];
        for rock in self.detections.iter().filter_map(|d| d.rock) {
            counts[rock] += 1;
        }
        counts
    }
}

/// Plays a scene.
pub fn simulate(scene: &Scene) -> Simulation {
    let ground = Ground::new(&scene.site, &scene.ground, scene.seed);
    let rocks = rocks::scatter(scene, &ground);
    play(scene, ground, rocks)
}

/// Another night at a scene that has been played: the same ground with these rocks on it, and pose
/// errors and detections of their own by `seed`.
pub fn revisit(simulation: &Simulation, rocks: Vec<Rock>, seed: u64) -> Simulation {
    let mut scene = simulation.scene.clone();
    scene.seed = seed;
    play(&scene, simulation.ground, rocks)
}

fn play(scene: &Scene, ground: Ground, rocks: Vec<Rock>) -> Simulation {
    let views = traverse::traverse(scene, &ground);
    let (detections, n_visible) = detector::detect(scene, &ground, &rocks, &views);
    Simulation {
        scene: scene.clone(),
        ground,
        rocks,
        views,
        detections,
        n_visible,
    }
}
