//! Numerics that two or more units need: frames, rotations, triangle meshes.
//!
//! Notation: `W` is the inertial (world) frame, `B` a body frame. `p_WC` is the position of point C in W, `R_WB` turns
//! components in B into components in W, and orientations are unit quaternions `q_WB`, body to inertial, scalar first
//! (w, x, y, z) wherever they appear as four numbers. SI units; X forward, Y left, Z up.
//!
//! ```
//! use terramech_mechanics::{RigidState, cylinder::Cylinder};
//! let wheel = Cylinder::smooth(0.058, 0.05, 60).mesh().unwrap();
//! assert!(wheel.check().is_closed());
//! let state = RigidState { angular_velocity: [0.0, 1.0, 0.0].into(), ..RigidState::default() };
//! // The lowest point of a wheel that turns about +Y moves backwards.
//! assert!(state.velocity_at(&[0.0, 0.0, -0.058].into()).x < 0.0);
//! ```

pub mod cone;
pub mod cylinder;
pub mod mass;
pub mod obj;
mod rigid;
pub mod rotation;
mod triangle_mesh;

pub use mass::MassProperties;
pub use rigid::{RigidState, RigidStateError};
pub use triangle_mesh::{MeshFault, MeshReport, TriangleMesh};

/// A vector of three reals: components in the frame that the name of the quantity says.
pub type Vec3 = nalgebra::Vector3<f64>;
/// A 3 x 3 matrix.
pub type Mat3 = nalgebra::Matrix3<f64>;
/// A unit quaternion `q_WB`; as four numbers always scalar first, see [`rotation`].
pub type Quat = nalgebra::UnitQuaternion<f64>;

#[cfg(feature = "sparse")]
pub mod sparse;
