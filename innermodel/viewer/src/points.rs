//! Files of points: a point on each line, as X Y Z or X Y Z red green blue.

use crate::command_line::Failure;
use innermodel::{Clouds, ColouredPoint};
use rc_diagnostics::foreign::clean;
use std::fs::File;
use std::io::Read;
use std::path::Path;

/// The largest file that is read, in bytes.
const LARGEST: u64 = 1 << 30;
/// The colour of points without one.
const PLAIN: [u8; 3] = [255; 3];

/// Reads a file.
pub(crate) fn read(path: &Path) -> Result<Vec<ColouredPoint>, Failure> {
    let system = |error: &dyn std::fmt::Display| {
        let path = clean(&path.display().to_string());
        Failure::System(format!("{path}: {error}"))
    };
    // Check before opening: opening a device can have side effects.
    let about = std::fs::metadata(path).map_err(|error| system(&error))?;
    if !about.is_file() {
        return Err(system(&"this is not a regular file"));
    }
    if about.len() > LARGEST {
        return Err(system(&"expected at most 1 GiB"));
    }
    let mut bytes = Vec::new();
    let file = File::open(path).map_err(|error| system(&error))?;
    let read = file.take(LARGEST).read_to_end(&mut bytes);
    read.map_err(|error| system(&error))?;
    let mut points = Vec::new();
    for (number, line) in String::from_utf8_lossy(&bytes).lines().enumerate() {
        let line = line.trim();
        if line.is_empty() || line.starts_with('#') {
            continue;
        }
        let wrong = |what: &str| {
            let path = clean(&path.display().to_string());
            Failure::Input(format!("{path}:{}: {what}", number + 1))
        };
        if points.len() == Clouds::MOST_POINTS {
            let most = Clouds::MOST_POINTS;
            return Err(wrong(&format!("expected at most {most} points")));
        }
        let expected = || {
            let line: String = line.chars().take(80).collect();
            let line = clean(&line);
            wrong(&format!(
                "expected three finite numbers, or three with red, green and blue from 0 to 255, found `{line}`"
            ))
        };
        points.push(point(line).ok_or_else(expected)?);
    }
    Ok(points)
}

fn point(line: &str) -> Option<ColouredPoint> {
    let words: Vec<&str> = line.split_whitespace().take(7).collect();
    let ([x, y, z], colour) = words.split_first_chunk()?;
    let number = |word: &str| word.parse().ok().filter(|n: &f32| n.is_finite());
    let colour = match *colour {
        [] => PLAIN,
        [red, green, blue] => [red.parse().ok()?, green.parse().ok()?, blue.parse().ok()?],
        _ => return None,
    };
    Some(ColouredPoint {
        position: [number(x)?, number(y)?, number(z)?],
        colour,
    })
}
