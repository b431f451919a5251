//! The text of an XML file: UTF-8, UTF-16 with a byte order mark, ISO 8859-1 and US-ASCII where declared.

use std::borrow::Cow;

/// Decodes the bytes of a file.
///
/// # Errors
/// Why they are no text in an encoding that is read.
pub fn decode(bytes: &[u8]) -> Result<Cow<'_, str>, String> {
    match bytes {
        [0xEF, 0xBB, 0xBF, rest @ ..] => utf8(rest),
        [0xFF, 0xFE, rest @ ..] => utf16(rest, u16::from_le_bytes),
        [0xFE, 0xFF, rest @ ..] => utf16(rest, u16::from_be_bytes),
        _ => match declared(bytes) {
            Some(name) if name.eq_ignore_ascii_case("utf-8") || name.eq_ignore_ascii_case("us-ascii") => utf8(bytes),
            // In ISO 8859-1 each byte is the code point; Windows-1252 differs in control characters only.
            Some(name) if name.eq_ignore_ascii_case("iso-8859-1") || name.eq_ignore_ascii_case("windows-1252") => {
                Ok(Cow::Owned(bytes.iter().map(|&b| char::from(b)).collect()))
            }
            Some(name) => Err(format!("encoding \"{name}\" is not read; allowed: UTF-8, UTF-16, ISO-8859-1")),
            None => utf8(bytes),
        },
    }
}

fn utf8(bytes: &[u8]) -> Result<Cow<'_, str>, String> {
    std::str::from_utf8(bytes).map(Cow::Borrowed).map_err(|e| {
        format!("byte {} is not UTF-8, though the file says or implies that encoding", e.valid_up_to() + 1)
    })
}

fn utf16(bytes: &[u8], unit: fn([u8; 2]) -> u16) -> Result<Cow<'static, str>, String> {
    let units = bytes.chunks_exact(2).map(|pair| unit([pair[0], pair[1]]));
    let text: Result<String, _> = char::decode_utf16(units).collect();
    match text {
        Ok(text) if bytes.len().is_multiple_of(2) => Ok(Cow::Owned(text)),
        _ => Err("the text is not UTF-16, though its byte order mark says so".into()),
    }
}

/// The encoding named in the XML declaration, if there is one.
fn declared(bytes: &[u8]) -> Option<String> {
    let head = &bytes[..bytes.len().min(200)];
    let head: String = head.iter().map(|&b| char::from(b)).collect();
    let declaration = head.strip_prefix("<?xml")?.split("?>").next()?;
    let after = declaration.split_once("encoding")?.1.trim_start().strip_prefix('=')?.trim_start();
    let quote = after.chars().next().filter(|c| matches!(c, '"' | '\''))?;
    after[1..].split(quote).next().map(str::to_owned)
}
