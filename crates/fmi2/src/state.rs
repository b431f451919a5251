//! The saved state of an instance: versioned, hashed bytes that move between machines.
//!
//! Layout: 8 bytes magic with the version, the body (postcard), 32 bytes SHA-256 over both.

use crate::UnitError;
use crate::values::Value;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

const MAGIC: &[u8; 8] = b"TMSTATE1";

/// What is saved of an instance.
#[derive(Serialize, Deserialize)]
pub(crate) struct Saved {
    pub guid: String,
    pub stage: u8,
    pub time: f64,
    /// `None` for variables that are not part of a state (threads, paths).
    pub values: Vec<Option<Value>>,
    pub locked: Vec<bool>,
    pub unit: Vec<u8>,
}

/// Wraps a body with magic and hash: for files of units too (a settled bed).
pub fn seal(magic: &[u8; 8], body: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(body.len() + 40);
    bytes.extend_from_slice(magic);
    bytes.extend_from_slice(body);
    let hash = Sha256::digest(&bytes);
    bytes.extend_from_slice(&hash);
    bytes
}

/// Checks and unwraps sealed bytes.
///
/// # Errors
/// [`UnitError::State`]: another kind or version, cut short, damaged.
pub fn open<'a>(magic: &[u8; 8], bytes: &'a [u8]) -> Result<&'a [u8], UnitError> {
    if bytes.len() < 40 {
        return Err(UnitError::state(format!("{} bytes are too few; it was cut short", bytes.len())));
    }
    if bytes[..7] != magic[..7] {
        return Err(UnitError::state("these bytes are something else (wrong magic number)"));
    }
    if bytes[7] != magic[7] {
        return Err(UnitError::state(format!(
            "version '{}' is not the version '{}' of this program",
            char::from(bytes[7]).escape_default(),
            char::from(magic[7])
        )));
    }
    let (body, hash) = bytes.split_at(bytes.len() - 32);
    if Sha256::digest(body)[..] != *hash {
        return Err(UnitError::state("its hash does not match: cut short or damaged"));
    }
    Ok(&body[8..])
}

pub(crate) fn encode(saved: &Saved) -> Result<Vec<u8>, UnitError> {
    let body = postcard::to_stdvec(saved).map_err(|e| UnitError::state(format!("cannot be written: {e}")))?;
    Ok(seal(MAGIC, &body))
}

pub(crate) fn decode(bytes: &[u8], guid: &str) -> Result<Saved, UnitError> {
    let body = open(MAGIC, bytes)?;
    let saved: Saved = postcard::from_bytes(body).map_err(|e| UnitError::state(format!("cannot be read: {e}")))?;
    if saved.guid != guid {
        return Err(UnitError::state(format!("it belongs to model {}, this is {guid}", saved.guid)));
    }
    Ok(saved)
}

/// A unit's own state to bytes: serde through postcard. Reals keep their bits.
///
/// # Errors
/// [`UnitError::State`].
pub fn to_bytes<T: Serialize>(value: &T) -> Result<Vec<u8>, UnitError> {
    postcard::to_stdvec(value).map_err(|e| UnitError::state(format!("cannot be written: {e}")))
}

/// The reverse of [`to_bytes`].
///
/// # Errors
/// [`UnitError::State`].
pub fn from_bytes<'a, T: Deserialize<'a>>(bytes: &'a [u8]) -> Result<T, UnitError> {
    postcard::from_bytes(bytes).map_err(|e| UnitError::state(format!("cannot be read: {e}")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sealed_bytes_tell_what_is_wrong() {
        let sealed = seal(b"TMTEST_1", b"body");
        assert_eq!(open(b"TMTEST_1", &sealed).unwrap(), b"body");
        assert!(open(b"TMTEST_2", &sealed).unwrap_err().to_string().contains("version"));
        assert!(open(b"TMOTHER1", &sealed).unwrap_err().to_string().contains("magic"));
        assert!(open(b"TMTEST_1", &sealed[..20]).unwrap_err().to_string().contains("cut short"));
        let mut bad = sealed.clone();
        bad[9] ^= 1;
        assert!(open(b"TMTEST_1", &bad).unwrap_err().to_string().contains("hash"));
    }
}
