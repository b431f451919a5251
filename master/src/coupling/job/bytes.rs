//! Numbers in messages between ranks, little-endian.

use crate::world::Broken;

/// Appends to a message.
#[derive(Debug)]
pub struct Packer<'b>(pub &'b mut Vec<u8>);

impl Packer<'_> {
    /// One byte.
    pub fn byte(&mut self, byte: u8) {
        self.0.push(byte);
    }

    /// A whole number.
    pub fn whole(&mut self, number: u64) {
        self.0.extend_from_slice(&number.to_le_bytes());
    }

    /// A real, to the bit.
    pub fn real(&mut self, x: f64) {
        self.0.extend_from_slice(&x.to_le_bytes());
    }

    /// Reals without their number.
    pub fn reals(&mut self, values: &[f64]) {
        self.0.reserve(8 * values.len());
        values.iter().for_each(|x| self.0.extend_from_slice(&x.to_le_bytes()));
    }

    /// Integers without their number.
    pub fn integers(&mut self, values: &[i32]) {
        self.0.reserve(4 * values.len());
        values.iter().for_each(|x| self.0.extend_from_slice(&x.to_le_bytes()));
    }

    /// Bytes with their number.
    pub fn bytes(&mut self, bytes: &[u8]) {
        self.whole(bytes.len() as u64);
        self.0.extend_from_slice(bytes);
    }
}

/// Takes a message apart. One that is too short is another program's: it is told, and nothing is read past its end.
#[derive(Debug)]
pub struct Unpacker<'b>(pub &'b [u8]);

fn short() -> Broken {
    Broken("a message that is too short: the ranks run different programs".into())
}

impl<'b> Unpacker<'b> {
    fn take(&mut self, count: usize) -> Result<&'b [u8], Broken> {
        let (head, tail) = self.0.split_at_checked(count).ok_or_else(short)?;
        self.0 = tail;
        Ok(head)
    }

    /// One byte.
    pub fn byte(&mut self) -> Result<u8, Broken> {
        Ok(self.take(1)?[0])
    }

    /// A whole number.
    pub fn whole(&mut self) -> Result<u64, Broken> {
        self.take(8)?.try_into().map(u64::from_le_bytes).map_err(|_| short())
    }

    /// A real.
    pub fn real(&mut self) -> Result<f64, Broken> {
        self.whole().map(f64::from_bits)
    }

    /// So many reals, put into `into`, whose length it becomes.
    pub fn reals(&mut self, count: usize, into: &mut Vec<f64>) -> Result<(), Broken> {
        let bytes = self.take(count.checked_mul(8).ok_or_else(short)?)?;
        into.clear();
        into.extend(bytes.as_chunks().0.iter().map(|b| f64::from_le_bytes(*b)));
        Ok(())
    }

    /// So many integers.
    pub fn integers(&mut self, count: usize, into: &mut Vec<i32>) -> Result<(), Broken> {
        let bytes = self.take(count.checked_mul(4).ok_or_else(short)?)?;
        into.clear();
        into.extend(bytes.as_chunks().0.iter().map(|b| i32::from_le_bytes(*b)));
        Ok(())
    }

    /// Bytes with their number.
    pub fn bytes(&mut self) -> Result<&'b [u8], Broken> {
        let count = self.whole()?;
        self.take(usize::try_from(count).map_err(|_| short())?)
    }

    /// What [`Packer::bytes`] was given as text.
    pub fn text(&mut self) -> Result<String, Broken> {
        Ok(String::from_utf8_lossy(self.bytes()?).into_owned())
    }
}
