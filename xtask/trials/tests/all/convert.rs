//! A short run of `cargo xtask bench convert`: connections that convert are measured beside plain ones.

use crate::quiet;
use std::process::Command;

#[test]
fn connections_that_convert_are_measured() {
    let _quiet = quiet();
    let run = Command::new(env!("CARGO_BIN_EXE_trials"))
        .args(["bench", "convert", "--smoke"])
        .output()
        .expect("to run trials");
    let output = String::from_utf8_lossy(&run.stdout);
    let errors = String::from_utf8_lossy(&run.stderr);
    assert_eq!(run.status.code(), Some(0), "{output}{errors}");
    let measured = |row: &str| -> String {
        let line = output.lines().find(|line| line.starts_with(row));
        let line = line.unwrap_or_else(|| panic!("no {row}: {output}"));
        line.split('|').nth(3).expect("a cell").trim().to_owned()
    };
    for row in [
        "| connection of 64 B that",
        "| connection of 1 MiB of points",
    ] {
        let measured = measured(row);
        let (ratio, _) = measured.split_once(':').expect("a ratio");
        let ratio: f64 = ratio.parse().expect("a number");
        assert!(ratio.is_finite() && ratio > 0.0, "{measured}");
    }
    let linked = measured("| code of conversions");
    assert!(linked.starts_with("0; "), "{linked}");
}
