//! What a ray sees.

use nalgebra::Vector3;

use crate::camera::Camera;
use crate::frame::{self, Direction, Enu, Pixel, Point, Ray, RigidTransform};

use super::super::field::{Field, SHADE_REACH};
use super::super::random::{Purpose, key, lattice};
use super::super::scene::RenderPlan;
use super::super::{Ground, Simulation};
use super::ground_look;
use super::palette::{Colour, Colours, colours, mix};
use super::pebbles::Pebbles;
use super::rock_look;
use super::sky;

/// How far the ground is looked at, metres: beyond it lies the horizon.
const HORIZON_M: f64 = 3000.0;

/// What a ray meets first. Neighbouring pixels that differ in it are smoothed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Surface {
    Sky,
    Hill,
    Ground {
        lit: bool,
    },
    Pebble {
        bits: u64,
        lit: bool,
    },
    Rock {
        rock: usize,
        facet: usize,
        lit: bool,
    },
}

impl Surface {
    pub(super) fn rock(self) -> Option<usize> {
        match self {
            Self::Rock { rock, .. } => Some(rock),
            _ => None,
        }
    }
}

/// A scene set up for one view.
pub(super) struct Studio<'a> {
    camera: &'a Camera,
    pose: RigidTransform<Enu, frame::Camera>,
    ground: &'a Ground,
    field: Field<'a>,
    pebbles: Pebbles,
    sun: Vector3<f64>,
    colours: Colours,
    key: u64,
    view: usize,
    /// The angle a pixel spans, radians.
    pixel_angle: f64,
}

impl<'a> Studio<'a> {
    pub(super) fn new(simulation: &'a Simulation, plan: &RenderPlan, view: usize) -> Self {
        let scene = &simulation.scene;
        let shown = &simulation.views[view];
        let camera = &scene.cameras[shown.camera];
        let key = key(scene.seed, Purpose::Texture);
        let (sin, cos) = plan.sun_elevation.sin_cos();
        let (east, north) = plan.sun_azimuth.sin_cos();
        Self {
            camera,
            pose: shown.enu_from_camera(scene),
            ground: &simulation.ground,
            field: Field::new(&simulation.rocks),
            pebbles: Pebbles::new(key, plan.pebbles_per_m2),
            sun: Vector3::new(east * cos, north * cos, sin),
            colours: colours(plan.palette),
            key,
            view,
            pixel_angle: pixel_angle(camera),
        }
    }

    pub(super) fn size(&self) -> (u32, u32) {
        (self.camera.width, self.camera.height)
    }

    /// The key of this view's sensor noise.
    pub(super) fn grain_key(&self) -> u64 {
        lattice(self.key, i64::try_from(self.view).unwrap_or(0), -1)
    }

    /// The light a pixel receives, and from what.
    pub(super) fn look(&self, pixel: Pixel) -> (Colour, Surface) {
        let Ok(ray) = self.camera.ray(pixel) else {
            return (Colour::zeros(), Surface::Sky);
        };
        let ray = self.pose * ray;
        let ground_m = self.ground.first_hit_m(ray, HORIZON_M);
        let reach_m = ground_m.unwrap_or(HORIZON_M);
        if let Some(hit) = self.field.first_hit(ray, reach_m, None) {
            let (light, facet, lit) = self.rock(ray, hit.rock, hit.distance_m);
            let surface = Surface::Rock {
                rock: hit.rock,
                facet,
                lit,
            };
            return (self.through_air(light, ray, hit.distance_m), surface);
        }
        let Some(ground_m) = ground_m else {
            return sky::sky(&self.colours, self.key, ray.direction.xyz());
        };
        let (light, surface) = self.floor(ray, ground_m);
        (self.through_air(light, ray, ground_m), surface)
    }

    fn through_air(&self, light: Colour, ray: Ray<Enu>, distance_m: f64) -> Colour {
        let share = 1.0 - (-distance_m / self.colours.haze_m).exp();
        mix(light, sky::haze(&self.colours, ray.direction.xyz()), share)
    }

    /// Ground, or a pebble on it.
    fn floor(&self, ray: Ray<Enu>, ground_m: f64) -> (Colour, Surface) {
        let place = ray.at(ground_m).xyz;
        let slope = self.ground.slope_at(place.x, place.y);
        // What a pixel spans on the ground, along the line of sight.
        let footprint_m = ground_m * self.pixel_angle;
        let pebble = self.pebbles.first_hit(ray, ground_m, slope, footprint_m);
        if let Some(pebble) = pebble {
            let lit = self.is_lit(pebble.place, pebble.normal, slope, footprint_m);
            let albedo = rock_look::pebble_albedo(&self.colours, pebble.bits);
            let light = self.shade(
                albedo,
                pebble.normal,
                lit,
                self.openness(pebble.place, None),
            );
            let surface = Surface::Pebble {
                bits: pebble.bits,
                lit,
            };
            return (light, surface);
        }
        let sharpness_m = footprint_m / (-ray.direction.xyz().z).max(0.05);
        let look = ground_look::at(
            self.key,
            &self.colours,
            [place.x, place.y],
            slope,
            sharpness_m,
        );
        let lit = self.is_lit(place, look.normal, slope, footprint_m);
        let light = self.shade(look.albedo, look.normal, lit, self.openness(place, None));
        (light, Surface::Ground { lit })
    }

    fn rock(&self, ray: Ray<Enu>, index: usize, distance_m: f64) -> (Colour, usize, bool) {
        let rock = &self.field.rocks()[index];
        let place = ray.at(distance_m).xyz;
        let detail_m = distance_m * self.pixel_angle;
        let look = rock_look::at(self.key, &self.colours, rock, index, place, detail_m);
        // Rocks are convex: one never shades itself where it faces the sun.
        let facing = look.face.dot(&self.sun) > 0.0;
        let lit = facing && !self.is_shaded_by_rocks(place, Some(index));
        let height_m = (place.z - rock.place.xyz.z).max(0.0);
        let contact = (height_m / (0.25 * rock.diameter_m)).min(1.0);
        let open = self.openness(place, Some(index)) * (0.55 + 0.45 * contact);
        (
            self.shade(look.albedo, look.normal, lit, open),
            look.facet,
            lit,
        )
    }

    fn is_shaded_by_rocks(&self, place: Vector3<f64>, except: Option<usize>) -> bool {
        let ray = Ray {
            origin: Point::from_xyz(place),
            direction: Direction::from_unit(self.sun),
        };
        self.field.is_blocked(ray, 50.0, except)
    }

    fn is_lit(
        &self,
        place: Vector3<f64>,
        normal: Vector3<f64>,
        slope: [f64; 2],
        footprint_m: f64,
    ) -> bool {
        let origin = place + normal * 1e-4;
        let towards: Ray<Enu> = Ray {
            origin: Point::from_xyz(origin),
            direction: Direction::from_unit(self.sun),
        };
        normal.dot(&self.sun) > 0.0
            && !self.pebbles.is_blocked(towards, place, slope, footprint_m)
            && !self.is_shaded_by_rocks(origin, None)
    }

    /// The share of the sky's light that the rocks around a place let through.
    fn openness(&self, place: Vector3<f64>, except: Option<usize>) -> f64 {
        let mut open = 1.0;
        for &index in self.field.members_at(place.x, place.y) {
            if Some(index) == except {
                continue;
            }
            let rock = &self.field.rocks()[index];
            let radius_m = 0.5 * rock.diameter_m;
            let away = (place.xy() - rock.place.xyz.xy()).norm() / radius_m - 1.0;
            let reach = SHADE_REACH - 1.0;
            let near = (1.0 - away.max(0.0) / reach).clamp(0.0, 1.0);
            open *= 1.0 - 0.65 * near * near;
        }
        open
    }

    /// The light a matt surface sends on: sun, sky, and what the ground throws back.
    fn shade(&self, albedo: Colour, normal: Vector3<f64>, lit: bool, open: f64) -> Colour {
        let c = &self.colours;
        let sun = if lit {
            normal.dot(&self.sun).max(0.0)
        } else {
            0.0
        };
        let up = 0.5 + 0.5 * normal.z;
        let thrown_back = c.gravel.component_mul(&c.sun) * (self.sun.z * (1.0 - up) * 0.8);
        let light = c.sun * sun + (c.sky * up + thrown_back) * open;
        albedo.component_mul(&light)
    }
}

/// The angle between the two middle columns of a camera, radians.
fn pixel_angle(camera: &Camera) -> f64 {
    let (u, v) = (
        f64::from(camera.width) * 0.5,
        f64::from(camera.height) * 0.5,
    );
    let directions = [Pixel::new(u - 1.0, v), Pixel::new(u, v)].map(|p| camera.ray(p));
    match directions {
        [Ok(a), Ok(b)] => a.direction.xyz().angle(&b.direction.xyz()),
        _ => 1e-3,
    }
}
