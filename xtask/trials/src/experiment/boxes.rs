//! Box plots as the paper has them: a box from the first to the third quartile with a red line at the
//! median, and a green diamond for each measurement outside of the box.

use std::fmt::Write;

/// The measurements of one box, with its name.
pub(super) struct Row {
    pub(super) name: String,
    pub(super) values: Vec<f64>,
    /// Whether it is drawn darker, to tell rows in pairs apart.
    pub(super) dark: bool,
}

const LEFT: f64 = 330.0;
const WIDTH: f64 = 560.0;
const HEIGHT: f64 = 26.0;
const TOP: f64 = 44.0;

/// First quartile, median and third quartile, between the two nearest measurements.
pub(super) fn quartiles(values: &[f64]) -> [f64; 3] {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    [0.25, 0.5, 0.75].map(|part| {
        let at = part * sorted.len().saturating_sub(1) as f64;
        let (below, above) = (at.floor() as usize, at.ceil() as usize);
        match (sorted.get(below), sorted.get(above)) {
            (Some(a), Some(b)) => a + (b - a) * at.fract(),
            _ => 0.0,
        }
    })
}

/// The picture, with a logarithmic axis from 1 on.
pub(super) fn svg(title: &str, axis: &str, rows: &[Row]) -> String {
    let all = rows.iter().flat_map(|row| &row.values);
    let decades = all.copied().fold(10.0, f64::max).log10().ceil();
    let x = |value: f64| LEFT + WIDTH * value.max(1.0).log10() / decades;
    let bottom = TOP + HEIGHT * rows.len() as f64;
    let (width, height) = (LEFT + WIDTH + 30.0, bottom + 46.0);
    let mut out = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" viewBox=\"0 0 {width} {height}\" font-family=\"sans-serif\" font-size=\"13\">\n\
         <rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n<text x=\"{LEFT}\" y=\"24\" font-size=\"15\">{title}</text>\n"
    );
    // Text goes nowhere but into this string.
    for decade in 0..=decades as i32 {
        let (at, label) = (x(10_f64.powi(decade)), 10_i64.pow(decade.unsigned_abs()));
        let _ = writeln!(
            out,
            "<line x1=\"{at:.1}\" y1=\"{TOP}\" x2=\"{at:.1}\" y2=\"{bottom}\" stroke=\"#ccc\"/>\
             <text x=\"{at:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{label}</text>",
            bottom + 18.0
        );
    }
    for (number, row) in rows.iter().enumerate() {
        let top = TOP + HEIGHT * number as f64;
        let middle = top + HEIGHT / 2.0;
        let [first, median, third] = quartiles(&row.values);
        let (from, at, to) = (x(first), x(median), x(third));
        let fill = if row.dark { "#9db4d0" } else { "#e3ebf5" };
        let _ = writeln!(
            out,
            "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{}</text>\
             <rect x=\"{from:.1}\" y=\"{:.1}\" width=\"{:.1}\" height=\"{:.1}\" fill=\"{fill}\" stroke=\"#333\"/>\
             <line x1=\"{at:.1}\" y1=\"{:.1}\" x2=\"{at:.1}\" y2=\"{:.1}\" stroke=\"red\" stroke-width=\"2\"/>",
            LEFT - 10.0,
            middle + 4.0,
            row.name,
            top + 5.0,
            (to - from).max(1.0),
            HEIGHT - 10.0,
            top + 5.0,
            top + HEIGHT - 5.0,
        );
        let outside = row
            .values
            .iter()
            .filter(|value| **value < first || **value > third);
        for value in outside {
            let at = x(*value);
            let _ = writeln!(
                out,
                "<path d=\"M{:.1} {middle:.1} l4 -4 l4 4 l-4 4 z\" fill=\"green\"/>",
                at - 4.0
            );
        }
    }
    let _ = writeln!(
        out,
        "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{axis}</text>\n</svg>",
        LEFT + WIDTH / 2.0,
        bottom + 38.0
    );
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quartiles_lie_between_measurements() {
        assert_eq!(quartiles(&[4.0, 1.0, 3.0, 2.0, 5.0]), [2.0, 3.0, 4.0]);
        assert_eq!(quartiles(&[1.0, 2.0]), [1.25, 1.5, 1.75]);
        assert_eq!(quartiles(&[7.0]), [7.0; 3]);
    }

    #[test]
    fn a_picture_has_a_box_and_a_median_for_each_row_and_diamonds_outside() {
        let row = |name: &str, values: &[f64]| Row {
            name: name.to_owned(),
            values: values.to_vec(),
            dark: false,
        };
        let rows = [row("a", &[1.0, 2.0, 3.0, 100.0]), row("b", &[5.0; 4])];
        let svg = svg("Lines", "lines", &rows);
        // The medians are 2.5 and 5 of 100, on two decades.
        for at in ["441.4", "525.7"] {
            let line = format!("<line x1=\"{at}\" y1=\"");
            assert!(
                svg.contains(&line) && svg.contains(&format!("x2=\"{at}\"")),
                "{svg}"
            );
        }
        assert_eq!(svg.matches("stroke=\"red\"").count(), 2);
        assert_eq!(svg.matches("fill=\"green\"").count(), 2);
        assert_eq!(svg.matches("stroke=\"#333\"").count(), 2);
        assert!(svg.contains(">100</text>") && !svg.contains(">1000</text>"));
    }
}
