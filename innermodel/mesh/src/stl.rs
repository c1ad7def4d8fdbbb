//! STL, as bytes and as text.

use crate::{MeshError, TriangleMesh};

/// The header, and the number of triangles.
const HEADER: usize = 84;
/// Normal, three corners, and two bytes.
const TRIANGLE: usize = 50;

pub(crate) fn read(bytes: &[u8]) -> Result<TriangleMesh, MeshError> {
    let number = |at: usize| {
        let four = bytes.get(at..at + 4)?;
        Some(u32::from_le_bytes(four.try_into().ok()?))
    };
    // Some files of bytes begin with `solid`, too: their length tells.
    let count = number(80).map_or(0, |count| count as usize);
    if bytes.len() < HEADER || count.saturating_mul(TRIANGLE) != bytes.len() - HEADER {
        return text(&String::from_utf8_lossy(bytes));
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

fn text(text: &str) -> Result<TriangleMesh, MeshError> {
    if !text.trim_start().starts_with("solid") {
        return Err(MeshError::Wrong(
            "expected `solid`, or as many triangles as the header says".to_owned(),
        ));
    }
    let mut mesh = TriangleMesh::default();
    for (number, line) in text.lines().enumerate() {
        let mut words = line.split_whitespace();
        if words.next() != Some("vertex") {
            continue;
        }
        let numbers: Vec<f64> = words.map_while(|word| word.parse().ok()).collect();
        let vertex = numbers.try_into().map_err(|_| {
            MeshError::Wrong(format!("line {}: expected three numbers", number + 1))
        })?;
        mesh.vertices.push(vertex);
    }
    let count = mesh.vertices.len() as u32 / 3;
    mesh.triangles = (0..count).map(|n| [3 * n, 3 * n + 1, 3 * n + 2]).collect();
    Ok(mesh)
}
