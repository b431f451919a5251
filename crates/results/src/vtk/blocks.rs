//! One data array as VTK stores it: cut into blocks, each compressed by zlib, after a header of 64-bit words
//! (number of blocks, block size, size of the last block when it is not full, compressed size of each block).

use flate2::Compression;
use flate2::write::ZlibEncoder;
use std::io::{self, Write};

/// Uncompressed size of a block (bytes): a multiple of 8, small enough for the reader's caches.
pub(super) const BLOCK: usize = 1 << 18;

/// Appends `bytes`, compressed, to `out`.
pub(super) fn append(out: &mut Vec<u8>, bytes: &[u8]) -> io::Result<()> {
    let count = bytes.len().div_ceil(BLOCK);
    let words = [count as u64, BLOCK as u64, (bytes.len() % BLOCK) as u64];
    let sizes_at = out.len() + 8 * words.len();
    out.extend(words.iter().flat_map(|w| w.to_le_bytes()));
    out.resize(sizes_at + 8 * count, 0);
    for (i, block) in bytes.chunks(BLOCK).enumerate() {
        let start = out.len();
        // Level 1: higher levels cost several times the time for a few per cent on particle data.
        let mut encoder = ZlibEncoder::new(&mut *out, Compression::fast());
        encoder.write_all(block)?;
        encoder.finish()?;
        let size = (out.len() - start) as u64;
        out[sizes_at + 8 * i..sizes_at + 8 * (i + 1)].copy_from_slice(&size.to_le_bytes());
    }
    Ok(())
}
