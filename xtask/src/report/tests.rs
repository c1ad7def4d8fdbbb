//! The reader, on what cargo 1.95 prints.

use super::*;

const FAILED: &str = include_str!("failed.txt");
const AGAIN: &str = include_str!("again.txt");
const ABORTED: &str = include_str!("aborted.txt");

fn report(output: &str) -> Report {
    let mut report = Report::default();
    output.lines().for_each(|line| report.note(line));
    report
}

/// Target, failed tests, doubt: of each target that failed.
fn failed(report: &Report) -> Vec<(String, String, &'static str)> {
    let blocks = report.failed().expect("a list of targets");
    let fields = blocks.into_iter().map(|block| {
        (
            block.rerun.clone().unwrap_or_default(),
            block.failed.join(" "),
            block.doubt.unwrap_or_default(),
        )
    });
    fields.collect()
}

fn target(rerun: &str, tests: &str, doubt: &'static str) -> (String, String, &'static str) {
    (rerun.to_owned(), tests.to_owned(), doubt)
}

#[test]
fn failed_tests_belong_to_their_targets_whatever_tests_print() {
    let doubt = "examples in documentation are not repeated";
    assert_eq!(
        failed(&report(FAILED)),
        [
            target("-p sample-a --lib", "tests::carries", ""),
            target(
                "-p sample-a --test all",
                "network::restarts network::stops",
                ""
            ),
            target("-p sample-a --doc", "a/src/lib.rs - add (line 5)", doubt),
        ]
    );
}

#[test]
fn a_program_that_was_killed_is_no_failed_test() {
    let reported = report(ABORTED);
    assert_eq!(
        failed(&reported)[0],
        target("-p sample-b --test all", "", ENDED)
    );
    let tail = &reported.failed().expect("a list")[0].tail;
    assert!(tail[tail.len() - 1].ends_with("(signal: 6, SIGABRT: process abort signal)"));
}

#[test]
fn a_list_that_contradicts_the_result_is_in_doubt() {
    let output = FAILED.replace("    network::stops\n\ntest", "\ntest");
    let doubt = "its list of failures and its result differ";
    let expected = target("-p sample-a --test all", "network::restarts", doubt);
    assert_eq!(failed(&report(&output))[1], expected);
}

#[test]
fn the_list_at_the_end_of_cargo_has_all_targets() {
    let unknown = FAILED.replace("    `-p sample-a --lib`", "    `-p sample-c --lib`");
    let why = "cargo lists other failed targets at its end";
    assert_eq!(report(&unknown).failed(), Err(why));
    // For example after an error of the compiler.
    let (cut, _) = FAILED.split_once("error: 3 targets").expect("an end");
    assert_eq!(report(cut).failed(), Err("cargo lists no failed targets"));
}

#[test]
fn a_test_passes_the_second_time_only_if_it_ran() {
    let first = report(FAILED);
    let block = first.failed().expect("a list of targets")[1].clone();
    let test = "network::stops".to_owned();
    assert!(report(AGAIN).passes_again(&block, &test));
    // Another test was selected, or none.
    let fewer = AGAIN.replacen("2 passed", "1 passed", 1);
    assert!(!report(&fewer).passes_again(&block, &test));
    let other = AGAIN.replacen("all-f4cc411b73949162", "all-0", 1);
    assert!(!report(&other).passes_again(&block, &test));
    assert!(!first.passes_again(&block, &test));
}
