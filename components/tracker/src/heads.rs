//! Heads among the points above a floor.

use crate::Point;
use crate::sphere::Sphere;
use std::collections::BTreeMap;

/// The side of a cell of the floor, in mm.
const CELL: f64 = 100.0;
/// A head is the highest thing among so many cells to each side.
const AROUND: i32 = 3;
/// The part of a head that is looked at, from its top, in mm: shoulders are lower.
const BELOW_TOP: f64 = 170.0;
/// No point of a head is farther from its top, along the floor, in mm.
const BESIDE_TOP: f64 = 250.0;
/// Points so far from the sphere of a head belong to something else, in mm.
const BESIDE: f64 = 40.0;
/// The radius of a head in mm.
const LEAST_RADIUS: f64 = 60.0;
const GREATEST_RADIUS: f64 = 150.0;
/// The root mean square of the distances of a head's points from its sphere, in mm.
const MOST_DEVIATION: f64 = 12.0;
/// Fewer points say too little.
const LEAST_POINTS: usize = 12;
/// A body is between these parts of a person's height. It is wider than the head, and not farther
/// than `BODY` from below it, in mm.
const BODY_FROM: f64 = 0.5;
const BODY_TO: f64 = 0.8;
const BODY: f64 = 300.0;

/// The heights of people in mm.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Heights {
    pub(crate) shortest: f64,
    pub(crate) tallest: f64,
}

/// A thing that looks like a head on a body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Head {
    /// Above the floor.
    pub(crate) centre: Point,
    /// From 0 to 1: how well its points are those of a sphere.
    pub(crate) score: f64,
}

/// The points above one cell of the floor.
#[derive(Debug, Default)]
struct Cell {
    points: Vec<Point>,
    /// The highest one.
    top: Point,
}

/// Cells by their places, in an order, so that a run repeats exactly.
type Floor = BTreeMap<[i32; 2], Cell>;

/// Finds heads: spheres of the right size at the top of something that has a body below.
pub(crate) fn find(points: impl Iterator<Item = Point>, heights: Heights) -> Vec<Head> {
    let floor = cells(points);
    let is_person = |cell: &Cell| (heights.shortest..=heights.tallest).contains(&cell.top[1]);
    let tops = floor.iter().filter(|(at, cell)| {
        // Of two cells that are as high, one has the top.
        let is_higher = |(other, it): ([i32; 2], &Cell)| {
            is_person(it) && (it.top[1], other) > (cell.top[1], **at)
        };
        is_person(cell) && !around(&floor, **at, AROUND).any(is_higher)
    });
    tops.filter_map(|(at, cell)| head(&floor, *at, cell.top))
        .collect()
}

/// Sorts points by the cells of the floor.
fn cells(points: impl Iterator<Item = Point>) -> Floor {
    let mut floor = Floor::new();
    for point in points {
        let at = [point[0], point[2]].map(|length| (length / CELL).floor() as i32);
        let cell = floor.entry(at).or_default();
        if cell.points.is_empty() || point[1] > cell.top[1] {
            cell.top = point;
        }
        cell.points.push(point);
    }
    floor
}

/// The cells around one, and itself, with their places.
fn around(floor: &Floor, [x, z]: [i32; 2], far: i32) -> impl Iterator<Item = ([i32; 2], &Cell)> {
    let places = (-far..=far).flat_map(move |dx| (-far..=far).map(move |dz| (dx, dz)));
    places.filter_map(move |(dx, dz)| {
        let at = [x.saturating_add(dx), z.saturating_add(dz)];
        floor.get(&at).map(|cell| (at, cell))
    })
}

/// The head with this top, if it is one.
fn head(floor: &Floor, at: [i32; 2], top: Point) -> Option<Head> {
    let mut points: Vec<Point> = near(floor, at, top, BESIDE_TOP)
        .filter(|point| point[1] > top[1] - BELOW_TOP && point[1] <= top[1])
        .collect();
    let first = Sphere::fit(&points)?;
    points.retain(|point| first.distance(*point).abs() < BESIDE);
    let sphere = Sphere::fit(&points)?;
    let deviation = sphere.deviation(&points);
    let is_head = points.len() >= LEAST_POINTS
        && (LEAST_RADIUS..=GREATEST_RADIUS).contains(&sphere.radius)
        && deviation <= MOST_DEVIATION;
    let is_body = |point: &Point| {
        let beside = (point[0] - sphere.centre[0]).hypot(point[2] - sphere.centre[2]);
        let height = BODY_FROM * top[1]..BODY_TO * top[1];
        beside > sphere.radius && height.contains(&point[1])
    };
    let body = near(floor, at, sphere.centre, BODY).filter(is_body);
    (is_head && body.count() >= points.len()).then_some(Head {
        centre: sphere.centre,
        score: 1.0 - deviation / MOST_DEVIATION,
    })
}

/// The points that are, along the floor, not farther from a place near a cell.
fn near(floor: &Floor, at: [i32; 2], place: Point, far: f64) -> impl Iterator<Item = Point> + '_ {
    let points = around(floor, at, AROUND + 1).flat_map(|(_, cell)| &cell.points);
    points
        .copied()
        .filter(move |point| (point[0] - place[0]).hypot(point[2] - place[2]) <= far)
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEIGHTS: Heights = Heights {
        shortest: 1000.0,
        tallest: 2100.0,
    };

    /// Points on the side of an upright body that is turned to a viewer at z = −∞.
    fn side(
        centre: Point,
        radius: f64,
        heights: std::ops::Range<f64>,
        is_ball: bool,
    ) -> Vec<Point> {
        let mut points = Vec::new();
        let mut height = heights.start;
        while height < heights.end {
            let up = (height - centre[1]) / radius;
            let wide = if is_ball {
                (1.0 - up * up).max(0.0).sqrt()
            } else {
                1.0
            };
            for turn in -8..=8 {
                let (sin, cos) = (f64::from(turn) * 0.19).sin_cos();
                points.push([
                    centre[0] + radius * wide * sin,
                    height,
                    centre[2] - radius * wide * cos,
                ]);
            }
            height += 25.0;
        }
        points
    }

    fn person(x: f64, z: f64) -> Vec<Point> {
        let mut points = side([x, 1580.0, z], 105.0, 1480.0..1680.0, true);
        points.extend(side([x, 1100.0, z], 145.0, 900.0..1400.0, false));
        points
    }

    /// A wall that is as high as a person.
    fn wall(z: f64) -> impl Iterator<Item = Point> {
        let places = (-60..60).flat_map(|x| (0..68).map(move |y| (x, y)));
        places.map(move |(x, y)| [f64::from(x) * 25.0, f64::from(y) * 25.0, z])
    }

    #[test]
    fn a_head_is_found_before_a_wall() {
        let mut points = person(300.0, 2500.0);
        points.extend(wall(2900.0));
        let found = find(points.into_iter(), HEIGHTS);
        let [head] = found[..] else {
            panic!("{found:?}");
        };
        let [x, y, z] = head.centre;
        assert!(
            (x - 300.0).abs() < 1.0 && (z - 2500.0).abs() < 1.0,
            "{head:?}"
        );
        assert!((y - 1580.0).abs() < 1.0 && head.score > 0.9, "{head:?}");
    }

    #[test]
    fn several_people_have_several_heads() {
        let points = [(-900.0, 2000.0), (0.0, 4000.0), (700.0, 2500.0)].map(|(x, z)| person(x, z));
        let found = find(points.into_iter().flatten(), HEIGHTS);
        let places: Vec<f64> = found.iter().map(|head| head.centre[0].round()).collect();
        assert_eq!(places, [-900.0, 0.0, 700.0]);
    }

    #[test]
    fn other_things_are_no_heads() {
        let none = |what: &str, points: Vec<Point>| {
            let found = find(points.into_iter(), HEIGHTS);
            assert!(found.is_empty(), "{what}: {found:?}");
        };
        none("a wall", wall(2000.0).collect());
        none(
            "a ball",
            side([0.0, 1580.0, 2000.0], 105.0, 1480.0..1680.0, true),
        );
        none("a post", side([0.0, 0.0, 2000.0], 60.0, 0.0..1700.0, false));
        none(
            "a child",
            person(0.0, 2000.0)
                .into_iter()
                .map(|[x, y, z]| [x, y - 800.0, z])
                .collect(),
        );
        none("nothing", Vec::new());
    }
}
