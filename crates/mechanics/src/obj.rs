//! Wavefront OBJ: the vertices (`v`) and faces (`f`) of a mesh.
//!
//! Faces may be polygons (fanned from their first corner, so they should be convex), corners may carry texture and
//! normal indices (`f 1/2/3`, `f 1//3`), which are checked as numbers and dropped, and indices may count back from the
//! end (`f -3 -2 -1`). Everything else of the format (groups, materials, normals, lines, smoothing) is skipped.
//! Lengths are taken as metres.

use crate::TriangleMesh;
use std::fmt::Write;

/// What is wrong with an OBJ text, and in which line (counted from 1).
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("line {line}: {what}")]
pub struct ObjError {
    /// Line number, counted from 1.
    pub line: usize,
    /// What was found and what is allowed.
    pub what: String,
}

/// Reads the mesh of an OBJ text. The mesh is not checked further: see [`TriangleMesh::check`].
///
/// # Errors
/// [`ObjError`] at the first line that cannot be read, or (line 0 being impossible) at the last line if no face came.
pub fn read(text: &str) -> Result<TriangleMesh, ObjError> {
    let mut mesh = TriangleMesh::default();
    let mut line = 0;
    for raw in text.lines() {
        line += 1;
        let content = raw.split('#').next().unwrap_or("");
        if content.trim_end().ends_with('\\') {
            return Err(ObjError { line, what: "lines continued by a backslash are not supported".into() });
        }
        let mut words = content.split_whitespace();
        match words.next() {
            Some("v") => mesh.vertices.push(vertex(words).map_err(|what| ObjError { line, what })?),
            Some("f") => {
                let corners = words
                    .map(|word| corner(word, mesh.vertices.len()))
                    .collect::<Result<Vec<u32>, String>>()
                    .map_err(|what| ObjError { line, what })?;
                if corners.len() < 3 {
                    let what = format!("a face of {} corners, allowed 3 or more", corners.len());
                    return Err(ObjError { line, what });
                }
                for k in 1..corners.len() - 1 {
                    mesh.triangles.push([corners[0], corners[k], corners[k + 1]]);
                }
            }
            _ => {}
        }
    }
    if mesh.triangles.is_empty() {
        return Err(ObjError { line: line.max(1), what: "the text ends without a face (a line `f ...`)".into() });
    }
    Ok(mesh)
}

fn vertex<'a>(words: impl Iterator<Item = &'a str>) -> Result<[f64; 3], String> {
    let values = words
        .map(|w| match w.parse::<f64>() {
            Ok(x) if x.is_finite() => Ok(x),
            _ => Err(format!("coordinate {w:?}, allowed a finite number")),
        })
        .collect::<Result<Vec<f64>, String>>()?;
    // x y z, with w (4 values) or a colour (6 or 7) behind, as scanners write it.
    if !matches!(values.len(), 3 | 4 | 6 | 7) {
        return Err(format!("a vertex of {} values, allowed x y z, then w or a colour", values.len()));
    }
    Ok([values[0], values[1], values[2]])
}

fn corner(word: &str, count: usize) -> Result<u32, String> {
    let mut parts = word.split('/');
    let index = parts.next().unwrap_or("");
    let k: i64 = index.parse().map_err(|_| format!("corner {word:?}, allowed v, v/vt, v/vt/vn or v//vn"))?;
    let rest: Vec<&str> = parts.collect();
    if rest.len() > 2 || rest.iter().any(|p| !p.is_empty() && p.parse::<i64>().is_err()) {
        return Err(format!("corner {word:?}, allowed v, v/vt, v/vt/vn or v//vn"));
    }
    let position = if k > 0 { k - 1 } else { count as i64 + k };
    if k == 0 || position < 0 || position >= count as i64 {
        return Err(format!("vertex index {k}, allowed 1 to {count} or -{count} to -1 ({count} vertices so far)"));
    }
    u32::try_from(position).map_err(|_| format!("vertex index {k} is above 2^32"))
}

/// Writes a mesh as OBJ. Every coordinate reads back to the same bits.
pub fn write(mesh: &TriangleMesh) -> String {
    let mut text = String::with_capacity(32 * (mesh.vertices.len() + mesh.triangles.len()));
    // Writing into a String does not fail.
    for [x, y, z] in &mesh.vertices {
        let _ = writeln!(text, "v {x:?} {y:?} {z:?}");
    }
    for [a, b, c] in &mesh.triangles {
        let _ = writeln!(text, "f {} {} {}", u64::from(*a) + 1, u64::from(*b) + 1, u64::from(*c) + 1);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cylinder::Cylinder;

    #[test]
    fn written_and_read_again_is_the_same() {
        let mesh = Cylinder::smooth(0.1, 0.05, 24).mesh().unwrap();
        assert_eq!(read(&write(&mesh)).unwrap(), mesh);
    }

    #[test]
    fn polygons_and_indices_of_all_kinds() {
        let text = "# a square\no plate\nv 0 0 0\nv 1 0 0 1.0\nv 1 1 0 0.5 0.5 0.5\nvn 0 0 1\nv 0 1 0 # last\n\
                    usemtl x\nf 1/1/1 2//1 3/4 4\nf -4 -3 -2\r\n";
        let mesh = read(text).unwrap();
        assert_eq!(mesh.triangles, vec![[0, 1, 2], [0, 2, 3], [0, 1, 2]]);
        assert_eq!(mesh.vertices[3], [0.0, 1.0, 0.0]);
    }

    #[test]
    fn faults_name_their_line() {
        let head = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
        for (tail, line, part) in [
            ("f 1 2 4\n", 4, "vertex index 4, allowed 1 to 3"),
            ("\nf 0 1 2\n", 5, "vertex index 0"),
            ("f 1 2 -4\n", 4, "vertex index -4"),
            ("f 1 2\n", 4, "2 corners"),
            ("f 1 2 x\n", 4, "corner \"x\""),
            ("f 1/a 2 3\n", 4, "corner \"1/a\""),
            ("v 1 2\n", 4, "2 values"),
            ("v 1 2 nan\n", 4, "\"nan\""),
            ("f 1 2 \\\n3\n", 4, "backslash"),
            ("", 3, "without a face"),
        ] {
            let error = read(&format!("{head}{tail}")).unwrap_err();
            assert_eq!(error.line, line, "{error}");
            assert!(error.what.contains(part), "{error}");
        }
        assert!(read("").is_err());
    }
}
