//! A rigid wheel in a settled bed of sand, by either engine: what case 3.6 and the table of costs have in common.
//!
//! The wheel is that of the experiments in `tests/reference/cmu_single_wheel.csv` (radius 58 mm, 50 mm wide, 25.3 N, slip 0.5) in sand of coarse
//! grains, faster than measured: the two engines are compared with each other, not with the experiment.
#![allow(dead_code)]

use fmu_terrain::dem::{
    Body, CpuEngine, Cylinder, DemState, Fill, Grain, GrainEngine, Material, Radii, Recipe, Sample, Settle, Setup,
    Surface, Wall, prepare, prepare_with,
};
use fmu_terrain::dem_c::{ConeEngine, ConeSetup, ConeState};

pub const G: f64 = 9.81;

/// The wheel: radius and width (m), load (N), speed of the carriage (m/s), slip.
#[derive(Clone, Copy)]
pub struct Wheel {
    pub radius: f64,
    pub width: f64,
    pub load: f64,
    pub speed: f64,
    pub slip: f64,
}

pub const WHEEL: Wheel = Wheel { radius: 0.058, width: 0.05, load: 25.28, speed: 0.1, slip: 0.5 };

/// Wheel, box and grains, all lengths `scale` times those of the experiment; speeds and times grow with its root, loads with its cube.
#[derive(Clone, Copy)]
pub struct Scene {
    pub scale: f64,
    /// Young's modulus of the grains (Pa).
    pub young: f64,
    pub wheel: Wheel,
}

pub const SMALL: Scene = Scene { scale: 1.0, young: 5e6, wheel: WHEEL };

impl Scene {
    /// Mean radius of the grains (m).
    pub fn grain(&self) -> f64 {
        0.006 * self.scale
    }

    fn length(&self) -> f64 {
        0.34 * self.scale
    }

    fn width(&self) -> f64 {
        0.14 * self.scale
    }

    /// Step of DEM-P (s): as the studies take it, well below the critical one.
    pub fn soft_step(&self) -> f64 {
        4e-5 * self.scale * (5e6 / self.young).sqrt()
    }

    pub fn setup(&self, step: f64) -> Setup {
        let sand = Material {
            friction: 0.5,
            restitution: 0.2,
            rolling_friction: 0.3,
            spinning_friction: 0.15,
            young_modulus: self.young,
            ..Material::default()
        };
        Setup {
            step,
            materials: vec![sand, sand],
            walls: Wall::open_box(self.length(), self.width(), 0, 0),
            expected_overlap: 0.08,
            ..Setup::default()
        }
    }

    fn recipe(&self, seed: u64) -> Recipe {
        let sample = Sample {
            length: self.length(),
            width: self.width(),
            radii: Radii::Uniform(0.9 * self.grain(), 1.1 * self.grain()),
            fill: Fill::Depth(0.06 * self.scale),
            density: 2600.0,
            material: 0,
            seed,
            spacing: 1.1,
        };
        Recipe::new(sample, Settle::default(), 0.0)
    }

    /// A bed that DEM-P has settled.
    pub fn bed(&self, seed: u64) -> DemState {
        self.settled_soft(seed).0
    }

    /// The same with its height (m) and the simulated time it took (s).
    pub fn settled_soft(&self, seed: u64) -> (DemState, f64, f64) {
        let setup = self.setup(self.soft_step());
        let (engine, report) = prepare(setup, &self.recipe(seed), 1, &mut |_, _| true).unwrap();
        (engine.state().clone(), report.height, report.time)
    }

    /// As [`Scene::settled_soft`], by DEM-C in steps of `step` (s).
    pub fn settled_cone(&self, seed: u64, step: f64) -> (DemState, f64, f64) {
        let new = |grains: &[Grain]| ConeEngine::new(self.setup(step), ConeSetup::default(), grains, 1);
        let (engine, report) = prepare_with(new, false, &self.recipe(seed), &mut |_, _| true).unwrap();
        (engine.state().clone(), report.height, report.time)
    }

    pub fn soft(&self, state: &DemState) -> CpuEngine {
        CpuEngine::with_state(self.setup(self.soft_step()), state.clone(), 1).unwrap()
    }

    pub fn cone(&self, state: &DemState, step: f64, set: ConeSetup) -> ConeEngine {
        ConeEngine::with_state(self.setup(step), set, state.clone(), ConeState::default(), 1).unwrap()
    }

    /// Lets the wheel down within 0.2 s, then drives it over `way` (m; all of it times the scale); means over the second half. It is told of its forces every `exchange` (s): explicit
    /// coupling, as a master does it.
    pub fn drive(&self, engine: &mut impl GrainEngine, exchange: f64, way: f64) -> Driven {
        let Wheel { radius, width, load, speed, slip } = self.wheel;
        let (l, root) = (self.scale, self.scale.sqrt());
        let (radius, width, load, speed, way) = (l * radius, l * width, l.powi(3) * load, root * speed, l * way);
        let rim = if slip > 0.0 { 1.0 / (1.0 - slip) } else { 1.0 + slip };
        let start = cpu_seconds();
        let height = Surface::of(engine.state(), self.length(), self.width()).mean();
        let steps = (exchange / engine.setup().step).round() as u32;
        let mass = load / G;
        let (mut x, mut z, mut vz, mut t) = (-0.5 * self.length() + 0.09 * l, height + radius, 0.0, 0.0_f64);
        let from = x;
        let (mut pull, mut sinkage, mut ring, mut count, mut last) = (0.0, 0.0, 0.0, 0.0, 0.0);
        let (mut lift, mut contacts) = (Lift::default(), Vec::new());
        while x - from < way {
            let share = ((t / root - 0.2) / 0.1).clamp(0.0, 1.0);
            let (v, omega) = (share * speed, share * speed * rim / radius);
            let wheel = Cylinder::new(radius, width, [x, 0.0, z], [0.0, 1.0, 0.0], [v, 0.0, vz], [0.0, omega, 0.0]);
            let mut body = [Body::new(Box::new(wheel), 1)];
            engine.advance(steps, &mut body).unwrap();
            let f = body[0].impulse.map(|i| i / exchange);
            (x, z, t) = (x + v * exchange, z + vz * exchange, t + exchange);
            let damping = if share > 0.0 { 30.0 } else { 300.0 } * l * l * root;
            vz += exchange * ((f[2] - load * (t / root / 0.2).min(1.0)) / mass - damping / mass * vz);
            if x - from > 0.5 * way {
                pull += f[0];
                sinkage += height + radius - z;
                ring += (f[2] - last).abs();
                count += 1.0;
                let now = touching(engine.state());
                if steps == 1 && !contacts.is_empty() {
                    lift.add(&contacts, &now, engine.setup().materials[1].friction, exchange);
                }
                contacts = now;
            }
            last = f[2];
            assert!(z > radius, "the wheel has sunk through the bed at {t} s");
        }
        let seconds = cpu_seconds() - start;
        Driven { pull: pull / count, sinkage: sinkage / count, ring: ring / count, seconds, lift }
    }
}

/// What a run gives: pull (N), sinkage (m), greatest change of the vertical force from one exchange to the next (N, the mean over the window), seconds.
pub struct Driven {
    pub pull: f64,
    pub sinkage: f64,
    pub ring: f64,
    /// Of a processor.
    pub seconds: f64,
    pub lift: Lift,
}

/// What the convex relaxation opens between the wheel and grains that slide on it (m): mu v h, v the slip at the wheel, if nothing were done; and what is left of it,
/// mu h times the change of slip in a step. Means over contacts and steps, and the greatest.
#[derive(Clone, Copy, Default)]
pub struct Lift {
    whole: f64,
    left: f64,
    greatest: f64,
    pub count: f64,
}

impl Lift {
    /// Takes the contacts of the wheel after a step of `h` in, `before` those after the last one.
    fn add(&mut self, before: &[(u64, f64)], now: &[(u64, f64)], mu: f64, h: f64) {
        for (id, slip) in now {
            let Some((_, old)) = before.iter().find(|(of, _)| of == id) else { continue };
            let left = mu * h * (slip - old).abs();
            self.whole += mu * h * slip;
            self.left += left;
            self.greatest = self.greatest.max(left);
            self.count += 1.0;
        }
    }

    /// Whole lift, what is left of it, the greatest of that (m).
    pub fn means(self) -> [f64; 3] {
        [self.whole / self.count, self.left / self.count, self.greatest]
    }
}

/// Grains that touch a body, and how fast they slide on it (m/s).
fn touching(state: &DemState) -> Vec<(u64, f64)> {
    let pairs = state.slabs.iter().flat_map(|s| &s.bodies);
    // What is kept is 1 + speed.
    pairs.map(|p| (u64::from(state.ids[p.grain as usize]), p.slip.0[3] - 1.0)).collect()
}

/// Processor time of all threads of this process (s).
pub fn cpu_seconds() -> f64 {
    let Ok(tasks) = std::fs::read_dir("/proc/self/task") else { return 0.0 };
    let nanoseconds = |p: std::path::PathBuf| std::fs::read_to_string(p.join("schedstat")).ok();
    tasks.flatten().filter_map(|t| nanoseconds(t.path())?.split_whitespace().next()?.parse::<f64>().ok()).sum::<f64>()
        * 1e-9
}
