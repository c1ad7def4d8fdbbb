//! The sphere that fits points best.

use crate::Point;

/// A sphere, in mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Sphere {
    pub(crate) centre: Point,
    pub(crate) radius: f64,
}

impl Sphere {
    /// The sphere with the least squares of |p − centre|² − radius². There is none for points in a
    /// plane.
    ///
    /// About the mean of the points, the centre solves Σ(q·qᵀ) · 2c = Σ(|q|²·q).
    pub(crate) fn fit(points: &[Point]) -> Option<Self> {
        if points.len() < 4 {
            return None;
        }
        let count = points.len() as f64;
        let mut mean = [0.0; 3];
        for point in points {
            for axis in 0..3 {
                mean[axis] += point[axis] / count;
            }
        }
        let (mut products, mut sums, mut squares) = ([[0.0; 3]; 3], [0.0; 3], 0.0);
        for point in points {
            let from_mean = [0, 1, 2].map(|axis| point[axis] - mean[axis]);
            let square = dot(from_mean, from_mean);
            squares += square / count;
            for row in 0..3 {
                sums[row] += square * from_mean[row] / 2.0;
                for column in 0..3 {
                    products[row][column] += from_mean[row] * from_mean[column];
                }
            }
        }
        let centre = solve(products, sums)?;
        Some(Self {
            centre: [0, 1, 2].map(|axis| centre[axis] + mean[axis]),
            radius: (dot(centre, centre) + squares).sqrt(),
        })
    }

    /// How far a point is outside, negative inside.
    pub(crate) fn distance(&self, point: Point) -> f64 {
        let from = [0, 1, 2].map(|axis| point[axis] - self.centre[axis]);
        dot(from, from).sqrt() - self.radius
    }

    /// The root mean square of the distances of points.
    pub(crate) fn deviation(&self, points: &[Point]) -> f64 {
        let squares = points.iter().map(|point| self.distance(*point).powi(2));
        (squares.sum::<f64>() / points.len().max(1) as f64).sqrt()
    }
}

fn dot(a: Point, b: Point) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: Point, b: Point) -> Point {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

/// Solves a symmetric system by Cramer's rule.
fn solve(rows: [Point; 3], right: Point) -> Option<Point> {
    let [a, b, c] = rows;
    let determinant = dot(a, cross(b, c));
    let solution = [
        dot(right, cross(b, c)) / determinant,
        dot(right, cross(c, a)) / determinant,
        dot(right, cross(a, b)) / determinant,
    ];
    solution
        .iter()
        .all(|number| number.is_finite())
        .then_some(solution)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Points of the half of a sphere that a camera at z = −∞ sees.
    fn half(centre: Point, radius: f64) -> Vec<Point> {
        let steps = || (-4..=4).map(|step| f64::from(step) / 5.0);
        let places = steps().flat_map(|x| steps().map(move |y| (x, y)));
        places
            .filter(|(x, y)| x.hypot(*y) < 0.95)
            .map(|(x, y)| {
                let z = -(1.0 - x * x - y * y).sqrt();
                [
                    centre[0] + radius * x,
                    centre[1] + radius * y,
                    centre[2] + radius * z,
                ]
            })
            .collect()
    }

    #[test]
    fn half_a_sphere_says_where_it_is() {
        let points = half([300.0, 1600.0, 4000.0], 105.0);
        let found = Sphere::fit(&points).expect("a sphere");
        for (is, should) in found.centre.into_iter().zip([300.0, 1600.0, 4000.0]) {
            assert!((is - should).abs() < 1e-6, "{found:?}");
        }
        assert!((found.radius - 105.0).abs() < 1e-6, "{found:?}");
        assert!(found.deviation(&points) < 1e-6);
        assert!((found.distance([300.0, 1600.0, 3800.0]) - 95.0).abs() < 1e-6);
    }

    #[test]
    fn points_of_a_plane_or_too_few_have_no_sphere() {
        let plane: Vec<Point> = (0..20)
            .map(|at| [f64::from(at % 5), f64::from(at / 5), 0.0])
            .collect();
        assert_eq!(Sphere::fit(&plane), None);
        assert_eq!(Sphere::fit(&plane[..3]), None);
    }
}
