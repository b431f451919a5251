//! Names that look like a misspelt one.

/// Names compared; a larger model gets suggestions from its first ones only.
const MOST_NAMES: usize = 20_000;

/// Up to three of `names` that are close to `given`, the closest first.
///
/// Close: an edit distance (insert, delete, replace) of at most a third of the length, or equal but for case.
pub fn close<'n>(given: &str, names: impl Iterator<Item = &'n str>) -> Vec<String> {
    let given_lower: Vec<char> = given.to_lowercase().chars().take(120).collect();
    let most = (given_lower.len() / 3).clamp(1, 4);
    let mut found: Vec<(usize, &str)> = Vec::new();
    let mut row = Vec::new();
    for name in names.take(MOST_NAMES) {
        let lower: Vec<char> = name.to_lowercase().chars().take(120).collect();
        if lower.len().abs_diff(given_lower.len()) <= most {
            let distance = edits(&given_lower, &lower, &mut row);
            if distance <= most {
                found.push((distance, name));
            }
        }
    }
    found.sort();
    found.truncate(3);
    found.into_iter().map(|(_, name)| name.to_owned()).collect()
}

fn edits(a: &[char], b: &[char], row: &mut Vec<usize>) -> usize {
    row.clear();
    row.extend(0..=b.len());
    for (i, x) in a.iter().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, y) in b.iter().enumerate() {
            let replaced = diagonal + usize::from(x != y);
            diagonal = row[j + 1];
            row[j + 1] = replaced.min(row[j] + 1).min(diagonal + 1);
        }
    }
    row[b.len()]
}

/// Whether a name matches a pattern in which `*` stands for any text; everything else stands for itself.
pub fn matches(pattern: &str, name: &str) -> bool {
    let mut parts = pattern.split('*');
    let first = parts.next().unwrap_or_default();
    let Some(mut rest) = name.strip_prefix(first) else { return false };
    let mut parts: Vec<&str> = parts.collect();
    let Some(last) = parts.pop() else { return rest.is_empty() };
    for part in parts {
        match rest.find(part) {
            Some(at) => rest = &rest[at + part.len()..],
            None => return false,
        }
    }
    rest.ends_with(last)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn misspelt_names_are_found() {
        let names = ["drawbar_pull", "slip", "sinkage", "wheel[1].force.x"];
        assert_eq!(close("drawbar_pul", names.into_iter()), ["drawbar_pull"]);
        assert_eq!(close("Sinkage", names.into_iter()), ["sinkage"]);
        assert_eq!(close("wheel.force.x", names.into_iter()), ["wheel[1].force.x"]);
        assert!(close("temperature", names.into_iter()).is_empty());
    }

    #[test]
    fn a_star_stands_for_any_text() {
        for (pattern, name, yes) in [
            ("*", "a.b", true),
            ("wheel[1].*", "wheel[1].force.x", true),
            ("wheel[1].*", "wheel[2].force.x", false),
            ("*.x", "force.x", true),
            ("a*b*c", "a1b2c", true),
            ("a*b*c", "a1c2b", false),
            ("slip", "slip", true),
            ("slip", "slips", false),
            ("ab*ba", "aba", false),
        ] {
            assert_eq!(matches(pattern, name), yes, "{pattern} {name}");
        }
    }
}
