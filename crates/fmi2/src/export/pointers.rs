//! What C hands over, checked: arrays, texts, paths.

use std::ffi::CStr;
use std::path::PathBuf;

use crate::LogCategory;
use crate::instance::Refused;
use crate::types::{FMI2_ERROR, Fmi2String};

pub(super) fn refuse(message: impl Into<String>) -> Refused {
    Refused { status: FMI2_ERROR, message: message.into(), category: LogCategory::Error }
}

/// A C array as a slice; null is allowed when empty.
///
/// # Safety
/// `p` is null or points to `n` elements that live as long as the call.
pub(super) unsafe fn slice<'a, T>(function: &str, name: &str, p: *const T, n: usize) -> Result<&'a [T], Refused> {
    match (n, p.is_null()) {
        (0, _) => Ok(&[]),
        (_, true) => Err(refuse(format!("{function}: '{name}' is a null pointer for {n} elements"))),
        // SAFETY: the caller's promise.
        _ => Ok(unsafe { std::slice::from_raw_parts(p, n) }),
    }
}

/// # Safety
/// As [`slice`], writable, not aliased.
pub(super) unsafe fn slice_mut<'a, T>(function: &str, name: &str, p: *mut T, n: usize) -> Result<&'a mut [T], Refused> {
    match (n, p.is_null()) {
        (0, _) => Ok(&mut []),
        (_, true) => Err(refuse(format!("{function}: '{name}' is a null pointer for {n} elements"))),
        // SAFETY: the caller's promise.
        _ => Ok(unsafe { std::slice::from_raw_parts_mut(p, n) }),
    }
}

/// The path of files, or the prefix of such, that a text names; `None` for null.
///
/// # Safety
/// As [`text`].
pub(super) unsafe fn path_of(function: &str, p: Fmi2String) -> Result<Option<PathBuf>, Refused> {
    if p.is_null() {
        return Ok(None);
    }
    // SAFETY: the caller's promise.
    let path = unsafe { text(p) }.map(PathBuf::from).filter(|p| p.is_absolute() && p.file_name().is_some());
    path.map(Some).ok_or_else(|| refuse(format!("{function}: what is given is no absolute path in UTF-8")))
}

/// # Safety
/// `p` is null or a zero-terminated string.
pub(super) unsafe fn text<'a>(p: Fmi2String) -> Option<&'a str> {
    if p.is_null() {
        return None;
    }
    // SAFETY: not null, zero-terminated by the caller's promise.
    unsafe { CStr::from_ptr(p) }.to_str().ok()
}

pub(super) fn copy_array<T: Copy>(function: &str, from: &[T], to: &mut [T]) -> Result<(), Refused> {
    if from.len() != to.len() {
        return Err(refuse(format!(
            "{function}: room for {} elements given; the array has {} now",
            to.len(),
            from.len()
        )));
    }
    to.copy_from_slice(from);
    Ok(())
}
