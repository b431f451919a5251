//! Two passes over one array in one sweep: a reading pass that looks ahead, and a writing pass right behind it.
//!
//! An array is cut into *slabs*, and slabs into *regions*. Reading slab k looks at its own entries and at the first
//! entries of slab k + 1, its halo; writing slab k changes its own entries. So, in a region, slab k may be written as soon as it
//! has been read, while it is still in the cache: nothing reads it any more. Only the first slab of a region waits: the
//! region before still looks at it as a halo. Regions may run at the same time.

use std::marker::PhantomData;
use std::ops::Range;

/// Where a slab lies in the array.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Cut {
    /// First entry.
    pub first: usize,
    /// After its last entry: where the next slab begins.
    pub last: usize,
    /// After the last entry of its halo: in the next slab, or at its end.
    pub halo: usize,
}

/// A region of an array: see the module. Made by [`regions`].
pub struct Region<'a, T> {
    base: *mut T,
    cuts: &'a [Cut],
    slabs: Range<usize>,
    array: PhantomData<&'a mut [T]>,
}

// SAFETY: a region reads its own slabs and the halo behind them, and writes its own slabs but for the first. The halo is part of
// the next region's first slab, which that region does not write. So regions on different threads never meet in an entry that
// one of them writes. T goes to another thread by reference and by value.
unsafe impl<T: Send + Sync> Send for Region<'_, T> {}

impl<T> Region<'_, T> {
    /// Its slabs.
    pub fn slabs(&self) -> Range<usize> {
        self.slabs.clone()
    }

    /// For each of its slabs in order: `read` with the entries of slab and halo, then `write` with its entries. The first slab of
    /// the region is not written: that is the caller's to do once all regions have run.
    pub fn sweep<S>(
        self,
        state: &mut S,
        mut read: impl FnMut(&mut S, usize, &[T]),
        mut write: impl FnMut(&mut S, usize, &mut [T]),
    ) {
        for k in self.slabs.clone() {
            let Cut { first, last, halo } = self.cuts[k];
            // SAFETY: `regions` has checked the cuts against the array, which this region borrows. No exclusive reference into the
            // range exists: ours have ended, and other regions' do not reach it (see above).
            read(state, k, unsafe { std::slice::from_raw_parts(self.base.add(first), halo - first) });
            if k > self.slabs.start {
                // SAFETY: as above; the shared reference has ended, and slab k is no other region's, nor its halo, since it is not
                // the first of this one.
                write(state, k, unsafe { std::slice::from_raw_parts_mut(self.base.add(first), last - first) });
            }
        }
    }
}

/// Cuts an array's slabs into regions: `starts` are the first slabs of the regions, ascending, from 0.
///
/// # Panics
/// Where the cuts do not lie one behind the other in the array with halos inside the next slab, or the starts do not
/// ascend from 0: a caller's mistake.
pub fn regions<'a, T>(array: &'a mut [T], cuts: &'a [Cut], starts: &[usize]) -> Vec<Region<'a, T>> {
    let mut end = 0;
    for (k, cut) in cuts.iter().enumerate() {
        let reach = cuts.get(k + 1).map_or(cut.last, |next| next.last);
        let sound = cut.first == end && cut.first <= cut.last && cut.last <= cut.halo && cut.halo <= reach;
        assert!(sound && reach <= array.len(), "slab {k} of {} entries: {cut:?}", array.len());
        end = cut.last;
    }
    assert!(starts.first().is_none_or(|&s| s == 0) && starts.windows(2).all(|w| w[0] < w[1]), "regions {starts:?}");
    assert!(starts.last().is_none_or(|&s| s < cuts.len()), "regions {starts:?} of {} slabs", cuts.len());
    let base = array.as_mut_ptr();
    let ends = starts.iter().skip(1).copied().chain([cuts.len()]);
    starts.iter().zip(ends).map(|(&s, e)| Region { base, cuts, slabs: s..e, array: PhantomData }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cuts(n: usize) -> Vec<Cut> {
        (0..n).map(|k| Cut { first: 4 * k, last: 4 * k + 4, halo: (4 * k + 6).min(4 * n) }).collect()
    }

    #[test]
    fn readers_see_what_was_there_before_whatever_the_regions() {
        let cuts = cuts(7);
        for starts in [vec![0], vec![0, 1, 2, 3, 4, 5, 6], vec![0, 3, 5]] {
            let mut array: Vec<u64> = (0..28).collect();
            let mut read = vec![0; 7];
            for region in regions(&mut array, &cuts, &starts) {
                region.sweep(&mut read, |read, k, a| read[k] = a.iter().sum(), |_, _, a| a.fill(1000));
            }
            for &s in &starts {
                array[cuts[s].first..cuts[s].last].fill(1000);
            }
            let expected: Vec<u64> = cuts.iter().map(|c| (c.first as u64..c.halo as u64).sum()).collect();
            assert_eq!(read, expected, "{starts:?}");
            assert!(array.iter().all(|&x| x == 1000));
        }
    }

    #[test]
    #[should_panic(expected = "slab 1")]
    fn a_halo_beyond_the_next_slab_is_refused() {
        let mut cuts = cuts(4);
        cuts[1].halo = 13;
        regions(&mut [0; 16], &cuts, &[0]);
    }
}
