//! Whether all of many numbers are finite.

use crate::dispatch::{Kernel, active, dispatch};
use crate::lanes::{Lanes, WIDTH};

/// Below this count choosing a path costs more than it saves.
const FEW: usize = 64;

struct Finite<'a>(&'a [[f64; WIDTH]]);

impl Kernel for Finite<'_> {
    type Output = bool;

    /// A finite number times zero is zero but for its sign, and stays so in a sum; anything else makes the sum not a number. Four sums,
    /// so that none waits for the one before.
    #[inline(always)]
    fn run<L: Lanes>(self) -> bool {
        let zero = L::splat(0.0);
        let mut sums = [zero; 4];
        let (quads, rest) = self.0.as_chunks::<4>();
        for quad in quads {
            sums[0] = L::load(&quad[0]).fma(zero, sums[0]);
            sums[1] = L::load(&quad[1]).fma(zero, sums[1]);
            sums[2] = L::load(&quad[2]).fma(zero, sums[2]);
            sums[3] = L::load(&quad[3]).fma(zero, sums[3]);
        }
        for x in rest {
            sums[0] = L::load(x).fma(zero, sums[0]);
        }
        let mut out = [0.0; WIDTH];
        ((sums[0] + sums[1]) + (sums[2] + sums[3])).store(&mut out);
        let mut sum = 0.0;
        for x in out {
            sum += x;
        }
        sum == 0.0
    }
}

/// Whether none of the numbers is infinite or not a number.
pub fn all_finite(values: &[f64]) -> bool {
    if values.len() < FEW {
        return values.iter().fold(0, |bad, x| bad | (x * 0.0).to_bits()) << 1 == 0;
    }
    let (packs, rest) = values.as_chunks::<WIDTH>();
    dispatch(active(), Finite(packs)) && rest.iter().all(|x| x.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Isa;

    #[test]
    fn one_that_is_not_finite_is_found_wherever_it_stands_and_on_every_path() {
        for n in [0, 1, 7, 63, 64, 65, 95, 96, 97, 128, 203] {
            let good: Vec<f64> = (0..n).map(|i| (-1.0_f64).powi(i) * 1e308 / f64::from(i + 1)).collect();
            assert!(all_finite(&good), "{n}");
            for i in 0..good.len() {
                for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, -f64::NAN] {
                    let mut values = good.clone();
                    values[i] = bad;
                    assert!(!all_finite(&values), "{bad} at {i} of {n}");
                    let packs = values.as_chunks::<WIDTH>().0;
                    let seen = i < packs.len() * WIDTH;
                    for isa in Isa::ALL {
                        assert_eq!(dispatch(isa, Finite(packs)), !seen, "{bad} at {i} of {n}, {isa}");
                    }
                }
            }
        }
        assert!(all_finite(&[f64::MIN_POSITIVE * 1e-10; 100]) && all_finite(&[-0.0; 80]));
    }
}
