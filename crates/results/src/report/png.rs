//! Pictures of coloured indices as PNG (ISO/IEC 15948): for beds with too many grains to draw one by one.

use flate2::write::ZlibEncoder;
use flate2::{Compression, Crc};
use std::io::{self, Write};

/// A PNG of `width` x `height` palette indices, row by row from the top; index 0 is transparent.
pub(super) fn encode(width: u32, height: u32, indices: &[u8], palette: &[[u8; 3]]) -> io::Result<Vec<u8>> {
    let mut rows = ZlibEncoder::new(Vec::new(), Compression::best());
    for row in indices.chunks(width.max(1) as usize) {
        // Filter "none": differences of palette indices mean nothing.
        rows.write_all(&[0])?;
        rows.write_all(row)?;
    }
    let mut head = Vec::new();
    head.extend_from_slice(&width.to_be_bytes());
    head.extend_from_slice(&height.to_be_bytes());
    // 8 bits, palette, the one compression and filter method there is, not interlaced.
    head.extend_from_slice(&[8, 3, 0, 0, 0]);
    let mut out = b"\x89PNG\r\n\x1a\n".to_vec();
    chunk(&mut out, b"IHDR", &head);
    chunk(&mut out, b"PLTE", palette.as_flattened());
    chunk(&mut out, b"tRNS", &[0]);
    chunk(&mut out, b"IDAT", &rows.finish()?);
    chunk(&mut out, b"IEND", &[]);
    Ok(out)
}

/// A PNG of `width` x `height` pixels of red, green and blue, row by row from the top.
pub(super) fn encode_rgb(width: u32, height: u32, rgb: &[u8]) -> io::Result<Vec<u8>> {
    let mut rows = ZlibEncoder::new(Vec::new(), Compression::default());
    for row in rgb.chunks(3 * width.max(1) as usize) {
        // Filter "sub": neighbours are alike.
        let mut out = vec![1];
        out.extend(row.iter().enumerate().map(|(k, v)| v.wrapping_sub(if k >= 3 { row[k - 3] } else { 0 })));
        rows.write_all(&out)?;
    }
    let mut head = Vec::new();
    head.extend_from_slice(&width.to_be_bytes());
    head.extend_from_slice(&height.to_be_bytes());
    // 8 bits, red green blue.
    head.extend_from_slice(&[8, 2, 0, 0, 0]);
    let mut out = b"\x89PNG\r\n\x1a\n".to_vec();
    chunk(&mut out, b"IHDR", &head);
    chunk(&mut out, b"IDAT", &rows.finish()?);
    chunk(&mut out, b"IEND", &[]);
    Ok(out)
}

fn chunk(out: &mut Vec<u8>, kind: &[u8; 4], data: &[u8]) {
    out.extend_from_slice(&(data.len() as u32).to_be_bytes());
    let mut crc = Crc::new();
    crc.update(kind);
    crc.update(data);
    out.extend_from_slice(kind);
    out.extend_from_slice(data);
    out.extend_from_slice(&crc.sum().to_be_bytes());
}
