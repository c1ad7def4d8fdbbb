//! A component compares the members that it opens with those that its network lists.

use rack::SpecificWorker;
use rack_generated::embed;

/// The command line of a rack in a network of its own.
fn arguments<'a>(rest: &[&'a str]) -> Vec<&'a str> {
    let mut all = vec!["--network", "rack-lists", "--name", "rack"];
    for setting in [
        "dds.domain=230",
        "dds.interfaces=lo",
        "ros2.domain=231",
        "ros2.interfaces=lo",
    ] {
        all.extend(["--set-middleware", setting]);
    }
    all.extend(rest);
    all
}

#[test]
fn a_component_opens_what_its_network_lists_and_nothing_else() {
    let started = |lists: &[&str]| match embed::<SpecificWorker>(&arguments(lists)) {
        Ok(rack) => {
            rack.stop();
            rack.join().expect("an end in order");
            None
        }
        Err(error) => Some(error.to_string()),
    };
    // The worker opens none: its parameter names none, and the network lists none.
    assert_eq!(started(&["--members", "lasers="]), None);
    let said = started(&[
        "--set",
        "members=[\"front\",\"up\"]",
        "--members",
        "lasers=front,back,left",
    ]);
    assert_eq!(
        said.as_deref(),
        Some(
            "rack: error: the members of `lasers` are not those of the network; it lists `back`, `left`, \
             which the worker does not open; the worker opens `up`, which it does not list; the .ddsl needs \
             `slots { lasers \"front\", \"up\"; }`\n"
        )
    );
    let said = started(&["--set", "members=[\"front\"]", "--bind", "lasers.frnt=a/b"]);
    assert_eq!(
        said.as_deref(),
        Some(
            "rack: error: `frnt` of the array `lasers` has an address, but the worker does not open it; it opens `front`\n"
        )
    );
    for (arguments, reason) in [
        (
            ["--members", "laser=a"],
            "--members: `laser` is not a slot array of rack; did you mean `lasers`?",
        ),
        (
            ["--members", "lasers=a,A"],
            "--members: `lasers` has `A` twice",
        ),
        (
            ["--bind", "lasers=a/b"],
            "`lasers` is a slot array; name a member: `lasers.NAME`",
        ),
        (
            ["--bind", "lasers.=a/b"],
            "`lasers.`: the name of a member has a letter, then letters, digits and single `_`, none at the end",
        ),
    ] {
        assert_eq!(started(&arguments).as_deref(), Some(reason));
    }
}
