//! The same calls with nothing around them: the floor that a benchmark of the master compares with.

use terramech_fmi2::types::{FMI2_OK, FMI2_TRUE};

use super::Instance;

/// One unit of the loop: what is read of it and set in it, one call each a step.
#[derive(Debug)]
struct Part {
    instance: Instance,
    reads: Vec<u32>,
    read: Vec<f64>,
    sets: Vec<u32>,
    set: Vec<f64>,
    /// Arrays read and set, by value reference.
    read_array: Option<(u32, Vec<f64>)>,
    set_array: Option<u32>,
}

/// Units that run in a loop of bare calls through function pointers, with values copied between them.
#[derive(Debug, Default)]
pub struct BareLoop {
    parts: Vec<Part>,
    /// From unit and place to unit and place.
    copies: Vec<(usize, usize, usize, usize)>,
    /// From unit to unit.
    array_copies: Vec<(usize, usize)>,
}

impl BareLoop {
    /// Adds a unit that has left initialisation mode, with the Reals that are read and set.
    pub fn unit(&mut self, instance: Instance, reads: Vec<u32>, sets: Vec<u32>, arrays: (Option<u32>, Option<u32>)) {
        let (read, set) = (vec![0.0; reads.len()], vec![0.0; sets.len()]);
        let read_array = arrays.0.map(|reference| (reference, Vec::new()));
        self.parts.push(Part { instance, reads, read, sets, set, read_array, set_array: arrays.1 });
    }

    /// Copies read value `i` of unit `a` to set value `j` of unit `b`.
    pub fn copy(&mut self, a: usize, i: usize, b: usize, j: usize) {
        self.copies.push((a, i, b, j));
    }

    /// Copies the array of unit `a` to unit `b`.
    pub fn copy_array(&mut self, a: usize, b: usize) {
        self.array_copies.push((a, b));
    }

    /// One step of `size` (s) from `time` for all units; `false` if a call did not return fmi2OK.
    pub fn step(&mut self, time: f64, size: f64) -> bool {
        let mut worst = FMI2_OK;
        for p in &mut self.parts {
            let (f, c) = (&p.instance.library.functions, p.instance.component.as_ptr());
            if !p.reads.is_empty() {
                // SAFETY: both arrays have as many elements as the call is told.
                worst |= unsafe { (f.get_real)(c, p.reads.as_ptr(), p.reads.len(), p.read.as_mut_ptr()) };
            }
            if let (Some((reference, values)), Some(size_of), Some(get)) =
                (&mut p.read_array, f.get_array_size, f.get_real_array)
            {
                let mut n = 0;
                // SAFETY: the size goes to our stack; the buffer then has as many elements.
                unsafe {
                    worst |= size_of(c, *reference, &raw mut n);
                    values.resize(n, 0.0);
                    worst |= get(c, *reference, values.as_mut_ptr(), n);
                }
            }
        }
        for &(a, i, b, j) in &self.copies {
            self.parts[b].set[j] = self.parts[a].read[i];
        }
        for &(a, b) in &self.array_copies {
            let (Some((_, values)), Some(reference)) = (&self.parts[a].read_array, self.parts[b].set_array) else {
                continue;
            };
            let to = &self.parts[b].instance;
            if let Some(set) = to.library.functions.set_real_array {
                // SAFETY: pointer and length belong together.
                worst |= unsafe { set(to.component.as_ptr(), reference, values.as_ptr(), values.len()) };
            }
        }
        for p in &self.parts {
            let (f, c) = (&p.instance.library.functions, p.instance.component.as_ptr());
            // SAFETY: both arrays have as many elements as the call is told; a step has no pointers but the component.
            unsafe {
                if !p.sets.is_empty() {
                    worst |= (f.set_real)(c, p.sets.as_ptr(), p.sets.len(), p.set.as_ptr());
                }
                worst |= (f.do_step)(c, time, size, FMI2_TRUE);
            }
        }
        worst == FMI2_OK
    }
}
