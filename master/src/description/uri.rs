//! `source` URIs to paths.

use std::path::{Component, Path, PathBuf};

/// Where a source may be looked for.
#[derive(Clone, Copy, Debug)]
pub struct Roots<'p> {
    /// The folder of the file that holds the URI.
    pub base: &'p Path,
    /// The unpacked archive that the file lies in: its URIs may not lead out of it.
    pub archive: Option<&'p Path>,
    /// Folders searched for bare names.
    pub search: &'p [PathBuf],
}

/// The existing path that a URI leads to.
///
/// Relative URIs count from the file that holds them; a bare name is then searched along [`Roots::search`]. `file:` URIs and
/// percent-encoding are understood; a name that exists as written wins over its decoded form.
///
/// # Errors
/// The paths that were tried, or why the URI is refused, in words.
pub fn find(uri: &str, roots: Roots<'_>) -> Result<PathBuf, String> {
    let text = match uri.split_once(':') {
        Some((scheme, rest)) if scheme.eq_ignore_ascii_case("file") => file_path(rest)?,
        // One letter is a drive.
        Some((scheme, _))
            if scheme.len() > 1 && scheme.chars().all(|c| c.is_ascii_alphanumeric() || "+-.".contains(c)) =>
        {
            return Err(format!("nothing: only relative paths and file: URIs are followed, not \"{scheme}:\""));
        }
        _ => uri,
    };
    if text.is_empty() || text.contains('\0') {
        return Err("nothing: the URI names no file".into());
    }
    let decoded = percent_decoded(text);
    let mut tried = Vec::new();
    for name in [Some(text), decoded.as_deref()].into_iter().flatten() {
        let path = roots.base.join(name);
        if let Some(archive) = roots.archive
            && !stays_inside(&path, archive)
        {
            return Err("nothing: a file inside an archive may only name files of the archive".into());
        }
        if path.exists() {
            return Ok(path);
        }
        tried.push(path);
        if Path::new(name).components().count() == 1 {
            for folder in roots.search {
                let path = folder.join(name);
                if path.exists() {
                    return Ok(path);
                }
                tried.push(path);
            }
        }
    }
    Err(tried.iter().map(|path| path.display().to_string()).collect::<Vec<_>>().join(", "))
}

/// The path part of what follows `file:`.
fn file_path(rest: &str) -> Result<&str, String> {
    match rest.strip_prefix("//") {
        None => Ok(rest),
        Some(rest) => {
            let (host, _) = rest.split_once('/').unwrap_or((rest, ""));
            if host.is_empty() || host.eq_ignore_ascii_case("localhost") {
                Ok(&rest[host.len()..])
            } else {
                Err(format!("nothing: files of the machine \"{host}\" are not fetched"))
            }
        }
    }
}

/// Percent-decoded text; `None` where there is nothing to decode or the result is no text.
fn percent_decoded(text: &str) -> Option<String> {
    if !text.contains('%') {
        return None;
    }
    let bytes = text.as_bytes();
    let mut out = Vec::with_capacity(bytes.len());
    let mut at = 0;
    while at < bytes.len() {
        let code = (bytes[at] == b'%')
            .then(|| bytes.get(at + 1..at + 3).and_then(|d| std::str::from_utf8(d).ok()))
            .flatten()
            .filter(|digits| digits.bytes().all(|b| b.is_ascii_hexdigit()))
            .and_then(|digits| u8::from_str_radix(digits, 16).ok());
        match code {
            Some(0) => return None,
            Some(byte) => {
                out.push(byte);
                at += 3;
            }
            None => {
                out.push(bytes[at]);
                at += 1;
            }
        }
    }
    String::from_utf8(out).ok()
}

/// Whether a path stays below a folder, by its parts alone (an unpacked archive holds no links).
fn stays_inside(path: &Path, folder: &Path) -> bool {
    let mut plain = PathBuf::new();
    for part in path.components() {
        match part {
            Component::ParentDir => {
                if !plain.pop() {
                    return false;
                }
            }
            Component::CurDir => {}
            part => plain.push(part),
        }
    }
    plain.starts_with(folder)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn uris_lead_to_files() {
        let folder = tempfile::tempdir().unwrap();
        let other = tempfile::tempdir().unwrap();
        let base = folder.path();
        std::fs::create_dir(base.join("r")).unwrap();
        for path in [base.join("r/a b.fmu"), base.join("100%25.fmu"), other.path().join("x.fmu")] {
            std::fs::write(path, "").unwrap();
        }
        let search = [other.path().to_path_buf()];
        let roots = Roots { base, archive: None, search: &search };
        assert_eq!(find("r/a%20b.fmu", roots).unwrap(), base.join("r/a b.fmu"));
        assert_eq!(find("./r/a b.fmu", roots).unwrap(), base.join("./r/a b.fmu"));
        assert_eq!(find("100%25.fmu", roots).unwrap(), base.join("100%25.fmu"));
        assert_eq!(find("x.fmu", roots).unwrap(), other.path().join("x.fmu"));
        let uri = format!("file://{}/r/a%20b.fmu", base.display());
        assert_eq!(find(&uri, roots).unwrap(), base.join("r/a b.fmu"));
        assert!(find("r/x.fmu", roots).unwrap_err().contains("r/x.fmu"));
        for uri in ["http://a/b.fmu", "file://host/b.fmu", "", "a%00b"] {
            assert!(find(uri, roots).is_err(), "{uri}");
        }
    }

    #[test]
    fn an_archive_keeps_its_uris_inside() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::create_dir(folder.path().join("in")).unwrap();
        std::fs::write(folder.path().join("out.fmu"), "").unwrap();
        std::fs::write(folder.path().join("in/a.fmu"), "").unwrap();
        let inside = folder.path().join("in");
        let roots = Roots { base: &inside, archive: Some(&inside), search: &[] };
        assert!(find("a.fmu", roots).is_ok());
        assert!(find("x/../a.fmu", roots).is_err()); // x does not exist, but nothing leaves
        assert!(find("../out.fmu", roots).unwrap_err().contains("archive"));
        assert!(find("%2e%2e/out.fmu", roots).unwrap_err().contains("archive"));
        assert!(find("file:///etc/hosts", roots).unwrap_err().contains("archive"));
    }
}
