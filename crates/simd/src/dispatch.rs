//! Compiles one portable kernel for every instruction path.

use crate::isa::Isa;
use crate::lanes::{Lanes, portable};
#[cfg(target_arch = "x86_64")]
use crate::lanes::{avx2, avx512};
use std::sync::OnceLock;

/// A kernel that is to be compiled for every path. `run` and all it calls must be `#[inline(always)]` and free of closures, else they stay
/// baseline code around vector instructions: right, but slow.
pub trait Kernel {
    /// What it returns.
    type Output;
    /// Does the work on eight lanes of type `L`.
    fn run<L: Lanes>(self) -> Self::Output;
}

/// The path that `TERRAMECH_ISA` asks for, else the widest of this machine; read once per process. A name that is refused counts as
/// unset: units report it where they read [`Isa::chosen`].
pub fn active() -> Isa {
    static ACTIVE: OnceLock<Isa> = OnceLock::new();
    *ACTIVE.get_or_init(|| Isa::chosen().unwrap_or_else(|_| Isa::widest()))
}

/// Runs a kernel on a path; one that the machine lacks becomes [`Isa::Portable`].
pub fn dispatch<K: Kernel>(isa: Isa, kernel: K) -> K::Output {
    match isa {
        // SAFETY: the guard has detected the features that the function enables.
        #[cfg(target_arch = "x86_64")]
        Isa::Avx512 if isa.runs_here() => unsafe { run_avx512(kernel) },
        // SAFETY: as above.
        #[cfg(target_arch = "x86_64")]
        Isa::Avx2 if isa.runs_here() => unsafe { run_avx2(kernel) },
        _ => kernel.run::<portable::Portable8>(),
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
unsafe fn run_avx2<K: Kernel>(kernel: K) -> K::Output {
    kernel.run::<avx2::Avx2x8>()
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx2,fma")]
unsafe fn run_avx512<K: Kernel>(kernel: K) -> K::Output {
    kernel.run::<avx512::Avx512x8>()
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Sum<'a>(&'a [f64]);
    impl Kernel for Sum<'_> {
        type Output = f64;
        #[inline(always)]
        fn run<L: Lanes>(self) -> f64 {
            let mut sum = L::splat(0.5) * 0.0;
            for chunk in self.0.chunks_exact(8) {
                let x = L::load(chunk.try_into().unwrap());
                sum += x.fma(x, -x) - x * 2.0 + x;
            }
            let mut out = [0.0; 8];
            sum.store(&mut out);
            out.iter().sum()
        }
    }

    struct Turn<'a>(&'a [[f64; 8]; 8]);
    impl Kernel for Turn<'_> {
        type Output = [[f64; 8]; 8];
        #[inline(always)]
        fn run<L: Lanes>(self) -> Self::Output {
            let mut c = L::columns(self.0.each_ref());
            // Lane by lane: 4 where the first column is above 1, its root over 2 else; at least what the second column says.
            let high = L::splat(4.0).where_more(c[0], L::splat(1.0));
            c[0] = (c[0].sqrt().over(L::splat(2.0)).where_more(L::splat(1.0), c[0]) + high).max(c[1]);
            L::rows(c)
        }
    }

    #[test]
    fn every_path_turns_rows_and_chooses_lanes() {
        let rows: [[f64; 8]; 8] = std::array::from_fn(|k| {
            std::array::from_fn(|c| if c == 0 { 0.25 * k as f64 } else { (10 * k + c) as f64 / 40.0 })
        });
        let mut expected = rows;
        for r in &mut expected {
            let x = if r[0] > 1.0 {
                4.0
            } else if r[0] < 1.0 {
                r[0].sqrt() / 2.0
            } else {
                0.0
            };
            r[0] = f64::max(x, r[1]);
        }
        for isa in Isa::ALL {
            assert_eq!(dispatch(isa, Turn(&rows)), expected, "{isa}");
        }
    }

    #[test]
    fn every_path_computes_the_same() {
        let x: Vec<f64> = (0..104).map(f64::from).collect();
        let expected: f64 = x.iter().map(|x| x * x - 2.0 * x).sum();
        for isa in Isa::ALL {
            assert_eq!(dispatch(isa, Sum(&x)), expected, "{isa}");
        }
        assert!(active().runs_here());
    }
}
