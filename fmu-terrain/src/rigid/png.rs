//! Reading grey PNG pictures (ISO/IEC 15948): 8 and 16 bits, with or without alpha (which is left out), not interlaced.
//!
//! Written out here since height maps need only this much of the format; colour, palette and interlaced pictures are refused with a word on how
//! to save them.

use flate2::read::ZlibDecoder;
use std::io::Read;

/// A grey picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Grey {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Values from 0 (black) to 1 (white), row by row from the top.
    pub values: Vec<f64>,
}

/// Decodes a picture.
///
/// # Errors
/// What was found, and what is allowed.
pub fn grey(bytes: &[u8]) -> Result<Grey, String> {
    let mut rest = bytes.strip_prefix(b"\x89PNG\r\n\x1a\n").ok_or("is no PNG: its signature is missing")?;
    let (mut head, mut packed) = (None, Vec::new());
    loop {
        if rest.len() < 12 {
            return Err("ends within the picture".into());
        }
        let n = u32::from_be_bytes([rest[0], rest[1], rest[2], rest[3]]) as usize;
        let kind = [rest[4], rest[5], rest[6], rest[7]];
        let data = rest.get(8..8 + n).ok_or("ends within the picture")?;
        match &kind {
            b"IHDR" => head = Some(header(data)?),
            b"IDAT" => packed.extend_from_slice(data),
            b"IEND" => break,
            _ => {}
        }
        // The checksum is left to the compression's own.
        rest = rest.get(12 + n..).ok_or("ends within the picture")?;
    }
    let (width, height, depth, channels) = head.ok_or("has no header")?;
    let pixel = channels * depth / 8;
    let row = width * pixel;
    let size = (row + 1) * height;
    let mut raw = Vec::new();
    ZlibDecoder::new(&packed[..])
        .take(size as u64 + 1)
        .read_to_end(&mut raw)
        .map_err(|e| format!("its data cannot be unpacked: {e}"))?;
    if raw.len() != size {
        return Err(format!("has {} bytes of picture, allowed for {width} x {height}: {size}", raw.len()));
    }
    let mut above = vec![0u8; row];
    let mut values = Vec::with_capacity(width * height);
    for line in raw.chunks_exact_mut(row + 1) {
        let (filter, line) = (line[0], &mut line[1..]);
        unfilter(filter, line, &above, pixel)?;
        for p in line.chunks_exact(pixel) {
            values.push(if depth == 16 {
                f64::from(u16::from_be_bytes([p[0], p[1]])) / 65535.0
            } else {
                f64::from(p[0]) / 255.0
            });
        }
        above.copy_from_slice(line);
    }
    Ok(Grey { width, height, values })
}

/// Width, height, bits, channels.
fn header(data: &[u8]) -> Result<(usize, usize, usize, usize), String> {
    if data.len() != 13 {
        return Err(format!("has a header of {} bytes, allowed: 13", data.len()));
    }
    let number = |k: usize| u32::from_be_bytes([data[k], data[k + 1], data[k + 2], data[k + 3]]) as usize;
    let (width, height, depth, colour, interlace) = (number(0), number(4), data[8], data[9], data[12]);
    if width == 0 || height == 0 || width.saturating_mul(height) > 100_000_000 {
        return Err(format!("is {width} x {height}; allowed: up to 100 million points"));
    }
    let channels = match colour {
        0 => 1,
        4 => 2,
        other => {
            let what = ["", "", "RGB", "palette", "", "", "RGB with alpha"].get(other as usize).unwrap_or(&"unknown");
            return Err(format!(
                "is of colour type {other} ({what}); allowed: grey, so convert it to 8- or 16-bit grey"
            ));
        }
    };
    if !matches!(depth, 8 | 16) {
        return Err(format!("has {depth} bits per value; allowed: 8 or 16"));
    }
    if interlace != 0 {
        return Err("is interlaced; allowed: not interlaced".into());
    }
    Ok((width, height, depth as usize, channels))
}

fn unfilter(filter: u8, line: &mut [u8], above: &[u8], pixel: usize) -> Result<(), String> {
    for k in 0..line.len() {
        let a = if k >= pixel { line[k - pixel] } else { 0 };
        let b = above[k];
        let c = if k >= pixel { above[k - pixel] } else { 0 };
        let guess = match filter {
            0 => 0,
            1 => a,
            2 => b,
            3 => ((u16::from(a) + u16::from(b)) / 2) as u8,
            4 => {
                let (pa, pb) = (i16::from(b) - i16::from(c), i16::from(a) - i16::from(c));
                let pc = (pa + pb).abs();
                let (pa, pb) = (pa.abs(), pb.abs());
                if pa <= pb && pa <= pc {
                    a
                } else if pb <= pc {
                    b
                } else {
                    c
                }
            }
            other => return Err(format!("has a row with filter {other}; allowed: 0 to 4")),
        };
        line[k] = line[k].wrapping_add(guess);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use flate2::{Compression, write::ZlibEncoder};
    use std::io::Write;

    fn png(width: u32, depth: u8, colour: u8, rows: &[&[u8]]) -> Vec<u8> {
        let mut z = ZlibEncoder::new(Vec::new(), Compression::fast());
        rows.iter().for_each(|r| z.write_all(r).unwrap());
        let mut head = width.to_be_bytes().to_vec();
        head.extend((rows.len() as u32).to_be_bytes());
        head.extend([depth, colour, 0, 0, 0]);
        let mut out = b"\x89PNG\r\n\x1a\n".to_vec();
        for (kind, data) in [(b"IHDR", head), (b"IDAT", z.finish().unwrap()), (b"IEND", Vec::new())] {
            out.extend((data.len() as u32).to_be_bytes());
            out.extend(kind);
            out.extend(&data);
            out.extend([0; 4]);
        }
        out
    }

    #[test]
    fn every_filter_and_both_depths() {
        // Each row decodes to 10, 20, 40.
        let rows: [&[u8]; 5] = [&[0, 10, 20, 40], &[1, 10, 10, 20], &[2, 0, 0, 0], &[3, 5, 5, 10], &[4, 0, 0, 0]];
        let g = grey(&png(3, 8, 0, &rows)).unwrap();
        assert_eq!((g.width, g.height), (3, 5));
        for row in g.values.chunks(3) {
            assert_eq!(row, [10.0 / 255.0, 20.0 / 255.0, 40.0 / 255.0]);
        }
        let g = grey(&png(1, 16, 4, &[&[0, 0x80, 0x00, 0xff, 0xff]])).unwrap();
        assert_eq!(g.values, [32768.0 / 65535.0]);
    }

    #[test]
    fn what_is_no_grey_picture_is_told() {
        assert!(grey(b"GIF89a").unwrap_err().contains("no PNG"));
        assert!(grey(&png(1, 8, 2, &[&[0, 1, 2, 3]])).unwrap_err().contains("RGB"));
        assert!(grey(&png(1, 4, 0, &[&[0, 1]])).unwrap_err().contains("4 bits"));
        assert!(grey(&png(9, 8, 0, &[&[0, 1]])).unwrap_err().contains("bytes of picture"));
        let whole = png(1, 8, 0, &[&[0, 1]]);
        assert!(grey(&whole[..whole.len() - 20]).is_err());
    }
}
