//! Networks with a proxy: an editor tells of their connections what `rcdeploy check` tells.

use super::{Editor, GRIP, HAND};

const ASKER: &str = "import \"Grip.idsl\";\n\nComponent asker\n{\n    Communications\n    {\n        requires Grip;\n    };\n    language rust;\n};\n";
/// Another module of the same name.
const OTHER: &str = "module Grip\n{\n    interface Claw\n    {\n        void open();\n    };\n};\n";
const CLAW: &str = "import \"Grip.idsl\";\n\nComponent claw\n{\n    Communications\n    {\n        implements Claw;\n    };\n    language rust;\n};\n";

/// A group behind a proxy that others see over DDS.
const ARM: &str = "    Group arm { Component hand { cdsl \"hand.cdsl\"; }; export Grip; proxy dds { domain 7; }; };\n";

/// Nobody serves it.
const LOST: &str = "    Component lost { cdsl \"lost.cdsl\"; };\n";

#[test]
fn findings_of_networks_with_a_proxy_are_those_of_the_check() {
    let folder = tempfile::tempdir().expect("a folder");
    let write = |name: &str, text: &str| {
        std::fs::write(folder.path().join(name), text).expect("a file");
    };
    std::fs::create_dir(folder.path().join("claw")).expect("a folder");
    for (name, text) in [
        ("Grip.idsl", GRIP),
        ("hand.cdsl", HAND),
        ("asker.cdsl", ASKER),
        (
            "both.cdsl",
            &HAND.replace(
                "Grip;\n    }",
                "Grip;\n        requires Grip as next;\n    }",
            ),
        ),
        ("Lost.idsl", &GRIP.replace("Grip", "Lost")),
        (
            "lost.cdsl",
            &ASKER.replace("Grip", "Lost").replace("asker", "lost"),
        ),
        ("claw/Grip.idsl", OTHER),
        ("claw/claw.cdsl", CLAW),
    ] {
        write(name, text);
    }
    let asker = |more: &str| format!("    Component asker {{ cdsl \"asker.cdsl\"; {more} }};\n");
    let both = |group: &str| {
        format!(
            "    Group {group} {{ Component a {{ cdsl \"both.cdsl\"; }}; export Grip, next; proxy; }};\n"
        )
    };
    let line = |time: &str| {
        let two = ARM.replace("arm", "two").replace(" dds { domain 7; }", "");
        let binds = "    bind one.next -> two.Grip;\n    bind asker.Grip -> one.Grip;\n";
        [time, &both("one"), &two, &asker(""), binds].concat()
    };
    let cases: [(String, &[(&str, u64)]); 10] = [
        // What is right is known from a component whose connection is missed.
        (
            ARM.to_owned() + &asker("middleware dds { domain 7; };") + LOST,
            &[("no-provider", 4)],
        ),
        (
            ARM.to_owned() + &asker("middleware iceoryx2;"),
            &[("middleware-mismatch", 3)],
        ),
        (
            ARM.to_owned() + &asker("middleware dds { domain 8; };"),
            &[("domain-mismatch", 3)],
        ),
        (
            format!(
                "    Host away {{ address \"10.0.0.2\"; }};\n{}{}",
                ARM.replace("hand.cdsl\";", "hand.cdsl\"; host away;")
                    .replace(" dds { domain 7; }", ""),
                asker("middleware iceoryx2;")
            ),
            &[("shared-memory-across-hosts", 4)],
        ),
        (
            ARM.replace(
                "; }; export",
                "; middleware iceoryx2; }; Component asker { cdsl \"asker.cdsl\"; middleware dds; }; export",
            ),
            &[("middleware-mismatch", 2)],
        ),
        (
            both("one")
                + &both("two")
                + "    bind one.next -> two.Grip;\n    bind two.next -> one.Grip;\n",
            &[("proxy-cycle", 2)],
        ),
        // It calls out through the proxy that calls it: that is a circle where calls pass one at a time.
        (line("") + LOST, &[("no-provider", 7)]),
        (
            line(
                "    time simulated by hands.clock;\n    Group hands { Component clock { cdsl \"hand.cdsl\"; }; };\n",
            ),
            &[("not-a-time-source", 2), ("requires-cycle", 4)],
        ),
        (
            ARM.replace(
                "; export Grip",
                "; Component claw { cdsl \"claw/claw.cdsl\"; }; export Grip, Claw",
            ),
            &[("proxy-interfaces", 2)],
        ),
        (
            ARM.to_owned()
                + &asker("middleware dds { domain 7; };")
                + "    bind asker.Grip -> arm.hand.Grip;\n",
            &[("behind-proxy", 4)],
        ),
    ];
    let mut editor = Editor::open_folder(folder.path());
    let text = |body: &str| format!("Deployment n\n{{\n{body}}};\n");
    editor.open(
        "n.ddsl",
        &text("    Component nobody { cdsl \"no.cdsl\"; };\n"),
    );
    for (body, wanted) in &cases {
        editor.wait_for("n.ddsl", &[("component-not-found", 2)]);
        editor.change("n.ddsl", &text(body));
        editor.wait_for("n.ddsl", wanted);
        editor.change(
            "n.ddsl",
            &text("    Component nobody { cdsl \"no.cdsl\"; };\n"),
        );
    }
    editor.end();
}
