//! The map and the way of the robot as an SVG, in mm.

use crate::track::Track;
use planar_map::{Map, Point, Pose, libm};
use std::fmt::{self, Write};

/// Free space around the floor, in mm.
const MARGIN: f64 = 200.0;
/// Space below for the scale bar and the colours, in mm.
const FOOT: f64 = 500.0;
/// Length of the scale bar, in mm.
const BAR: f64 = 1000.0;
/// Height of letters, in mm.
const TEXT: f64 = 170.0;
/// How many colours the way has from its start to its end.
const COLOURS: usize = 64;
/// The colours at the start, the middle and the end: they differ in brightness too, for prints in
/// grey.
const STOPS: [[f64; 3]; 3] = [
    [46.0, 49.0, 146.0],
    [196.0, 62.0, 111.0],
    [250.0, 176.0, 60.0],
];

/// A document of its own: walls, furniture, the way coloured by time, marks of its start and end, a
/// scale bar.
pub(crate) fn svg(map: &Map, track: &Track) -> Result<String, fmt::Error> {
    let page = Page::over(map);
    let mut out = String::new();
    let (width, height) = (page.width, page.height);
    writeln!(
        out,
        r#"<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width:.0} {height:.0}" width="{:.0}mm" height="{:.0}mm" font-family="sans-serif" font-size="{TEXT}">"#,
        width / 50.0,
        height / 50.0
    )?;
    writeln!(
        out,
        r#"<rect width="{width:.0}" height="{height:.0}" fill="white"/>"#
    )?;
    floor(&mut out, &page, map)?;
    way(&mut out, &page, track)?;
    marks(&mut out, &page, track)?;
    foot(&mut out, &page, track)?;
    writeln!(out, "</svg>")?;
    Ok(out)
}

/// The paper: its y points down, the floor's up.
struct Page {
    left: f64,
    top: f64,
    width: f64,
    height: f64,
}

impl Page {
    fn over(map: &Map) -> Self {
        let bounds = map.bounds();
        Self {
            left: bounds.min.x - MARGIN,
            top: bounds.max.y + MARGIN,
            width: bounds.width().max(3.0 * BAR) + 2.0 * MARGIN,
            height: bounds.height() + 2.0 * MARGIN + FOOT,
        }
    }

    fn x(&self, point: Point) -> f64 {
        point.x - self.left
    }

    fn y(&self, point: Point) -> f64 {
        self.top - point.y
    }
}

fn floor(out: &mut String, page: &Page, map: &Map) -> fmt::Result {
    writeln!(
        out,
        r##"<g fill="#e4e4e4" stroke="#8a8a8a" stroke-width="15">"##
    )?;
    for piece in &map.boxes {
        let corner = Point::new(piece.min.x, piece.max.y);
        let (x, y) = (page.x(corner), page.y(corner));
        writeln!(
            out,
            r#"<rect x="{x:.0}" y="{y:.0}" width="{:.0}" height="{:.0}"/>"#,
            piece.width(),
            piece.height()
        )?;
    }
    writeln!(out, "</g>")?;
    writeln!(
        out,
        r##"<g stroke="#222222" stroke-width="60" stroke-linecap="round">"##
    )?;
    for wall in &map.walls {
        let (x1, y1, x2, y2) = (
            page.x(wall.a),
            page.y(wall.a),
            page.x(wall.b),
            page.y(wall.b),
        );
        writeln!(
            out,
            r#"<line x1="{x1:.0}" y1="{y1:.0}" x2="{x2:.0}" y2="{y2:.0}"/>"#
        )?;
    }
    writeln!(out, "</g>")
}

/// One line for each colour; neighbours share a point.
fn way(out: &mut String, page: &Page, track: &Track) -> fmt::Result {
    writeln!(
        out,
        r#"<g fill="none" stroke-width="35" stroke-linejoin="round" stroke-linecap="round">"#
    )?;
    let index = |number: usize| (number * COLOURS / (track.count + 1)).min(COLOURS - 1);
    let mut rest = track.kept.as_slice();
    while let Some(((number, _), after)) = rest.split_first() {
        let colour = index(*number);
        let same = after
            .iter()
            .take_while(|(number, _)| index(*number) == colour)
            .count();
        let end = (same + 2).min(rest.len());
        write!(
            out,
            r#"<polyline stroke="{}" points=""#,
            tint(colour as f64 / (COLOURS - 1) as f64)
        )?;
        for (_, pose) in &rest[..end] {
            write!(
                out,
                "{:.0},{:.0} ",
                page.x(pose.point()),
                page.y(pose.point())
            )?;
        }
        writeln!(out, r#""/>"#)?;
        rest = &rest[same + 1..];
    }
    writeln!(out, "</g>")
}

/// A ring where the robot started, a triangle where it is now.
fn marks(out: &mut String, page: &Page, track: &Track) -> fmt::Result {
    if let Some((_, start)) = track.kept.first() {
        let (x, y) = (page.x(start.point()), page.y(start.point()));
        let colour = tint(0.0);
        writeln!(
            out,
            r#"<circle cx="{x:.0}" cy="{y:.0}" r="90" fill="white" stroke="{colour}" stroke-width="35"><title>start</title></circle>"#
        )?;
    }
    if let Some(last) = track.last {
        let corner = |angle: f64, far: f64| {
            let Pose { x, y, heading } = last;
            let (sin, cos) = libm::sincos(heading + angle);
            let point = Point::new(x + far * cos, y + far * sin);
            format!("{:.0},{:.0}", page.x(point), page.y(point))
        };
        let points = [corner(0.0, 200.0), corner(2.5, 160.0), corner(-2.5, 160.0)].join(" ");
        let colour = tint(1.0);
        writeln!(
            out,
            r##"<polygon points="{points}" fill="{colour}" stroke="#222222" stroke-width="15"><title>end</title></polygon>"##
        )?;
    }
    Ok(())
}

/// The scale bar, and the meaning of the colours.
fn foot(out: &mut String, page: &Page, track: &Track) -> fmt::Result {
    let (left, base) = (MARGIN, page.height - MARGIN);
    let (end, above, text) = (left + BAR, base - 60.0, base - 100.0);
    writeln!(
        out,
        r##"<path d="M{left:.0} {above:.0}V{base:.0}H{end:.0}V{above:.0}" fill="none" stroke="#222222" stroke-width="20"/>"##
    )?;
    writeln!(
        out,
        r#"<text x="{:.0}" y="{text:.0}" text-anchor="middle">1 m</text>"#,
        left + BAR / 2.0
    )?;
    let (from, bar) = (page.width - MARGIN - BAR, BAR / COLOURS as f64);
    for index in 0..COLOURS {
        let (x, colour) = (
            from + index as f64 * bar,
            tint(index as f64 / (COLOURS - 1) as f64),
        );
        writeln!(
            out,
            r#"<rect x="{x:.1}" y="{above:.0}" width="{:.1}" height="60" fill="{colour}"/>"#,
            bar + 1.0
        )?;
    }
    let (right, metres, count) = (page.width - MARGIN, track.metres(), track.count);
    writeln!(
        out,
        r#"<text x="{right:.0}" y="{text:.0}" text-anchor="end">{metres:.1} m, {count} poses</text>"#
    )
}

/// The colour at `part`, from 0 at the start to 1 at the end.
fn tint(part: f64) -> String {
    let (low, part) = if part < 0.5 {
        (0, part * 2.0)
    } else {
        (1, part * 2.0 - 1.0)
    };
    let mix = |channel: usize| {
        let (from, to) = (STOPS[low][channel], STOPS[low + 1][channel]);
        (from + (to - from) * part).round() as u8
    };
    format!("#{:02x}{:02x}{:02x}", mix(0), mix(1), mix(2))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    fn drawn(poses: u32) -> String {
        let map = Map::parse(
            Path::new("test"),
            "wall 0 0 4000 0\nbox 0 500 400 900\nrobot 300 500 0",
        )
        .unwrap();
        let mut track = Track::default();
        (0..poses)
            .for_each(|step| track.add(Pose::new(500.0 + 30.0 * f64::from(step), 300.0, 0.0)));
        svg(&map, &track).unwrap()
    }

    #[test]
    fn the_page_has_the_floor_the_way_and_the_scale() {
        let page = drawn(100);
        assert!(page.starts_with("<svg ") && page.ends_with("</svg>\n"));
        assert!(
            page.contains(r#"<line x1="200" y1="1100" x2="4200" y2="1100"/>"#),
            "{page}"
        );
        assert!(
            page.contains(r#"<rect x="200" y="200" width="400" height="400"/>"#),
            "{page}"
        );
        assert!(
            page.contains(">1 m</text>") && page.contains(">3.0 m, 100 poses</text>"),
            "{page}"
        );
        assert!(page.contains("<title>start</title>") && page.contains("<title>end</title>"));
    }

    #[test]
    fn every_piece_of_the_way_is_drawn_and_joined() {
        let page = drawn(100);
        let lines: Vec<Vec<&str>> = page
            .lines()
            .filter_map(|line| line.strip_prefix("<polyline "))
            .filter_map(|line| line.split('"').nth(3))
            .map(|points| points.split_whitespace().collect())
            .collect();
        assert!(lines.len() > 60, "{}", lines.len());
        assert!(
            lines
                .windows(2)
                .all(|pair| pair[0].last() == pair[1].first())
        );
        assert_eq!(lines.iter().map(|line| line.len() - 1).sum::<usize>(), 99);
    }

    #[test]
    fn a_page_without_poses_has_only_the_floor() {
        let page = drawn(0);
        assert!(!page.contains("<polyline") && !page.contains("<title>"));
    }

    #[test]
    fn colours_go_from_the_first_stop_to_the_last() {
        assert_eq!(
            [tint(0.0), tint(0.5), tint(1.0)],
            ["#2e3192", "#c43e6f", "#fab03c"]
        );
    }
}
