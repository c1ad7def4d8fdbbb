//! The output of a component that is started by hand about its session and its name.

use rc_test_site::site::Site;
use std::process::Command;

#[test]
fn a_component_does_not_take_a_name_of_the_supervisor() {
    let site = Site::new("reserved");
    for option in ["--name", "--network"] {
        for name in ["rcdeploy", "rcdeploy-guard"] {
            let ran = site.component("speech_server", &[option, name]);
            assert_eq!(ran.code, 2, "{ran:?}");
            let told = format!("{option}: the name `{name}` is reserved for rcdeploy");
            assert!(ran.stderr.contains(&told), "{ran:?}");
        }
    }
    site.assert_nothing_left();
}

/// iceoryx2 does not say why it cannot create a data segment.
#[test]
fn a_limit_of_mapped_memory_is_named() {
    const KIB: u32 = 300_000;
    let site = Site::new("mapped");
    let mut command = Command::new("sh");
    let script = format!("ulimit -v {KIB} && exec \"$@\"");
    command.args(["-c", &script, "sh"]);
    command.arg(Site::executable("speech_server"));
    command.args(["--network", &site.network]);
    let ran = site.run(command);
    assert_eq!(ran.code, 3, "{ran:?}");
    for word in [
        "UnableToCreateDataSegment",
        "limits the memory that a process maps to 300000 kB",
        "`ulimit -v unlimited` before it starts",
    ] {
        assert!(ran.stderr.contains(word), "{ran:?}");
    }
    site.assert_nothing_left();
}
