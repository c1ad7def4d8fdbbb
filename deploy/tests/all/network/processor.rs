//! Programs for another processor.

use rc_test_site::site::{PATROL, Site};
use std::fs;

#[test]
fn a_program_for_another_processor_is_neither_sent_nor_started() {
    let site = Site::new("processor");
    let mut program = fs::read(Site::executable("pose_monitor")).expect("a program");
    // `e_machine` of elf(5): AArch64, or x86-64 where this is one.
    program[18] = if program[18] == 183 { 62 } else { 183 };
    fs::write(site.path("monitor"), program).expect("a file");
    let cdsl = "pose_monitor/pose_monitor.cdsl\";";
    let text = PATROL.replace(
        cdsl,
        &format!("{cdsl} executable \"{}\";", site.path("monitor").display()),
    );
    site.write_ddsl(&text);
    let check = site.rcdeploy(&["check", "--profile", "dev", "--format", "short"], true);
    assert_eq!(check.code, 1, "{check:?}");
    let errors: Vec<&str> = check
        .stderr
        .lines()
        .filter(|line| line.contains("error["))
        .collect();
    assert_eq!(errors.len(), 1, "{errors:?}");
    assert!(errors[0].contains("error[wrong-processor]: "), "{errors:?}");
}
