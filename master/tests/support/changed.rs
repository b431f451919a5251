//! Changes that make a hostile file of a good one, at random with a fixed seed.

/// Marsaglia's xorshift: the same changes on every machine.
pub struct Random(pub u64);

impl Random {
    /// A number from 0 to below this.
    pub fn next(&mut self, below: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 % below.max(1) as u64) as usize
    }
}

/// Text that upsets readers.
const NASTY: [&[u8]; 16] = [
    b"<",
    b">",
    b"\"",
    b"&#0;",
    b"&lt",
    b"]]>",
    b"<!DOCTYPE x [<!ENTITY a \"b\">]>",
    b"\xff\xfe",
    b"NaN",
    b"-1",
    b"1e999",
    b"99999999999999999999",
    b"..",
    b"\0",
    b"<a><a><a><a><a><a>",
    b"xmlns=",
];

/// A few changes: flipped bits, cuts, pieces doubled or moved, nasty text.
pub fn changed(good: &[u8], random: &mut Random) -> Vec<u8> {
    let mut bytes = good.to_vec();
    for _ in 0..=random.next(4) {
        let at = random.next(bytes.len());
        let length = random.next(60).min(bytes.len() - at);
        match random.next(6) {
            0 if !bytes.is_empty() => bytes[at] ^= 1 << random.next(8),
            1 => bytes.truncate(at),
            2 => drop(bytes.drain(at..at + length)),
            3 => {
                let piece = bytes[at..at + length].to_vec();
                let to = random.next(bytes.len());
                bytes.splice(to..to, piece);
            }
            4 => {
                let nasty = NASTY[random.next(NASTY.len())];
                bytes.splice(at..at, nasty.iter().copied());
            }
            // A number in quotes to another.
            _ => {
                if let Some(quote) = bytes[at..].iter().position(|b| *b == b'"').map(|n| at + n + 1) {
                    let nasty = NASTY[8 + random.next(4)];
                    let end = bytes[quote..].iter().position(|b| *b == b'"').map_or(quote, |n| quote + n);
                    bytes.splice(quote..end, nasty.iter().copied());
                }
            }
        }
    }
    bytes
}
