//! A short run of `cargo xtask bench place`: the same components as threads, as processes and on two
//! hosts, a chain of ten, and a pair with a proxy exchange messages, and each row is measured.

use crate::quiet;
use rc_test_support::python::skipped;
use std::process::Command;

#[test]
fn components_are_measured_in_each_placement() {
    let _quiet = quiet();
    let run = Command::new(env!("CARGO_BIN_EXE_trials"))
        .args(["bench", "place", "--smoke"])
        .output()
        .expect("to run trials");
    let output = String::from_utf8_lossy(&run.stdout);
    let errors = String::from_utf8_lossy(&run.stderr);
    assert_eq!(run.status.code(), Some(0), "{output}{errors}");
    let cells = |row: &str| -> Vec<String> {
        let line = output.lines().find(|line| line.starts_with(row));
        let line = line.unwrap_or_else(|| panic!("no {row}: {output}"));
        line.split('|').map(|cell| cell.trim().to_owned()).collect()
    };
    let mut lines = errors.lines();
    if let Some(line) = lines.find(|line| line.contains("two hosts were not measured: ")) {
        skipped("two hosts in bench place", line);
    } else {
        for row in ["| publish 64 B,", "| publish 1 MiB copied", "| query 64 B,"] {
            let p50: f64 = cells(row)[8].parse().expect("a time");
            assert!(p50 > 0.0, "{output}");
        }
    }
    for size in ["64 KiB", "256 KiB", "1 MiB", "4 MiB"] {
        let row = cells(&format!("| {size} in place"));
        assert_ne!(row[2], "0.0", "{output}");
    }
    // A value in one process takes what it has, and no encoding.
    assert_eq!(cells("| 1 MiB, one process |")[2], "2", "{output}");
    for row in ["| 64 B through ten", "| 64 KiB through ten"] {
        assert_ne!(cells(row)[2], "0.0", "{output}");
    }
    let memory = cells("| memory of the chain");
    let [one, ten] = [&memory[2], &memory[3]].map(|text| text.parse::<f64>().expect("MB"));
    assert!(one < ten, "{memory:?}");
    // The last table, of proxies, has rows with the names of the first one.
    let (_, proxies) = output.split_once("through a proxy").expect("proxies");
    for row in ["| publish 64 B,", "| publish 1 MiB copied", "| query 64 B,"] {
        let row = proxies.lines().find(|line| line.starts_with(row));
        let row: Vec<&str> = row.expect("a row").split('|').map(str::trim).collect();
        let [hop, through] = [row[2], row[4]].map(|text| text.parse::<f64>().expect("a time"));
        assert!(hop > 0.0 && through > 0.0, "{row:?}");
        // The median of many calls.
        assert!(!row[1].starts_with("query") || hop < through, "{row:?}");
    }
}
