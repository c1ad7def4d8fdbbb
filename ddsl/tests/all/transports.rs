//! `middleware auto;`: the middleware of each connection.

#![expect(clippy::needless_raw_string_hashes, reason = "expect-test writes them")]

use crate::network::network;
use expect_test::expect;

const CLIENT: (&str, &str) = ("client", "requires Laser; subscribesTo Pub;");
const SERVER: (&str, &str) = ("server", "implements Laser; publishes Pub;");

/// A component, with more fields.
fn component(name: &str, cdsl: &str, more: &str) -> String {
    format!("Component {name} {{ cdsl \"{cdsl}\"; {more} }};\n")
}

#[test]
fn a_connection_is_in_a_process_on_a_host_or_between_hosts() {
    let body = |choice: &str| {
        [
            choice,
            "Host arm { address \"10.0.0.3\"; };",
            &component("server", "server", "process eyes;"),
            &component("inside", "client", "process eyes;"),
            &component("beside", "client", ""),
            &component("away", "client", "host arm;"),
        ]
        .join("\n")
    };
    let over = |choice: &str| network(&body(choice), &[CLIENT, SERVER], &expect![""]);
    assert_eq!(
        over("middleware auto;"),
        [
            "inside.Laser -> server.Laser over local",
            "inside.Pub -> server.Pub over local",
            "beside.Laser -> server.Laser",
            "beside.Pub -> server.Pub",
            "away.Laser -> server.Laser over dds",
            "away.Pub -> server.Pub over dds",
        ]
    );
    let ros = over("middleware auto remote ros; middleware ros2 { domain 7; };");
    assert_eq!(
        ros[3..5],
        [
            "beside.Pub -> server.Pub",
            "away.Laser -> server.Laser over ros2"
        ]
    );
}

#[test]
fn a_subscriber_has_the_middleware_that_reaches_all_its_publishers() {
    let body = [
        "middleware auto;",
        &component("near", "server", "process eyes;"),
        &component("far", "server", ""),
        &component("hearer", "hearer", "process eyes;"),
    ]
    .join("\n");
    let hearer = ("hearer", "subscribesTo Pub;");
    let connections = network(&body, &[hearer, ("server", "publishes Pub;")], &expect![""]);
    assert_eq!(
        connections,
        ["hearer.Pub -> near.Pub", "hearer.Pub -> far.Pub",]
    );
}

#[test]
fn what_is_chosen_stays_and_the_other_end_follows() {
    let body = [
        "middleware auto;",
        &component("server", "server", "process eyes; middleware ros2;"),
        &component("client", "client", "process eyes;"),
        &component("slot", "slot", "process eyes;"),
        "bind client.Laser -> server.Laser;",
    ]
    .join("\n");
    let slot = ("slot", "requires Laser(ros2);");
    assert_eq!(
        network(&body, &[CLIENT, SERVER, slot], &expect![""]),
        [
            "client.Laser -> server.Laser over ros2",
            "client.Pub -> server.Pub over ros2",
            "slot.Laser -> server.Laser over ros2",
        ]
    );
}

#[test]
fn what_cannot_be_is_reported() {
    let one = component("server", "server", "");
    let check = |choice: &str, expected| {
        network(&format!("{choice}\n{one}"), &[SERVER], &expected);
    };
    check(
        "middleware auto remote iceoryx2;",
        expect![[r#"
        n.ddsl:2:24: error[misplaced-remote]: `iceoryx2` does not connect hosts (after `remote`, write one of: dds, ros2)
        n.ddsl:3:11: note[no-subscriber]: `server.Pub` has no subscriber
    "#]],
    );
    check(
        "middleware dds remote ros2;",
        expect![[r#"
        n.ddsl:2:23: error[misplaced-remote]: `remote` goes with `middleware auto` (write `middleware auto remote ros2;`, or leave `remote` out)
        n.ddsl:3:11: note[no-subscriber]: `server.Pub` has no subscriber
    "#]],
    );
    check(
        "middleware auto remote rose;",
        expect![[r#"
        n.ddsl:2:24: error[unknown-middleware]: unknown middleware `rose` (did you mean `ros2`?)
        n.ddsl:3:11: note[no-subscriber]: `server.Pub` has no subscriber
    "#]],
    );
    check(
        "middleware auto { domain 7; };",
        expect![[r#"
        n.ddsl:2:19: error[unknown-key]: `domain` cannot be set of auto (auto has no settings: write those of a middleware in a clause of its own, `middleware dds { … };`)
        n.ddsl:3:11: note[no-subscriber]: `server.Pub` has no subscriber
    "#]],
    );
    check(
        "middleware dds; middleware auto;",
        expect![[r#"
        n.ddsl:2:28: error[repeated-clause]: `middleware auto` comes second here; the middleware of this block at n.ddsl:2:12 (a block has one middleware: write one of the two)
        n.ddsl:3:11: note[no-subscriber]: `server.Pub` has no subscriber
    "#]],
    );
    check(
        "middleware atuo;",
        expect![[r#"
        n.ddsl:2:12: error[unknown-middleware]: unknown middleware `atuo` (did you mean `auto`?)
        n.ddsl:3:11: note[no-subscriber]: `server.Pub` has no subscriber
    "#]],
    );
    // A subscriber of two middlewares, and two names for the way between hosts.
    let two = [
        "Host arm { address \"10.0.0.3\"; };",
        &component("one", "server", "middleware dds;"),
        &component("other", "server", "middleware ros2;"),
        &component("away", "server", "host arm; middleware auto remote ros2;"),
        &component("hearer", "hearer", "middleware auto;"),
        "bind hearer.Pub -> one.Pub;",
        "bind hearer.Pub -> other.Pub;",
        &component("third", "hearer", "middleware auto;"),
        "bind third.Pub -> away.Pub;",
        &component("held", "hearer", "middleware iceoryx2;"),
        "bind held.Pub -> away.Pub;",
    ]
    .join("\n");
    let described = [
        ("server", "publishes Pub;"),
        ("hearer", "subscribesTo Pub;"),
    ];
    let connections = network(
        &two,
        &described,
        &expect![[r#"
            n.ddsl:12:6: error[middleware-mismatch]: `hearer.Pub` and `other.Pub` use different middleware: `dds` and `ros2` (a slot has one middleware for all its connections: give all its providers one, or `middleware auto`)
            n.ddsl:15:6: error[middleware-mismatch]: `third.Pub` and `away.Pub` use different middleware: `dds` and `ros2` (name the same middleware after `remote` for both)
            n.ddsl:18:6: error[shared-memory-across-hosts]: `held.Pub` and `away.Pub` are on different hosts, `localhost` and `arm`, but `iceoryx2` is limited to one host (use `middleware auto` or `dds`, or run both on one host)
        "#]],
    );
    assert_eq!(connections, ["hearer.Pub -> one.Pub over dds"]);
}
