//! The map and the way of the robot as a few lines of text.

use crate::track::Track;
use planar_map::{Bounds, Map, Point};
use std::f64::consts::FRAC_PI_4;

/// The largest picture, in characters.
const COLUMNS: usize = 60;
const ROWS: usize = 20;
/// A character is about twice as high as it is wide.
const ASPECT: f64 = 2.0;

/// A robot that looks along x, then each eighth of a turn farther to the left.
const ARROWS: [char; 8] = ['→', '↗', '↑', '↖', '←', '↙', '↓', '↘'];

/// Walls as `#`, the way as `·`, the robot as an arrow; at most 60 by 20 characters, each line
/// ended.
pub(crate) fn picture(map: &Map, track: &Track) -> String {
    let mut grid = Grid::over(map.bounds());
    for wall in map.segments() {
        let steps = (wall.a.distance_to(wall.b) / (grid.cell / 2.0))
            .ceil()
            .max(1.0) as u32;
        for step in 0..=steps {
            let part = f64::from(step) / f64::from(steps);
            let (dx, dy) = (wall.b.x - wall.a.x, wall.b.y - wall.a.y);
            grid.put(Point::new(wall.a.x + part * dx, wall.a.y + part * dy), '#');
        }
    }
    track
        .kept
        .iter()
        .for_each(|(_, pose)| grid.put(pose.point(), '·'));
    if let Some(last) = track.last {
        let eighth = (last.heading / FRAC_PI_4).round().rem_euclid(8.0) as usize;
        grid.put(last.point(), ARROWS[eighth % ARROWS.len()]);
    }
    grid.rows
        .iter()
        .map(|row| row.iter().collect::<String>().trim_end().to_owned() + "\n")
        .collect()
}

struct Grid {
    bounds: Bounds,
    /// Width of a character, in mm.
    cell: f64,
    rows: Vec<Vec<char>>,
}

impl Grid {
    fn over(bounds: Bounds) -> Self {
        let across = bounds.width() / (COLUMNS - 1) as f64;
        let down = bounds.height() / ((ROWS - 1) as f64 * ASPECT);
        let cell = across.max(down).max(1.0);
        let columns = (bounds.width() / cell).round() as usize + 1;
        let rows = (bounds.height() / (cell * ASPECT)).round() as usize + 1;
        Self {
            bounds,
            cell,
            rows: vec![vec![' '; columns]; rows],
        }
    }

    /// Puts a character where `point` is; nothing outside the map.
    fn put(&mut self, point: Point, character: char) {
        if !self.bounds.contains(point) {
            return;
        }
        let column = ((point.x - self.bounds.min.x) / self.cell).round() as usize;
        let row = ((self.bounds.max.y - point.y) / (self.cell * ASPECT)).round() as usize;
        if let Some(slot) = self.rows.get_mut(row).and_then(|row| row.get_mut(column)) {
            *slot = character;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use planar_map::Pose;
    use std::path::Path;

    fn map(text: &str) -> Map {
        Map::parse(Path::new("test"), text).unwrap()
    }

    #[test]
    fn a_room_with_a_robot() {
        let room = map("box 0 0 5900 1000\nrobot 300 500 0");
        let mut track = Track::default();
        (0..20).for_each(|step| track.add(Pose::new(300.0 + 100.0 * f64::from(step), 500.0, 0.8)));
        let wall = "#".repeat(60);
        let side = format!("#{}#", " ".repeat(58));
        let way = format!("#  {}↗{}#", "·".repeat(19), " ".repeat(36));
        let picture = picture(&room, &track);
        let lines: Vec<&str> = picture.lines().collect();
        assert_eq!(lines[0], wall);
        assert_eq!(lines[1], side);
        assert!(lines.contains(&way.as_str()), "{picture}");
        assert_eq!(lines.len(), 6);
    }

    #[test]
    fn a_picture_is_never_larger_than_it_may_be() {
        for floor in [
            "wall 0 0 9000 1\nrobot 0 0 0",
            "wall 0 0 1 9000\nrobot 0 0 0",
            "wall 0 0 0 0\nrobot 0 0 0",
        ] {
            let picture = picture(&map(floor), &Track::default());
            assert!(picture.lines().count() <= ROWS, "{picture}");
            assert!(
                picture.lines().all(|line| line.chars().count() <= COLUMNS),
                "{picture}"
            );
        }
    }

    #[test]
    fn a_robot_outside_the_map_is_not_shown() {
        let mut track = Track::default();
        track.add(Pose::new(-9000.0, f64::NAN, 0.0));
        assert!(!picture(&map("wall 0 0 900 0\nrobot 0 0 0"), &track).contains('→'));
    }
}
