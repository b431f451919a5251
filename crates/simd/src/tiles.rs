//! Tiles of eight rows by six columns of f32: what a sparse substitution streams. One right-hand side takes a multiply-add per number read,
//! so only registers filled straight from memory keep up with it; loops in plain Rust were widened across tiles, three times slower.

/// Eight rows.
pub type Pack = [f32; 8];
/// Eight rows by six columns, column after column.
pub type Tile = [Pack; 6];

/// `y += tiles x`, one tile a pack.
#[inline(always)]
pub(crate) fn add(tiles: &[Tile], x: &[f32; 6], y: &mut [Pack]) {
    for (t, y) in tiles.iter().zip(y) {
        for c in 0..6 {
            for k in 0..8 {
                y[k] += t[c][k] * x[c];
            }
        }
    }
}

/// Scalar products of the tiles' columns with `y`, last tile first.
#[inline(always)]
pub(crate) fn dots(tiles: &[Tile], y: &[Pack]) -> [f32; 6] {
    let mut sums = [[0.0; 8]; 6];
    for (t, y) in tiles.iter().zip(y).rev() {
        for c in 0..6 {
            for k in 0..8 {
                sums[c][k] += t[c][k] * y[k];
            }
        }
    }
    let mut out = [0.0; 6];
    for c in 0..6 {
        let s = &sums[c];
        out[c] = ((s[0] + s[1]) + (s[2] + s[3])) + ((s[4] + s[5]) + (s[6] + s[7]));
    }
    out
}

#[cfg(target_arch = "x86_64")]
pub(crate) mod avx2 {
    use super::{Pack, Tile};
    use std::arch::x86_64::*;

    /// See [`super::add`].
    #[inline(always)]
    pub(crate) fn add(tiles: &[Tile], x: &[f32; 6], y: &mut [Pack]) {
        // SAFETY: reached only from kernels that `dispatch` runs after it has detected AVX2 and FMA; each load and store covers one whole
        // array of eight.
        unsafe {
            let (x0, x1, x2) = (_mm256_set1_ps(x[0]), _mm256_set1_ps(x[1]), _mm256_set1_ps(x[2]));
            let (x3, x4, x5) = (_mm256_set1_ps(x[3]), _mm256_set1_ps(x[4]), _mm256_set1_ps(x[5]));
            for (t, y) in tiles.iter().zip(y) {
                let mut a = _mm256_loadu_ps(y.as_ptr());
                let mut b = _mm256_mul_ps(_mm256_loadu_ps(t[1].as_ptr()), x1);
                a = _mm256_fmadd_ps(_mm256_loadu_ps(t[0].as_ptr()), x0, a);
                b = _mm256_fmadd_ps(_mm256_loadu_ps(t[3].as_ptr()), x3, b);
                a = _mm256_fmadd_ps(_mm256_loadu_ps(t[2].as_ptr()), x2, a);
                b = _mm256_fmadd_ps(_mm256_loadu_ps(t[5].as_ptr()), x5, b);
                a = _mm256_fmadd_ps(_mm256_loadu_ps(t[4].as_ptr()), x4, a);
                _mm256_storeu_ps(y.as_mut_ptr(), _mm256_add_ps(a, b));
            }
        }
    }

    /// See [`super::dots`].
    #[inline(always)]
    pub(crate) fn dots(tiles: &[Tile], y: &[Pack]) -> [f32; 6] {
        let mut out = [0.0f32; 8];
        // SAFETY: as in `add`.
        unsafe {
            let zero = _mm256_setzero_ps();
            let (mut s0, mut s1, mut s2, mut s3, mut s4, mut s5) = (zero, zero, zero, zero, zero, zero);
            for (t, y) in tiles.iter().zip(y).rev() {
                let y = _mm256_loadu_ps(y.as_ptr());
                s0 = _mm256_fmadd_ps(_mm256_loadu_ps(t[0].as_ptr()), y, s0);
                s1 = _mm256_fmadd_ps(_mm256_loadu_ps(t[1].as_ptr()), y, s1);
                s2 = _mm256_fmadd_ps(_mm256_loadu_ps(t[2].as_ptr()), y, s2);
                s3 = _mm256_fmadd_ps(_mm256_loadu_ps(t[3].as_ptr()), y, s3);
                s4 = _mm256_fmadd_ps(_mm256_loadu_ps(t[4].as_ptr()), y, s4);
                s5 = _mm256_fmadd_ps(_mm256_loadu_ps(t[5].as_ptr()), y, s5);
            }
            let first = _mm256_hadd_ps(_mm256_hadd_ps(s0, s1), _mm256_hadd_ps(s2, s3));
            let last = _mm256_hadd_ps(s4, s5);
            let last = _mm256_hadd_ps(last, last);
            _mm_storeu_ps(
                out.as_mut_ptr(),
                _mm_add_ps(_mm256_castps256_ps128(first), _mm256_extractf128_ps::<1>(first)),
            );
            let last = _mm_add_ps(_mm256_castps256_ps128(last), _mm256_extractf128_ps::<1>(last));
            _mm_storeu_ps(out[4..].as_mut_ptr(), last);
        }
        [out[0], out[1], out[2], out[3], out[4], out[5]]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Isa, Kernel, Lanes, dispatch};

    struct Both<'a>(&'a [Tile], &'a [f32; 6], Vec<Pack>);

    impl Kernel for Both<'_> {
        type Output = (Vec<Pack>, [f32; 6]);
        #[inline(always)]
        fn run<L: Lanes>(mut self) -> Self::Output {
            let dots = L::tile_dots(self.0, &self.2);
            L::tile_add(self.0, self.1, &mut self.2);
            (self.2, dots)
        }
    }

    #[test]
    fn every_path_gives_the_product() {
        let number = |i: usize| ((i * 37 % 101) as f32 - 50.0) / 16.0;
        for n in [0, 1, 5] {
            let tiles: Vec<Tile> =
                (0..n).map(|b| std::array::from_fn(|c| std::array::from_fn(|k| number(48 * b + 8 * c + k)))).collect();
            let x: [f32; 6] = std::array::from_fn(|c| number(1000 + c));
            let y: Vec<Pack> = (0..n).map(|b| std::array::from_fn(|k| number(2000 + 8 * b + k))).collect();
            for isa in [Isa::Portable, Isa::Avx2, Isa::Avx512] {
                let (sum, dots) = dispatch(isa, Both(&tiles, &x, y.clone()));
                for b in 0..n {
                    for k in 0..8 {
                        let expected = y[b][k] + (0..6).map(|c| tiles[b][c][k] * x[c]).sum::<f32>();
                        assert!((sum[b][k] - expected).abs() < 1e-4, "{isa} {b} {k}");
                    }
                }
                for c in 0..6 {
                    let expected: f32 = (0..n).map(|b| (0..8).map(|k| tiles[b][c][k] * y[b][k]).sum::<f32>()).sum();
                    assert!((dots[c] - expected).abs() < 1e-3, "{isa} {c}: {} {expected}", dots[c]);
                }
            }
        }
    }
}
