//! Names of archive entries: plain relative paths only.

use std::collections::HashMap;

use super::Limits;

/// Why a name is refused, or its parts.
///
/// Folders end in `/`, as the format has it. Names that differ only in case are refused too: on another machine they
/// would be one file.
pub fn parts<'n>(name: &'n str, limits: &Limits) -> Result<Vec<&'n str>, String> {
    if name.is_empty() {
        return Err("it has no name".into());
    }
    if name.len() > limits.path {
        return Err(format!("its name has {} bytes, at most {} are allowed", name.len(), limits.path));
    }
    if let Some(c) = name.chars().find(|c| c.is_control() || *c == '\\') {
        return Err(format!("its name holds the character {c:?}"));
    }
    if name.starts_with('/') {
        return Err("its name is absolute".into());
    }
    if name.as_bytes().get(1) == Some(&b':') {
        return Err("its name starts with a drive letter".into());
    }
    let trimmed = name.strip_suffix('/').unwrap_or(name);
    let parts: Vec<&str> = trimmed.split('/').collect();
    if parts.len() > limits.depth {
        return Err(format!("its path has {} levels, at most {} are allowed", parts.len(), limits.depth));
    }
    for part in &parts {
        match *part {
            "" => return Err("its path has an empty part".into()),
            ".." => return Err("its path leads out of the archive (\"..\")".into()),
            "." => return Err("its path has a part \".\"".into()),
            part if part.len() > 255 => return Err("a part of its path has more than 255 bytes".into()),
            _ => {}
        }
    }
    Ok(parts)
}

/// Remembers paths and refuses what would meet on disk: the same path twice, or a file that is also a folder.
#[derive(Default)]
pub struct Seen {
    /// Path in lower case -> whether it is a folder.
    paths: HashMap<String, bool>,
}

impl Seen {
    /// Adds a path.
    pub fn add(&mut self, parts: &[&str], is_folder: bool) -> Result<(), String> {
        let mut path = String::new();
        for (i, part) in parts.iter().enumerate() {
            if i > 0 {
                path.push('/');
            }
            path.push_str(&part.to_lowercase());
            let last = i + 1 == parts.len();
            let folder = !last || is_folder;
            match self.paths.get(&path) {
                None => {
                    self.paths.insert(path.clone(), folder);
                }
                Some(true) if folder => {}
                Some(true) => return Err("it is a file and a folder at once".into()),
                Some(false) if folder => return Err("it lies inside another entry that is a file".into()),
                Some(false) => return Err("the name is there twice".into()),
            }
        }
        Ok(())
    }
}
