//! The text form of a map.
//!
//! One thing a line, numbers in mm and degrees, `#` begins a comment:
//!
//! ```text
//! wall x1 y1 x2 y2        a straight wall
//! box  x1 y1 x2 y2        a piece of furniture, by two opposite corners
//! robot x y heading       where the robot starts; heading in degrees, counter-clockwise from x; exactly once
//! ```

use crate::{Point, Pose, Segment};
use std::path::{Path, PathBuf};

/// Why a map cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum MapError {
    /// The file cannot be read.
    #[error("{}: {error}", path.display())]
    Unreadable {
        /// Which file.
        path: PathBuf,
        /// Text of the system's error.
        error: std::io::Error,
    },
    /// A line says nothing that a map can say.
    #[error("{}:{line}: {message}", path.display())]
    Wrong {
        /// Which file.
        path: PathBuf,
        /// Which line, from 1.
        line: usize,
        /// The mistake, and what is allowed.
        message: String,
    },
}

/// A rectangle along the axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// The lower left corner.
    pub min: Point,
    /// The upper right corner.
    pub max: Point,
}

impl Bounds {
    /// The rectangle between two opposite corners.
    pub fn new(a: Point, b: Point) -> Self {
        let (min, max) = (
            Point::new(a.x.min(b.x), a.y.min(b.y)),
            Point::new(a.x.max(b.x), a.y.max(b.y)),
        );
        Self { min, max }
    }

    /// From left to right, in mm.
    pub fn width(&self) -> f64 {
        self.max.x - self.min.x
    }

    /// From bottom to top, in mm.
    pub fn height(&self) -> f64 {
        self.max.y - self.min.y
    }

    /// Whether `point` is inside or on the edge.
    pub fn contains(&self, point: Point) -> bool {
        (self.min.x..=self.max.x).contains(&point.x) && (self.min.y..=self.max.y).contains(&point.y)
    }

    fn edges(&self) -> [Segment; 4] {
        let (right, left) = (
            Point::new(self.max.x, self.min.y),
            Point::new(self.min.x, self.max.y),
        );
        [
            (self.min, right),
            (right, self.max),
            (self.max, left),
            (left, self.min),
        ]
        .map(|(a, b)| Segment { a, b })
    }
}

/// A floor.
#[derive(Clone, Debug, PartialEq)]
pub struct Map {
    /// The walls.
    pub walls: Vec<Segment>,
    /// The furniture.
    pub boxes: Vec<Bounds>,
    /// Where the robot starts.
    pub start: Pose,
}

impl Map {
    /// Reads a map file.
    pub fn load(path: &Path) -> Result<Self, MapError> {
        // A pipe would wait for its writer.
        match rc_files::read(path) {
            Ok(text) => Self::parse(path, &text),
            Err(error) => Err(MapError::Unreadable {
                path: path.to_owned(),
                error,
            }),
        }
    }

    /// Reads the text of a map; `path` is only named in errors.
    pub fn parse(path: &Path, text: &str) -> Result<Self, MapError> {
        let wrong = |line, message| MapError::Wrong {
            path: path.to_owned(),
            line,
            message,
        };
        let (mut walls, mut boxes, mut start) = (Vec::new(), Vec::new(), None);
        for (line, content) in (1..).zip(text.lines()) {
            let content = content.split('#').next().unwrap_or_default();
            let mut words = content.split_whitespace();
            let Some(word) = words.next() else { continue };
            let rest: Vec<&str> = words.collect();
            let fail = |message| wrong(line, message);
            match word {
                "wall" => {
                    let [x1, y1, x2, y2] = numbers(&rest, "wall x1 y1 x2 y2").map_err(fail)?;
                    walls.push(Segment {
                        a: Point::new(x1, y1),
                        b: Point::new(x2, y2),
                    });
                }
                "box" => {
                    let [x1, y1, x2, y2] = numbers(&rest, "box x1 y1 x2 y2").map_err(fail)?;
                    boxes.push(Bounds::new(Point::new(x1, y1), Point::new(x2, y2)));
                }
                "robot" => {
                    let [x, y, heading] = numbers(&rest, "robot x y heading").map_err(fail)?;
                    if let Some((_, first)) = start {
                        return Err(fail(format!(
                            "a second `robot`; the first one is in line {first}"
                        )));
                    }
                    start = Some((Pose::new(x, y, heading.to_radians()), line));
                }
                other => {
                    return Err(fail(format!(
                        "`{other}` is nothing of a map; allowed are wall, box and robot"
                    )));
                }
            }
        }
        let last = text.lines().count().max(1);
        let Some((start, _)) = start else {
            return Err(wrong(
                last,
                "there is no robot; add `robot x y heading`".to_owned(),
            ));
        };
        if walls.is_empty() && boxes.is_empty() {
            return Err(wrong(
                last,
                "there is nothing on this floor; add `wall x1 y1 x2 y2`".to_owned(),
            ));
        }
        Ok(Self {
            walls,
            boxes,
            start,
        })
    }

    /// Everything a robot can bump into: the walls, then the edges of the furniture.
    pub fn segments(&self) -> Vec<Segment> {
        let edges = self.boxes.iter().flat_map(Bounds::edges);
        self.walls.iter().copied().chain(edges).collect()
    }

    /// The smallest rectangle around everything, the robot's start too.
    pub fn bounds(&self) -> Bounds {
        let at = self.start.point();
        self.segments()
            .iter()
            .flat_map(|s| [s.a, s.b])
            .fold(Bounds::new(at, at), |all, p| Bounds {
                min: Point::new(all.min.x.min(p.x), all.min.y.min(p.y)),
                max: Point::new(all.max.x.max(p.x), all.max.y.max(p.y)),
            })
    }
}

fn numbers<const N: usize>(words: &[&str], form: &str) -> Result<[f64; N], String> {
    let mut out = [0.0; N];
    if words.len() != N {
        return Err(format!(
            "{} numbers where {N} belong: `{form}`",
            words.len()
        ));
    }
    for (slot, word) in out.iter_mut().zip(words) {
        *slot = match word.parse::<f64>() {
            Ok(number) if number.is_finite() => number,
            _ => return Err(format!("`{word}` is not a number: `{form}`")),
        };
    }
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Result<Map, String> {
        Map::parse(Path::new("a.map"), text).map_err(|e| e.to_string())
    }

    #[test]
    fn a_device_or_a_pipe_is_no_map() {
        let refused = Map::load(Path::new("/dev/null"));
        let refused = refused.map(drop).map_err(|e| e.to_string());
        assert!(
            refused
                .as_ref()
                .is_err_and(|e| e.contains("not a regular file")),
            "{refused:?}"
        );
    }

    #[test]
    fn walls_boxes_robot_and_comments_are_read() {
        let map =
            parse("# a floor\nwall 0 0 1000 0\n\nbox 400 300 200 100 # a table\nrobot 50 60 90\n")
                .unwrap();
        assert_eq!(
            map.walls,
            [Segment {
                a: Point::new(0.0, 0.0),
                b: Point::new(1000.0, 0.0)
            }]
        );
        assert_eq!(
            map.boxes,
            [Bounds {
                min: Point::new(200.0, 100.0),
                max: Point::new(400.0, 300.0)
            }]
        );
        assert_eq!(
            map.start,
            Pose::new(50.0, 60.0, std::f64::consts::FRAC_PI_2)
        );
        assert_eq!(map.segments().len(), 5);
        assert_eq!(
            map.bounds(),
            Bounds::new(Point::new(0.0, 0.0), Point::new(1000.0, 300.0))
        );
    }

    #[test]
    fn each_fault_names_its_line_and_what_is_allowed() {
        let fault = |text| parse(text).unwrap_err();
        assert_eq!(
            fault("wall 0 0 1\n"),
            "a.map:1: 3 numbers where 4 belong: `wall x1 y1 x2 y2`"
        );
        assert_eq!(
            fault("\nbox 0 0 one 1"),
            "a.map:2: `one` is not a number: `box x1 y1 x2 y2`"
        );
        assert_eq!(
            fault("robot 0 0 nan"),
            "a.map:1: `nan` is not a number: `robot x y heading`"
        );
        assert_eq!(
            fault("door 1"),
            "a.map:1: `door` is nothing of a map; allowed are wall, box and robot"
        );
        assert_eq!(
            fault("robot 0 0 0\nrobot 1 1 0"),
            "a.map:2: a second `robot`; the first one is in line 1"
        );
        assert_eq!(
            fault("wall 0 0 1 1\n"),
            "a.map:1: there is no robot; add `robot x y heading`"
        );
        assert_eq!(
            fault("robot 0 0 0"),
            "a.map:1: there is nothing on this floor; add `wall x1 y1 x2 y2`"
        );
    }

    #[test]
    fn a_missing_file_is_named() {
        let error = Map::load(Path::new("/nowhere/a.map"))
            .unwrap_err()
            .to_string();
        assert!(error.starts_with("/nowhere/a.map: "), "{error}");
    }
}
