//! Rows of reals that begin where a cache line does, so that a load of a quarter row never touches two lines.

use serde::{Deserialize, Serialize};
use std::ops::{Deref, DerefMut};

macro_rules! aligned {
    ($(#[$doc:meta])* $name:ident, $count:expr, $bytes:expr) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
        #[repr(C, align($bytes))]
        #[serde(transparent)]
        pub struct $name(pub [f64; $count]);

        impl Deref for $name {
            type Target = [f64; $count];
            #[inline(always)]
            fn deref(&self) -> &[f64; $count] {
                &self.0
            }
        }
        impl DerefMut for $name {
            #[inline(always)]
            fn deref_mut(&mut self) -> &mut [f64; $count] {
                &mut self.0
            }
        }
    };
}

aligned!(
    /// A grain: position (0-2), radius (3), velocity (4-6), 1/mass (7), angular velocity (8-10), material (11); the last
    /// four entries are the engine's own. Two cache lines.
    Row, 16, 64
);
aligned!(
    /// Memory of a pair: tangential displacement (0-2) (m) and how far its adhesion has grown (3), 0 while the pair does not
    /// touch. Below 0: it has grown whole, and the pair's overlap counts from an offset, this much times the sum of the radii (of
    /// a wall: the radius). Half a cache line.
    Slip, 4, 32
);
aligned!(
    /// Force (0-2) (N) and moment (4-6) (N m) on a grain. One cache line.
    Force, 8, 64
);
