//! Triangles of a face with many corners, also where it is not convex.

/// How many steps all faces of a file may take together.
const MOST_STEPS: u64 = 2_000_000_000;

/// Cuts the faces of a file, and counts its steps.
#[derive(Default)]
pub(crate) struct Clipping {
    steps: u64,
}

impl Clipping {
    /// The triangles of a face with these corners, as places in `corners`: a fan if the face is
    /// convex, otherwise ear by ear.
    ///
    /// # Errors
    /// A corner is not there yet, or the faces of the file take too long.
    pub(crate) fn triangles(
        &mut self,
        vertices: &[[f64; 3]],
        corners: &[u32],
    ) -> Result<Vec<[usize; 3]>, &'static str> {
        let fan = || (2..corners.len()).map(|at| [0, at - 1, at]).collect();
        if corners.len() <= 3 {
            return Ok(fan());
        }
        let points = corners.iter().map(|at| vertices.get(*at as usize).copied());
        let points: Option<Vec<[f64; 3]>> = points.collect();
        let points = points.ok_or("expected places of earlier vertices")?;
        let Some(flat) = flattened(&points) else {
            return Ok(fan());
        };
        let turns = |a: usize, b: usize, c: usize| turn(flat[a], flat[b], flat[c]);
        let count = flat.len();
        if (0..count).all(|at| turns(at, (at + 1) % count, (at + 2) % count) >= 0.0) {
            return Ok(fan());
        }
        let mut left: Vec<usize> = (0..count).collect();
        let mut triangles = Vec::with_capacity(count - 2);
        while left.len() > 3 {
            let mut is_ear = |at: usize| {
                self.steps += left.len() as u64;
                let before = left[(at + left.len() - 1) % left.len()];
                let (here, after) = (left[at], left[(at + 1) % left.len()]);
                let corners = [flat[before], flat[here], flat[after]];
                let ends = |other: usize| corners.contains(&flat[other]);
                let is_inside = |other: &usize| !ends(*other) && contains(corners, flat[*other]);
                turns(before, here, after) >= 0.0 && !left.iter().any(is_inside)
            };
            // Where sides cross, no inside is defined: the rest is a fan.
            let ear = (0..left.len()).find(|at| is_ear(*at)).unwrap_or(1);
            if self.steps > MOST_STEPS {
                return Err("the faces of the file have too many corners");
            }
            let before = left[(ear + left.len() - 1) % left.len()];
            let after = left[(ear + 1) % left.len()];
            triangles.push([before, left[ear], after]);
            left.remove(ear);
        }
        triangles.push([left[0], left[1], left[2]]);
        Ok(triangles)
    }
}

/// The corners as seen from the side from which they turn to the left. `None` if they have no area.
fn flattened(points: &[[f64; 3]]) -> Option<Vec<[f64; 2]>> {
    // Newell's normal.
    let mut normal = [0.0_f64; 3];
    let next = points.iter().skip(1).chain(points.first());
    for (a, b) in points.iter().zip(next) {
        for (axis, sum) in normal.iter_mut().enumerate() {
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            *sum += (a[u] - b[u]) * (a[v] + b[v]);
        }
    }
    let axis = (0..3).max_by(|a, b| normal[*a].abs().total_cmp(&normal[*b].abs()))?;
    if normal[axis] == 0.0 || !normal[axis].is_finite() {
        return None;
    }
    let (u, v) = if normal[axis] > 0.0 {
        ((axis + 1) % 3, (axis + 2) % 3)
    } else {
        ((axis + 2) % 3, (axis + 1) % 3)
    };
    Some(points.iter().map(|point| [point[u], point[v]]).collect())
}

/// Twice the area of a triangle: greater than 0 if it turns to the left.
fn turn(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

/// Whether a point is in a triangle that turns to the left, or on one of its sides.
fn contains([a, b, c]: [[f64; 2]; 3], point: [f64; 2]) -> bool {
    turn(a, b, point) >= 0.0 && turn(b, c, point) >= 0.0 && turn(c, a, point) >= 0.0
}
