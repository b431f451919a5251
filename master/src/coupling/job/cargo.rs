//! The outputs of a unit that another rank needs, in messages.

use super::bytes::{Packer, Unpacker};
use crate::coupling::connect::Links;
use crate::loading::{Class, Outputs, Slot};
use crate::world::Broken;

/// Some outputs of one unit. Both ranks make it from the same plan, so that a message holds values and nothing else.
#[derive(Clone, Debug, Default)]
pub struct Cargo {
    /// The unit.
    pub unit: usize,
    reals: Vec<usize>,
    integers: Vec<usize>,
    booleans: Vec<usize>,
    strings: Vec<usize>,
    real_arrays: Vec<usize>,
    integer_arrays: Vec<usize>,
}

impl Cargo {
    /// What of `links` the units of rank `to` need from those of rank `from`, by unit.
    pub fn between(links: &Links, owner: &[usize], from: usize, to: usize) -> Vec<Self> {
        let mut cargos: Vec<Self> = (0..owner.len()).map(|unit| Self { unit, ..Self::default() }).collect();
        for (target, source, slot) in links.needs() {
            if owner[source] == from && owner[target] == to {
                cargos[source].add(slot);
            }
        }
        cargos.retain_mut(|c| !c.is_empty());
        cargos.iter_mut().for_each(Self::sort);
        cargos
    }

    /// All of these outputs.
    pub fn whole(unit: usize, outputs: &Outputs) -> Self {
        Self {
            unit,
            reals: (0..outputs.reals.values.len()).collect(),
            integers: (0..outputs.integers.values.len()).collect(),
            booleans: (0..outputs.booleans.values.len()).collect(),
            strings: (0..outputs.strings.values.len()).collect(),
            real_arrays: (0..outputs.real_arrays.len()).collect(),
            integer_arrays: (0..outputs.integer_arrays.len()).collect(),
        }
    }

    fn add(&mut self, slot: Slot) {
        match slot {
            Slot::Scalar(Class::Real, i) => self.reals.push(i),
            Slot::Scalar(Class::Integer, i) => self.integers.push(i),
            Slot::Scalar(Class::Boolean, i) => self.booleans.push(i),
            Slot::Scalar(Class::String, i) => self.strings.push(i),
            Slot::RealArray(i) => self.real_arrays.push(i),
            Slot::IntegerArray(i) => self.integer_arrays.push(i),
        }
    }

    fn lists(&mut self) -> [&mut Vec<usize>; 6] {
        [
            &mut self.reals,
            &mut self.integers,
            &mut self.booleans,
            &mut self.strings,
            &mut self.real_arrays,
            &mut self.integer_arrays,
        ]
    }

    fn is_empty(&mut self) -> bool {
        self.lists().iter().all(|l| l.is_empty())
    }

    fn sort(&mut self) {
        for list in self.lists() {
            list.sort_unstable();
            list.dedup();
        }
    }

    /// Appends the values.
    pub fn pack(&self, outputs: &Outputs, to: &mut Packer<'_>) {
        self.reals.iter().for_each(|&i| to.real(outputs.reals.values[i]));
        self.integers.iter().for_each(|&i| to.integers(&[outputs.integers.values[i]]));
        self.booleans.iter().for_each(|&i| to.integers(&[outputs.booleans.values[i]]));
        self.strings.iter().for_each(|&i| to.bytes(outputs.strings.values[i].as_bytes()));
        for &i in &self.real_arrays {
            let values = &outputs.real_arrays[i].values;
            to.whole(values.len() as u64);
            to.reals(values);
        }
        for &i in &self.integer_arrays {
            let values = &outputs.integer_arrays[i].values;
            to.whole(values.len() as u64);
            to.integers(values);
        }
    }

    /// Takes them.
    pub fn unpack(&self, outputs: &mut Outputs, from: &mut Unpacker<'_>) -> Result<(), Broken> {
        for &i in &self.reals {
            outputs.reals.values[i] = from.real()?;
        }
        let mut one = Vec::with_capacity(1);
        for &i in &self.integers {
            from.integers(1, &mut one)?;
            outputs.integers.values[i] = one[0];
        }
        for &i in &self.booleans {
            from.integers(1, &mut one)?;
            outputs.booleans.values[i] = one[0];
        }
        for &i in &self.strings {
            outputs.strings.values[i] = from.text()?;
        }
        for &i in &self.real_arrays {
            let count = from.whole()? as usize;
            from.reals(count, &mut outputs.real_arrays[i].values)?;
        }
        for &i in &self.integer_arrays {
            let count = from.whole()? as usize;
            from.integers(count, &mut outputs.integer_arrays[i].values)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model_description::Kind;

    #[test]
    fn values_of_every_kind_arrive() {
        let make = || {
            let mut outputs = Outputs::default();
            for (class, reference) in
                [(Class::Real, 1), (Class::Real, 2), (Class::Integer, 3), (Class::Boolean, 4), (Class::String, 5)]
            {
                outputs.scalar(class, reference, reference as usize);
            }
            outputs.array(Kind::Real, 6, 0);
            outputs.array(Kind::Integer, 7, 1);
            outputs
        };
        let (mut here, mut there) = (make(), make());
        here.reals.values = vec![-0.0, f64::MIN_POSITIVE / 3.0];
        here.integers.values[0] = -7;
        here.booleans.values[0] = 1;
        here.strings.values[0] = "Grüße".into();
        here.real_arrays[0].values = vec![1.5; 7];
        here.integer_arrays[0].values = vec![3, -4];
        let cargo = Cargo::whole(0, &here);
        let mut bytes = Vec::new();
        cargo.pack(&here, &mut Packer(&mut bytes));
        cargo.unpack(&mut there, &mut Unpacker(&bytes)).unwrap();
        assert_eq!(
            there.reals.values.iter().map(|x| x.to_bits()).collect::<Vec<_>>(),
            here.reals.values.iter().map(|x| x.to_bits()).collect::<Vec<_>>()
        );
        assert_eq!(
            (&there.integers.values, &there.booleans.values, &there.strings.values),
            (&here.integers.values, &here.booleans.values, &here.strings.values)
        );
        assert_eq!(there.real_arrays[0].values, here.real_arrays[0].values);
        assert_eq!(there.integer_arrays[0].values, here.integer_arrays[0].values);
        for cut in 0..bytes.len() {
            assert!(cargo.unpack(&mut there, &mut Unpacker(&bytes[..cut])).is_err(), "{cut}");
        }
    }
}
