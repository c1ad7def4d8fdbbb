//! STL, as bytes and as text.

use crate::{MeshError, TriangleMesh};

/// The header, and the number of triangles.
const HEADER: usize = 84;
/// Normal, three corners, and two bytes.
const TRIANGLE: usize = 50;

pub(crate) fn read(bytes: &[u8]) -> Result<TriangleMesh, MeshError> {
    if is_text(bytes) {
        text(&String::from_utf8_lossy(bytes))
    } else {
        binary(bytes)
    }
}

/// Whether the file is text. Some binary files begin with `solid`, too: the next line shows the
/// format.
fn is_text(bytes: &[u8]) -> bool {
    const BOM: &[u8] = b"\xef\xbb\xbf";
    let bytes = bytes.strip_prefix(BOM).unwrap_or(bytes).trim_ascii_start();
    let is = |word: &[u8], of: &[u8]| {
        let start = of.get(..word.len());
        start.is_some_and(|start| start.eq_ignore_ascii_case(word))
    };
    if !is(b"solid", bytes) {
        return false;
    }
    let line_end = bytes.iter().position(|byte| matches!(byte, b'\n' | b'\r'));
    let next = bytes[line_end.unwrap_or(bytes.len())..].trim_ascii_start();
    is(b"facet", next) || is(b"endsolid", next) || next.is_empty() && !bytes.contains(&0)
}

fn binary(bytes: &[u8]) -> Result<TriangleMesh, MeshError> {
    let number = |at: usize| {
        let four = bytes.get(at..at + 4)?;
        Some(u32::from_le_bytes(four.try_into().ok()?))
    };
    let Some(count) = number(HEADER - 4).map(|count| count as usize) else {
        return Err(MeshError::Wrong(
            "expected `solid`, or the header of a file of bytes".to_owned(),
        ));
    };
    let there = (bytes.len() - HEADER) / TRIANGLE;
    if count > there {
        return Err(MeshError::Wrong(format!(
            "the header says {count} triangles, but the file ends after {there}"
        )));
    }
    // Programs write colours and notes after the triangles.
    let behind = bytes[HEADER + count * TRIANGLE..].chunks_exact(TRIANGLE);
    let more = behind.take_while(|bytes| is_triangle(bytes)).count();
    if more > 0 {
        return Err(MeshError::Wrong(format!(
            "the header says {count} triangles, but {more} more of them follow"
        )));
    }
    let mut mesh = TriangleMesh::default();
    for triangle in 0..count {
        let start = HEADER + triangle * TRIANGLE + 12;
        for corner in 0..3 {
            let at = |axis: usize| number(start + corner * 12 + axis * 4).unwrap_or_default();
            let vertex = [0, 1, 2].map(|axis| f64::from(f32::from_bits(at(axis))));
            mesh.vertices.push(vertex);
        }
        let first = triangle as u32 * 3;
        mesh.triangles.push([first, first + 1, first + 2]);
    }
    Ok(mesh)
}

/// Whether bytes after the last triangle are another one: three finite corners, and their normal.
/// Notes are not such numbers, and zeros have no normal.
fn is_triangle(bytes: &[u8]) -> bool {
    let numbers = bytes[..TRIANGLE - 2].chunks_exact(4);
    let numbers: Vec<f64> = numbers
        .filter_map(|four| Some(f64::from(f32::from_le_bytes(four.try_into().ok()?))))
        .filter(|number| number.is_finite())
        .collect();
    let [normal, first, second, third] = numbers.as_chunks::<3>().0 else {
        return false;
    };
    let side = |to: &[f64; 3]| [0, 1, 2].map(|axis| to[axis] - first[axis]);
    let sides = (side(second), side(third));
    let area = [0, 1, 2].map(|axis| {
        let (next, last) = ((axis + 1) % 3, (axis + 2) % 3);
        sides.0[next] * sides.1[last] - sides.0[last] * sides.1[next]
    });
    let length = |of: &[f64; 3]| of.iter().map(|part| part * part).sum::<f64>().sqrt();
    let along: f64 = area
        .iter()
        .zip(normal)
        .map(|(area, part)| area * part)
        .sum();
    // Programs may leave the normal out.
    let is_plain = *normal == [0.0; 3] && numbers.iter().all(|number| number.abs() < 1e9);
    let is_normal =
        (length(normal) - 1.0).abs() < 0.01 && along.abs() > 0.99 * length(&area) * length(normal);
    length(&area) > 0.0 && (is_plain || is_normal)
}

/// Where the reader of a text is.
enum Place {
    /// Before or after a solid.
    Outside,
    Solid,
    /// In a facet, with the number of its line.
    Facet(usize),
}

fn text(text: &str) -> Result<TriangleMesh, MeshError> {
    let wrong = |line: usize, what: String| MeshError::Wrong(format!("line {line}: {what}"));
    let mut mesh = TriangleMesh::default();
    let mut place = Place::Outside;
    let end = if text.contains('\n') { '\n' } else { '\r' };
    let lines = text.trim_start_matches('\u{feff}').split(end);
    for (line, content) in (1..).zip(lines) {
        let mut words = content.split_whitespace();
        let word = words.next().unwrap_or_default().to_ascii_lowercase();
        match (word.as_str(), &place) {
            ("solid", Place::Outside) => place = Place::Solid,
            ("facet", Place::Solid) => place = Place::Facet(line),
            ("vertex", Place::Facet(_)) => {
                let numbers: Vec<f64> = words.map_while(|word| word.parse().ok()).collect();
                let vertex = numbers.try_into();
                let vertex =
                    vertex.map_err(|_| wrong(line, "expected three numbers".to_owned()))?;
                mesh.vertices.push(vertex);
            }
            ("endfacet", Place::Facet(_)) => {
                let first = 3 * mesh.triangles.len();
                let corners = mesh.vertices.len() - first;
                if corners != 3 {
                    let what = format!("expected three corners of the facet, found {corners}");
                    return Err(wrong(line, what));
                }
                let first = first as u32;
                mesh.triangles.push([first, first + 1, first + 2]);
                place = Place::Solid;
            }
            ("endsolid", Place::Solid) => place = Place::Outside,
            ("solid" | "facet" | "vertex" | "endfacet" | "endsolid", _) => {
                let expected = match place {
                    Place::Outside => "`solid`",
                    Place::Solid => "`facet` or `endsolid`",
                    Place::Facet(_) => "`vertex` or `endfacet`",
                };
                return Err(wrong(line, format!("expected {expected}, found `{word}`")));
            }
            // `outer loop`, `endloop`, and notes of other programs.
            _ => {}
        }
    }
    match place {
        Place::Outside => Ok(mesh),
        Place::Solid => Err(MeshError::Wrong(
            "the file is cut: `endsolid` is missing".to_owned(),
        )),
        Place::Facet(line) => {
            let what = "the file is cut: `endfacet` is missing".to_owned();
            Err(wrong(line, what))
        }
    }
}
