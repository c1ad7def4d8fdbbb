//! Wavefront OBJ: its vertices and faces. Materials, normals and curves are not used.

use crate::{MeshError, TriangleMesh};

pub(crate) fn read(bytes: &[u8]) -> Result<TriangleMesh, MeshError> {
    let text = String::from_utf8_lossy(bytes);
    let mut mesh = TriangleMesh::default();
    for (number, line) in text.lines().enumerate() {
        let wrong = |what: &str| MeshError::Wrong(format!("line {}: {what}", number + 1));
        let mut words = line.split_whitespace();
        match words.next() {
            Some("v") => {
                let numbers: Vec<f64> = words.take(3).map_while(|w| w.parse().ok()).collect();
                let vertex = numbers.try_into();
                mesh.vertices
                    .push(vertex.map_err(|_| wrong("expected three numbers"))?);
            }
            Some("f") => {
                let corner = |word: &str| {
                    let place = word.split('/').next()?.parse::<i64>().ok()?;
                    // From 1, or counted back from the last vertex.
                    let count = mesh.vertices.len() as i64;
                    let at = if place < 0 { count + place } else { place - 1 };
                    u32::try_from(at).ok()
                };
                let corners: Option<Vec<u32>> = words.map(corner).collect();
                let corners = corners.ok_or_else(|| wrong("expected places of vertices"))?;
                // A face with more corners is a fan.
                for pair in corners.windows(2).skip(1) {
                    mesh.triangles.push([corners[0], pair[0], pair[1]]);
                }
            }
            _ => {}
        }
    }
    Ok(mesh)
}
