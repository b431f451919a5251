//! The granular engine: spheres with penalty contacts (DEM-P), explicit in time.
//!
//! Pure Rust without FMI: make a [`Setup`], place [`Grain`]s (by hand or with [`sample()`]), make a
//! [`CpuEngine`], settle it, advance it with bodies in it.
//!
//! ```
//! use fmu_terrain::dem::{CpuEngine, Grain, GrainEngine, Setup, Wall};
//!
//! let floor = Wall { point: [0.0; 3], normal: [0.0, 0.0, 1.0], material: 0 };
//! let setup = Setup { walls: vec![floor], ..Setup::default() };
//! let mut bed = CpuEngine::new(setup, &[Grain::at([0.0, 0.0, 0.02], 0.012, 2500.0)], 1)?;
//! bed.advance(5000, &mut [])?;
//! assert!(bed.state().kinetic_energy() < 1e-9);
//! # Ok::<(), fmu_terrain::dem::DemError>(())
//! ```
//!
//! | file | job |
//! |---|---|
//! | [`grains`] | rows of 16 reals, the state |
//! | [`grid`], [`rebuild`](mod@rebuild), `search.rs`, [`slab`] | sort, pair lists, regions |
//! | [`sleep`], `patch.rs` | what is far from every body; a box that follows a vehicle |
//! | [`material`], [`law`], [`contact`] | what a contact does |
//! | [`kernel`], [`batch`], [`wall`], [`body`], [`cylinder`] | loops over contacts |
//! | [`spread`] | the bed over the members of a team |
//! | [`obstacle`] | rigid bodies that are free to move |
//! | [`engine`], `step.rs`, [`team`], [`limits`] | setup, the step, threads, the critical step |
//! | [`diagnostics`], `energy.rs` | looking at contacts, energies |
//! | [`sample`](mod@sample), [`place`], [`settle`](mod@settle), [`compact`], [`offset`](mod@offset), [`tile`], [`period`], [`surface`] | making a bed and measuring it |
//!
//! **Invariants.** The order of grains, the lists, the number of slabs and every sum follow from the state alone: the
//! same bits for any number of threads. The state is plain data, saved whole; engines and scratch memory hold
//! nothing that the next step needs.

pub mod batch;
pub mod body;
pub mod compact;
pub mod contact;
pub mod cylinder;
pub mod diagnostics;
mod energy;
pub mod engine;
pub mod error;
pub mod grains;
pub mod grid;
pub mod kernel;
pub mod law;
pub mod limits;
pub mod material;
mod memories;
pub mod obstacle;
pub mod offset;
pub mod patch;
pub mod period;
pub mod place;
pub mod rebuild;
pub mod rng;
pub mod sample;
mod search;
pub mod settle;
pub mod slab;
pub mod sleep;
pub mod spread;
mod step;
pub mod surface;
pub mod team;
pub mod tile;
pub mod vec3;
pub mod wall;

pub use body::{Body, BodyTouch, Shape};
pub use compact::Compaction;
pub use cylinder::Cylinder;
pub use engine::{CpuEngine, GrainEngine, Setup};
pub use error::DemError;
pub use grains::{DemState, Grain};
pub use law::{Form, LawKind, Tangential};
pub use material::{Adhesion, Coefficients, Material, PairOverride};
pub use obstacle::{FreeBody, FreeState, MassOf, Solid};
pub use place::Placing;
pub use sample::{Fill, Radii, Sample, Species, sample, sample_mixed};
pub use settle::{BedReport, Onset, Recipe, Settle, Settled, prepare, prepare_with, settle};
pub use sleep::Sleep;
pub use surface::Surface;
pub use terramech_simd::contact::Precision;
pub use wall::Wall;
