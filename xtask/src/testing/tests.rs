//! When the repetition of failed tests turns a run into a pass.

use super::*;

/// The output of a run in which `tests` of one target failed.
fn output(tests: &[&str], target: &str) -> Report {
    let mut report = Report::default();
    let names: String = tests.iter().map(|test| format!("    {test}\n")).collect();
    let failed = tests.len();
    let result = if failed == 0 { "ok" } else { "FAILED" };
    let mut text = format!(
        "     Running tests/all/main.rs (target/debug/deps/all-1)\n\nrunning {failed} tests\n\n\
         failures:\n{names}\n\
         test result: {result}. {} passed; {failed} failed; 0 ignored; 0 measured\n",
        12 - failed
    );
    if failed > 0 {
        text += &format!(
            "error: test failed, to rerun pass `{target}`\nerror: 1 target failed:\n    `{target}`\n"
        );
    }
    text.lines().for_each(|line| report.note(line));
    report
}

/// The output of a second run of `tests`, in which `failed` fail again.
fn second(tests: &[&str], failed: &[&str]) -> Report {
    let mut report = Report::default();
    let names: String = failed.iter().map(|test| format!("    {test}\n")).collect();
    let text = format!(
        "     Running tests/all/main.rs (target/debug/deps/all-1)\nfailures:\n{names}\n\
         test result: any. {} passed; {} failed; 0 ignored; 0 measured\n",
        tests.len() - failed.len(),
        failed.len()
    );
    text.lines().for_each(|line| report.note(line));
    report
}

#[test]
fn a_test_that_passes_the_second_time_is_unsteady() {
    let first = output(&["a", "b"], "-p x --test all");
    let passed = repeat(&first, |_| second(&["a", "b"], &[]));
    let lines = ["unsteady: -p x --test all a", "unsteady: -p x --test all b"];
    assert_eq!(passed, Ok(lines.map(str::to_owned).to_vec()));
}

#[test]
fn a_test_that_fails_twice_fails_the_run() {
    let first = output(&["a", "b"], "-p x --test all");
    let passed = repeat(&first, |_| second(&["a", "b"], &["b"]));
    let lines = [
        "unsteady: -p x --test all a",
        "failed twice: -p x --test all b",
    ];
    assert_eq!(passed, Err(lines.map(str::to_owned).to_vec()));
}

#[test]
fn many_failed_tests_and_examples_of_documentation_are_not_repeated() {
    let names: Vec<String> = (0..=REPEATED).map(|n| n.to_string()).collect();
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    let none = |_: &Block| -> Report { unreachable!("nothing is repeated") };
    let line = "not repeated: 11 tests failed, more than 10".to_owned();
    assert_eq!(repeat(&output(&names, "-p x --lib"), none), Err(vec![line]));
    let doubt = "examples in documentation are not repeated";
    let line = format!("not repeated: -p x --doc: {doubt}");
    assert_eq!(repeat(&output(&["a"], "-p x --doc"), none), Err(vec![line]));
    let line = "not repeated: cargo lists no failed targets".to_owned();
    assert_eq!(repeat(&output(&[], "-p x --lib"), none), Err(vec![line]));
}

/// The output of a program that a signal has ended.
fn aborted() -> Report {
    let mut report = Report::default();
    let text = "     Running tests/all/main.rs (target/debug/deps/all-1)\n\nrunning 2 tests\n\
        test a ... ok\nerror: test failed, to rerun pass `-p x --test all`\n  all-1: signal: 6 (SIGABRT)\n\
        error: 1 target failed:\n    `-p x --test all`\n";
    text.lines().for_each(|line| report.note(line));
    report
}

#[test]
fn a_program_that_a_signal_ends_is_repeated_as_a_whole_and_told() {
    let lines = |what: &str| {
        let first = format!("{what}: -p x --test all: it ended without a list of failed tests");
        let rest = [
            "    ",
            "    running 2 tests",
            "    test a ... ok",
            "    error: test failed, to rerun pass `-p x --test all`",
            "      all-1: signal: 6 (SIGABRT)",
        ];
        let rest = rest.map(str::to_owned);
        [first].into_iter().chain(rest).collect::<Vec<_>>()
    };
    let run = |tests: &'static [&str]| move |_: &Block| output(tests, "-p x --test all");
    assert_eq!(repeat(&aborted(), run(&[])), Ok(lines("unsteady")));
    assert_eq!(repeat(&aborted(), run(&["b"])), Err(lines("failed twice")));
    assert_eq!(
        repeat(&aborted(), |_| aborted()),
        Err(lines("failed twice"))
    );
    let report = aborted();
    assert_eq!(
        again_arguments(&report),
        "test --workspace --no-fail-fast --test all -- --exact"
    );
}

fn again_arguments(report: &Report) -> String {
    again(report.failed().expect("a list of targets")[0], &[]).join(" ")
}

#[test]
fn a_second_run_selects_the_failed_tests_of_one_target() {
    let report = output(&["a", "b"], "-p x --test all");
    let blocks = report.failed().expect("a list of targets");
    let words = |text: &'static str| text.split(' ').collect::<Vec<_>>();
    assert_eq!(
        again(blocks[0], &[]),
        words("test --workspace --no-fail-fast --test all -- --exact a b")
    );
    // The user's arguments stay. Those that the harness would refuse a second time do not.
    assert_eq!(
        again(
            blocks[0],
            &words("--release -- --ignored --exact --test-threads 8 --test-threads=4")
        ),
        words("test --workspace --no-fail-fast --release --test all -- --exact --ignored a b")
    );
}

#[test]
fn output_and_errors_are_one_stream_that_ends_with_the_program() {
    let shell = |script: &str| {
        let mut command = Command::new("sh");
        command.args(["-c", script]);
        let mut seen = Vec::new();
        let status = lines(command, |line| seen.push(line.to_owned()));
        (status.expect("a shell").code(), seen)
    };
    let (code, seen) = shell("echo a; echo b >&2; echo c; exit 7");
    assert_eq!(
        (code, seen),
        (Some(7), ["a", "b", "c"].map(str::to_owned).to_vec())
    );
    // A process that was left behind has the output, and is not awaited.
    let (code, seen) = shell("sleep 600 & echo $!");
    assert_eq!(code, Some(0));
    let killed = Command::new("kill").args(&seen).status();
    assert!(killed.expect("kill").success(), "{seen:?}");
}

#[test]
fn packages_of_components_and_tests_are_left_out_if_they_have_no_examples() {
    let package = |name: &str, folder: &str, doctest: bool| {
        let manifest = format!("/ws/{folder}/Cargo.toml");
        serde_json::json!({
            "name": name, "manifest_path": manifest,
            "targets": [{"doctest": doctest}, {"doctest": false}]
        })
    };
    let metadata = serde_json::json!({"workspace_root": "/ws", "packages": [
        package("eye", "components/eye", false),
        package("shown", "components/shown", true),
        package("peer", "xtask/bench/peer", false),
        package("features", "runtime/features", false),
        package("runtime", "runtime", true),
    ]});
    assert_eq!(without_examples(&metadata), ["eye", "peer"]);
}
