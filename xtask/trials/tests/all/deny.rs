//! A short run of `cargo xtask deny`: the dependencies are as `deny.toml` demands.

use std::process::Command;

#[test]
fn dependencies_are_as_demanded() {
    let run = Command::new(env!("CARGO_BIN_EXE_trials"))
        .args(["deny", "--smoke"])
        .output()
        .expect("to run trials");
    let output = String::from_utf8_lossy(&run.stdout);
    let errors = String::from_utf8_lossy(&run.stderr);
    assert_eq!(run.status.code(), Some(0), "{output}{errors}");
    match output.lines().find(|line| line.starts_with("skipped: ")) {
        None => assert!(output.contains("as deny.toml demands"), "{output}"),
        Some(line) => {
            let list = std::env::var_os("RC_TEST_SKIPPED").map(|list| {
                let mut options = std::fs::File::options();
                options.append(true).create(true).open(list)
            });
            if let Some(list) = list {
                let mut list = list.expect("the list of skipped tests");
                std::io::Write::write_all(&mut list, format!("{line}\n").as_bytes())
                    .expect("written");
            }
        }
    }
}
