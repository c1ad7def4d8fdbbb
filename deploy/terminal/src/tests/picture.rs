//! The picture of the live view in the documents, drawn from the same cells that a terminal shows.

use super::*;
use expect_test::expect_file;
use ratatui::buffer::Buffer;
use ratatui::style::Modifier;

/// Size of a cell, in units of the picture.
const CELL: (usize, usize) = (8, 17);

fn colour(colour: Color) -> &'static str {
    match colour {
        Color::Green => "#7fc97f",
        Color::Yellow => "#e6c454",
        Color::Red => "#f2777a",
        _ => "#d8d8d8",
    }
}

/// The cells as an SVG: one text for each run of equal style.
fn svg(buffer: &Buffer) -> String {
    let (width, height) = (buffer.area.width as usize, buffer.area.height as usize);
    let (w, h) = (width * CELL.0 + 16, height * CELL.1 + 16);
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {w} {h}\" width=\"{w}\" height=\"{h}\" \
         font-family=\"monospace\" font-size=\"13\">\n<title>The live view of a network</title>\n\
         <rect width=\"{w}\" height=\"{h}\" rx=\"6\" fill=\"#1e1e1e\"/>\n"
    );
    for (row, cells) in buffer.content.chunks(width).enumerate() {
        let mut column = 0;
        for run in cells.chunk_by(|a, b| a.style() == b.style()) {
            let text: String = run.iter().map(ratatui::buffer::Cell::symbol).collect();
            let text = text.replace('&', "&amp;").replace('<', "&lt;");
            let (x, y) = (8 + column * CELL.0, 8 + row * CELL.1);
            let (length, modifier) = (run.len() * CELL.0, run[0].modifier);
            let mut fill = colour(run[0].fg);
            if modifier.contains(Modifier::REVERSED) {
                svg += &format!(
                    "<rect x=\"{x}\" y=\"{y}\" width=\"{length}\" height=\"{}\" fill=\"{fill}\"/>\n",
                    CELL.1
                );
                fill = "#1e1e1e";
            }
            if !text.trim().is_empty() {
                let bold = if modifier.contains(Modifier::BOLD) {
                    " font-weight=\"bold\""
                } else {
                    ""
                };
                let dim = if modifier.contains(Modifier::DIM) {
                    " opacity=\"0.6\""
                } else {
                    ""
                };
                svg += &format!(
                    "<text x=\"{x}\" y=\"{}\" textLength=\"{length}\" xml:space=\"preserve\" fill=\"{fill}\"{bold}{dim}>{text}</text>\n",
                    y + 13
                );
            }
            column += run.len();
        }
    }
    svg + "</svg>\n"
}

/// The network `patrol` after one minute.
fn patrol() -> Model {
    let mut model = Model::new(Host::Up, "patrol", true);
    let mut network = status();
    network.components.truncate(3);
    let names = ["simulator", "monitor", "avoider"];
    for (component, name) in network.components.iter_mut().zip(names) {
        name.clone_into(&mut component.name);
        component.uptime_s = Some(62.0);
        component.restarts = 0;
    }
    model.status(network);
    for seconds in [4, 6] {
        let now = Duration::from_secs(seconds);
        for (at, name) in names.into_iter().enumerate() {
            let slots = match name {
                "simulator" => json!([
                    slot("Laser", "implements", "patrol/simulator/Laser", 20, seconds),
                    slot(
                        "FullPoseEstimationPub",
                        "publishes",
                        "patrol/pose",
                        20,
                        seconds
                    ),
                ]),
                "avoider" => {
                    json!([slot(
                        "Laser",
                        "requires",
                        "patrol/simulator/Laser",
                        20,
                        seconds
                    )])
                }
                _ => {
                    json!([slot(
                        "FullPoseEstimationPub",
                        "subscribesTo",
                        "patrol/pose",
                        20,
                        seconds
                    )])
                }
            };
            let mut report = report(name, seconds);
            report.slots = serde_json::from_value(slots).expect("slots");
            model.report(name, report, now);
            let sample = Sample {
                busy: Duration::from_millis(seconds * (at as u64 * 4 + 6)),
                memory: (at as u64 + 11) << 20,
            };
            model.sample(name, Some(sample), now);
        }
        model.tick(now);
    }
    for (second, name, seconds) in [
        (1, "simulator", 0.12),
        (1, "monitor", 0.05),
        (2, "avoider", 0.06),
    ] {
        let ready = format!("ready after {seconds:.2} s");
        model.event(event(second, Some(name), "info", &ready));
    }
    model.event(event(2, None, "info", "network patrol is up"));
    model
}

#[test]
fn the_picture_in_the_documents_is_up_to_date() {
    let (width, height) = (88, 12);
    let mut model = patrol();
    let mut terminal = Terminal::new(TestBackend::new(width, height)).expect("a terminal");
    model.size = (width, height);
    let drawn = terminal.draw(|frame| render::draw(&model, frame.area(), frame.buffer_mut()));
    drawn.expect("drawn");
    expect_file!["../../../../docs/images/live-view.svg"]
        .assert_eq(&svg(terminal.backend().buffer()));
}
