//! The picture of the live view in the documents: the screen of a real run.

use crate::pty::{SETSID, Terminal};
use rc_test_site::site::Site;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Size of a cell, in units of the picture.
const CELL: (u16, u16) = (8, 17);
/// Size of the screen.
const SIZE: (u16, u16) = (100, 12);
/// The states of the avoider's machine.
const STATES: [&str; 5] = ["idle", "charging", "cruising", "turning", "blocked"];

fn colour(colour: vt100::Color) -> &'static str {
    match colour {
        vt100::Color::Idx(2 | 10) => "#7fc97f",
        vt100::Color::Idx(3 | 11) => "#e6c454",
        vt100::Color::Idx(1 | 9) => "#f2777a",
        _ => "#d8d8d8",
    }
}

/// The look of a cell: its colour, and whether it is bold, faint, inverse.
fn look(cell: &vt100::Cell) -> (&'static str, bool, bool, bool) {
    (
        colour(cell.fgcolor()),
        cell.bold(),
        cell.dim(),
        cell.inverse(),
    )
}

/// The screen as an SVG: one text for each run of equal look.
fn svg(screen: &vt100::Screen) -> String {
    let (columns, lines) = SIZE;
    let (w, h) = (columns * CELL.0 + 16, lines * CELL.1 + 16);
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {w} {h}\" width=\"{w}\" height=\"{h}\" \
         font-family=\"monospace\" font-size=\"13\">\n<title>The live view of a network</title>\n\
         <rect width=\"{w}\" height=\"{h}\" rx=\"6\" fill=\"#1e1e1e\"/>\n"
    );
    for line in 0..lines {
        let cells: Vec<&vt100::Cell> = (0..columns)
            .filter_map(|column| screen.cell(line, column))
            .collect();
        let mut column = 0;
        for run in cells.chunk_by(|a, b| look(a) == look(b)) {
            let text = run.iter().map(|cell| match cell.contents() {
                "" => " ",
                text => text,
            });
            let text: String = text.collect();
            let text = text.replace('&', "&amp;").replace('<', "&lt;");
            let (x, y) = (8 + column * CELL.0, 8 + line * CELL.1);
            let length = run.len() as u16 * CELL.0;
            let (mut fill, bold, dim, inverse) = look(run[0]);
            if inverse {
                svg += &format!(
                    "<rect x=\"{x}\" y=\"{y}\" width=\"{length}\" height=\"{}\" fill=\"{fill}\"/>\n",
                    CELL.1
                );
                fill = "#1e1e1e";
            }
            if !text.trim().is_empty() {
                let bold = if bold { " font-weight=\"bold\"" } else { "" };
                let dim = if dim { " opacity=\"0.6\"" } else { "" };
                svg += &format!(
                    "<text x=\"{x}\" y=\"{}\" textLength=\"{length}\" xml:space=\"preserve\" fill=\"{fill}\"{bold}{dim}>{text}</text>\n",
                    y + 13
                );
            }
            column += run.len() as u16;
        }
    }
    svg + "</svg>\n"
}

/// The words of a picture, line by line.
fn lines(svg: &str) -> BTreeMap<u16, String> {
    let mut lines: BTreeMap<u16, String> = BTreeMap::new();
    for text in svg.lines().filter(|line| line.starts_with("<text")) {
        let y = text.split("y=\"").nth(1).and_then(|y| y.split('"').next());
        let y = y.and_then(|y| y.parse().ok()).unwrap_or(0);
        let words = text.split_once('>').map_or("", |(_, rest)| rest);
        let words = words.strip_suffix("</text>").unwrap_or(words);
        // Spaces between two texts are none.
        *lines.entry(y).or_default() += &format!("{words} ");
    }
    lines
}

/// The constant content of a picture: the names of the components and the columns, and whose
/// machine is in a state.
fn content(svg: &str) -> Vec<String> {
    let shown = lines(svg).into_values().filter_map(|line| {
        let words: Vec<&str> = line.split_whitespace().collect();
        let name = *words.first()?;
        if name == "COMPONENT" {
            return Some(words.join(" "));
        }
        let has_states = words.iter().any(|word| STATES.contains(word));
        let is_row = ["simulator", "monitor", "avoider"].contains(&name);
        is_row.then(|| format!("{name} {has_states}"))
    });
    shown.collect()
}

fn picture() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/images/live-view.svg")
}

#[test]
fn the_picture_in_the_documents_is_of_a_real_run() {
    let site = Site::new("patrol");
    let ddsl = site.ddsl().display().to_string();
    let [setsid, argument] = SETSID;
    let mut command = site.command(Path::new(setsid));
    command
        .args([argument, env!("CARGO_BIN_EXE_rcdeploy")])
        .args(["up", "--profile", "dev", &ddsl]);
    let mut terminal = Terminal::start(command, SIZE);
    terminal.until("states and rates", |screen| {
        let contents = screen.contents();
        let row = |name: &str| contents.lines().find(|line| line.starts_with(name));
        let has_rates = |name| row(name).is_some_and(|row| !row.contains(" - "));
        let in_state = |row: &str| STATES.iter().any(|state| row.contains(state));
        contents.contains("is up")
            && ["simulator", "monitor"].into_iter().all(has_rates)
            && row("avoider").is_some_and(in_state)
    });
    // The network has a name of its own in each test; the picture has that of the documents, and
    // the spaces at the end of a line.
    let width = site.network.len();
    let made = svg(terminal.screen());
    let made = made.replace(
        &format!("network {} is up", site.network),
        &format!("network patrol is up{}", " ".repeat(width - "patrol".len())),
    );
    let made = made.replace(&site.network, &format!("{:width$}", "patrol"));
    if std::env::var_os("UPDATE_EXPECT").is_some() {
        std::fs::write(picture(), &made).expect("to write");
    }
    let expected = std::fs::read_to_string(picture()).expect("the picture");
    assert_eq!(content(&made), content(&expected));
    let of = |name: &str| content(&made).iter().any(|row| row == name);
    assert!(
        of("avoider true") && of("monitor false") && of("simulator false"),
        "{made}"
    );
    terminal.press("\u{3}");
    assert_eq!(terminal.end().0, Some(0));
    site.assert_nothing_left();
}
