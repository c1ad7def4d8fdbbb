//! What is said about `.ddsl` texts, and about the networks that they describe.

#![expect(clippy::needless_raw_string_hashes, reason = "expect-test writes them")]

use expect_test::{Expect, expect};
use rc_cdsl::Component;
use rc_cdsl::model::Backend;
use rc_diagnostics::{Format, SourceMap, render};
use rc_syntax::MemoryLoader;

/// What is found in a whole file `n.ddsl`.
fn check_file(text: &str, expected: &Expect) {
    let mut sources = SourceMap::new();
    let source = sources.add("n.ddsl", text);
    let (_, found) = rc_ddsl::parse(&sources, source);
    expected.assert_eq(&render(&sources, &found, Format::Short));
}

/// What is found in `body`, which stands in a deployment from line 2 on.
fn check(body: &str, expected: &Expect) {
    check_file(&format!("Deployment n {{\n{body}\n}};\n"), expected);
}

/// Every interface that the components of [`connect`] know.
const INTERFACES: [(&str, &str); 2] = [
    (
        "Laser.idsl",
        "module L { struct D { int a; }; interface Laser { D get(); }; };",
    ),
    (
        "Pub.idsl",
        "module P { interface Pub { void push(int x); }; };",
    ),
];

/// The connections of a deployment whose components `(instance, communications)` are given, and what is found
/// in it; `binds` begins line 2. An instance whose communications begin with `old` has another definition of
/// `Laser`.
fn connect(instances: &[(&str, &str)], binds: &str, expected: &Expect) -> Vec<String> {
    let mut sources = SourceMap::new();
    let mut text = format!("Deployment n {{\n{binds}\n");
    let mut components: Vec<Component> = Vec::new();
    for (name, communications) in instances {
        text.push_str(&format!("Component {name} {{ cdsl \"{name}.cdsl\"; }};\n"));
        let mut interfaces = INTERFACES;
        let communications = match communications.strip_prefix("old") {
            Some(rest) => {
                interfaces[0].1 =
                    "module L { struct D { long a; }; interface Laser { D get(); }; };";
                rest
            }
            None => communications,
        };
        let imports = ["Laser", "Pub"]
            .into_iter()
            .filter(|i| communications.contains(i));
        let imports: String = imports.map(|i| format!("import \"{i}\";")).collect();
        let cdsl = format!(
            "{imports}\nComponent {name} {{ Communications {{ {communications} }}; language rust; }};"
        );
        let source = sources.add(format!("{name}.cdsl"), cdsl);
        let loader = MemoryLoader::new(interfaces);
        let (component, found) = rc_cdsl::load(&mut sources, &loader, source);
        assert_eq!(render(&sources, &found, Format::Short), "");
        components.extend(component);
    }
    text.push_str("};");
    let source = sources.add("n.ddsl", text);
    let (deployment, found) = rc_ddsl::parse(&sources, source);
    assert_eq!(render(&sources, &found, Format::Short), "");
    let deployment = deployment.expect("a deployment");
    let parts: Vec<Option<&Component>> = components.iter().map(Some).collect();
    let (network, found) = rc_ddsl::connect(&deployment, &parts, Backend::Iceoryx2);
    expected.assert_eq(&render(&sources, &found, Format::Short));
    let name = |end: rc_ddsl::Endpoint| {
        format!(
            "{}.{}",
            instances[end.instance].0, components[end.instance].slots[end.slot].name
        )
    };
    let connections = network.connections.iter();
    connections
        .map(|c| format!("{} -> {}", name(c.consumer), name(c.provider)))
        .collect()
}

#[test]
fn whole_files() {
    check_file(
        "",
        &expect![[r#"
        n.ddsl:1:1: error[empty-file]: this file is empty; it should hold `Deployment NAME { … };`
    "#]],
    );
    check_file("Deployment n { };", &expect![[""]]);
    check_file(
        "Deployment { };",
        &expect![[r#"
        n.ddsl:1:12: error[syntax-error]: expected a name, found `{`
    "#]],
    );
    check_file(
        "Component a { };",
        &expect![[r#"
        n.ddsl:1:1: error[syntax-error]: expected `Deployment`, found `Component`
    "#]],
    );
    check_file(
        "Deployment n { Component a { cdsl \"a\"; };\n",
        &expect![[r#"
            n.ddsl:2:1: error[syntax-error]: expected `}` or a declaration, found the end of the file
        "#]],
    );
    check_file(
        "Deployment n\n Component a { cdsl \"a\"; };\n};",
        &expect![[r#"
            n.ddsl:2:2: error[syntax-error]: expected `{`, found `Component`
        "#]],
    );
    check_file(
        "Deployment n { };\nDeployment m { };",
        &expect![[r#"
            n.ddsl:2:1: error[text-after-end]: there is text after the end; a file holds one `Deployment NAME { … };`
        "#]],
    );
}

#[test]
fn a_forgotten_semicolon_is_one_error_where_it_belongs() {
    check(
        "middleware iceoryx2\nComponent a { cdsl \"a.cdsl\"\nafter b // first\nready 5s\nargs \"x\", \"y\"\nenv { A \"1\" B \"2\" }\n}\n\
         Component b { cdsl \"b.cdsl\" config \"c.toml\" }\nbind a.Laser -> b.Laser",
        &expect![[r#"
            n.ddsl:2:20: error[missing-semicolon]: `;` expected here
            n.ddsl:3:28: error[missing-semicolon]: `;` expected here
            n.ddsl:4:8: error[missing-semicolon]: `;` expected here
            n.ddsl:5:9: error[missing-semicolon]: `;` expected here
            n.ddsl:6:14: error[missing-semicolon]: `;` expected here
            n.ddsl:7:12: error[missing-semicolon]: `;` expected here
            n.ddsl:7:18: error[missing-semicolon]: `;` expected here
            n.ddsl:9:28: error[missing-semicolon]: `;` expected here
            n.ddsl:9:44: error[missing-semicolon]: `;` expected here
            n.ddsl:10:24: error[missing-semicolon]: `;` expected here
        "#]],
    );
}

#[test]
fn what_cannot_be_read_does_not_hide_the_rest() {
    check(
        "Component a { cdls \"a.cdsl\"; cdsl a.cdsl; after ; after \"b\"; ready soon; stop 0s; env A \"1\"; env { A = \"1\"; }; args x; restart always max 3; };\n\
         Compnent b { cdsl \"b\"; };\nbind a.Laser b.Laser;\nbind a -> b;\nbind a.Laser => b.Laser;\nmiddleware iceorix2;\ndomain x;\n§;\nComponent c cdsl \"c\"; };",
        &expect![[r#"
            n.ddsl:2:15: error[unknown-field]: `cdls` does not begin a field of a component (did you mean `cdsl`?)
            n.ddsl:2:35: error[syntax-error]: expected a text in quotes, found `a`
            n.ddsl:2:49: error[syntax-error]: expected a name, found `;`
            n.ddsl:2:57: error[syntax-error]: expected a name, found `"`
            n.ddsl:2:68: error[syntax-error]: expected a time such as `5s`, found `soon`
            n.ddsl:2:79: error[bad-time]: `stop` takes a time such as `5s`
            n.ddsl:2:87: error[syntax-error]: expected `{`, found `A`
            n.ddsl:2:102: error[syntax-error]: expected a text in quotes, found `=`
            n.ddsl:2:117: error[syntax-error]: expected a text in quotes, found `x`
            n.ddsl:2:140: error[syntax-error]: expected `within`, found `;`
            n.ddsl:3:1: error[unknown-field]: `Compnent` does not begin a declaration of a deployment (did you mean `Component`?)
            n.ddsl:4:14: error[syntax-error]: expected `->` or `.`, found `b`
            n.ddsl:5:8: error[syntax-error]: expected `.`, found `-`
            n.ddsl:6:14: error[syntax-error]: expected `->` or `.`, found `=`
            n.ddsl:7:12: error[unknown-middleware]: unknown middleware `iceorix2` (did you mean `iceoryx2`?)
            n.ddsl:8:8: error[syntax-error]: expected a number, found `x`
            n.ddsl:9:1: error[unknown-field]: `§` does not begin a declaration of a deployment (allowed here: `Component`, `Host`, `Group`, `bind`, `middleware`, `domain`)
            n.ddsl:10:13: error[syntax-error]: expected `{`, found `cdsl`
            n.ddsl:11:1: error[text-after-end]: there is text after the end; a file holds one `Deployment NAME { … };`
        "#]],
    );
}

#[test]
fn names_are_known_and_unique() {
    check(
        "middleware iceoryx2; middleware dds;\nComponent a { cdsl \"a\"; cdsl \"b\"; after bb, c; };\nComponent A { cdsl \"a\"; };\nComponent bbb { };\n\
         Component rcdeploy { cdsl \"a\"; };\nbind a.Laser -> bb.Laser;\nbind x.Laser -> a.b.Laser;",
        &expect![[r#"
            n.ddsl:2:33: error[repeated-clause]: the middleware is named twice; the first one at n.ddsl:2:12
            n.ddsl:3:25: error[repeated-clause]: `cdsl` is repeated; each field stands once; the first one at n.ddsl:3:15
            n.ddsl:3:41: error[unknown-instance]: there is no component `bb` in this deployment (did you mean `bbb`?)
            n.ddsl:3:45: error[unknown-instance]: there is no component `c` in this deployment (allowed here: `a`, `A`, `bbb`, `rcdeploy`)
            n.ddsl:4:11: error[duplicate-name]: component `A` is there twice; first declared here at n.ddsl:3:11
            n.ddsl:5:11: error[missing-clause]: component `bbb` does not say what it is (add `cdsl "PATH/NAME.cdsl";`, relative to this file)
            n.ddsl:6:11: error[reserved-name]: `rcdeploy` is the deployer's own name in every network
            n.ddsl:7:17: error[unknown-instance]: there is no component `bb` in this deployment (did you mean `bbb`?)
            n.ddsl:8:17: error[not-supported-yet]: a slot is `instance.slot`; paths through groups are not supported yet
        "#]],
    );
}

#[test]
fn circles_of_after() {
    check(
        "Component a { cdsl \"a\"; after b; };\nComponent b { cdsl \"b\"; after c; };\nComponent c { cdsl \"c\"; after a; };\nComponent d { cdsl \"d\"; after d; };\nComponent e { cdsl \"d\"; after a; };",
        &expect![[r#"
            n.ddsl:4:31: error[after-cycle]: these components wait for each other: a after b after c after a
            n.ddsl:5:31: error[after-cycle]: these components wait for each other: d after d
        "#]],
    );
}

#[test]
fn what_comes_later_says_so() {
    check(
        "Host h { address \"10.0.0.1\"; };\nComponent a { cdsl \"a\"; host h; endpoint \"x:1\"; restart always; cpu 1; priority 3; };\ndomain 3;\nGroup g { Component b { cdsl \"b\"; }; };",
        &expect![[r#"
            n.ddsl:2:1: warning[not-supported-yet]: `Host` is read, but this version does not support it yet; it has no effect
            n.ddsl:3:25: warning[not-supported-yet]: `host` is read, but this version does not support it yet; it has no effect
            n.ddsl:3:33: warning[not-supported-yet]: `endpoint` is read, but this version does not support it yet; it has no effect
            n.ddsl:3:49: warning[not-supported-yet]: `restart` is read, but this version does not support it yet; it has no effect
            n.ddsl:3:65: warning[not-supported-yet]: `cpu` is read, but this version does not support it yet; it has no effect
            n.ddsl:3:72: warning[not-supported-yet]: `priority` is read, but this version does not support it yet; it has no effect
            n.ddsl:4:1: warning[not-supported-yet]: `domain` is read, but this version does not support it yet; it has no effect
            n.ddsl:5:1: error[not-supported-yet]: `Group` is not supported yet; put its components directly into the deployment
        "#]],
    );
}

#[test]
fn slots_find_each_other() {
    let connections = connect(
        &[
            ("a", "requires Laser; subscribesTo Pub;"),
            ("b", "implements Laser; publishes Pub;"),
            ("c", "publishes Pub;"),
        ],
        "",
        &expect![[""]],
    );
    expect![[r#"
        a.Laser -> b.Laser
        a.Pub -> b.Pub
        a.Pub -> c.Pub"#]]
    .assert_eq(&connections.join("\n"));
}

#[test]
fn providers_that_are_missing_or_too_many() {
    connect(
        &[("a", "requires Laser; subscribesTo Pub;")],
        "",
        &expect![[r#"
            n.ddsl:3:11: error[no-provider]: `a.Laser` requires L::Laser, and no component implements it; required here at a.cdsl:2:41
            n.ddsl:3:11: warning[no-publisher]: `a.Pub` subscribes to P::Pub, and nobody publishes it; subscribed here at a.cdsl:2:61
        "#]],
    );
    connect(
        &[
            ("a", "requires Laser;"),
            ("b", "implements Laser, Laser;"),
            ("c", "implements Laser; publishes Pub;"),
        ],
        "",
        &expect![[r#"
            n.ddsl:3:11: error[several-providers]: `a.Laser` could be served by `b.Laser`, `b.Laser1`, `c.Laser` (choose one: `bind a.Laser -> b.Laser;`)
            n.ddsl:5:11: note[no-subscriber]: nobody reads what `c.Pub` publishes
        "#]],
    );
    let connections = connect(
        &[("a", "requires Laser;"), ("b", "implements Laser, Laser;")],
        "bind a.Laser -> b.Laser1;",
        &expect![[""]],
    );
    expect!["a.Laser -> b.Laser1"].assert_eq(&connections.join("\n"));
}

#[test]
fn binds_join_what_belongs_together() {
    let three = [
        ("a", "requires Laser; subscribesTo Pub;"),
        ("b", "implements Laser; publishes Pub;"),
    ];
    connect(
        &three,
        "bind a.laser -> b.Lasre;",
        &expect![[r#"
        n.ddsl:2:8: error[unknown-slot]: `a` has no slot `laser` (did you mean `Laser`?)
        n.ddsl:2:19: error[unknown-slot]: `b` has no slot `Lasre` (did you mean `Laser`?)
    "#]],
    );
    connect(
        &three,
        "bind b.Laser -> a.Laser;",
        &expect![[r#"
        n.ddsl:2:6: error[wrong-direction]: `b.Laser` implements its interface; the consumer stands left of `->` (a consumer requires or subscribesTo, a provider implements or publishes)
    "#]],
    );
    connect(
        &three,
        "bind a.Laser -> a.Pub;",
        &expect![[r#"
        n.ddsl:2:17: error[wrong-direction]: `a.Pub` subscribesTo its interface; `a.Laser` needs a slot that implements
    "#]],
    );
    connect(
        &three,
        "bind a.Laser -> b.Pub;",
        &expect![[r#"
        n.ddsl:2:17: error[wrong-direction]: `b.Pub` publishes its interface; `a.Laser` needs a slot that implements
    "#]],
    );
    connect(
        &three,
        "bind a.Laser -> b.Laser;\nbind a.Laser -> b.Laser;",
        &expect![[r#"
            n.ddsl:3:6: error[bound-twice]: `a.Laser` is bound twice; a required slot has one provider
        "#]],
    );
}

#[test]
fn both_ends_agree() {
    connect(
        &[("a", "requires Laser;"), ("b", "oldimplements Laser;")],
        "",
        &expect![[r#"
            n.ddsl:3:11: error[type-mismatch]: `a.Laser` and `b.Laser` have different definitions of L::Laser: L::Laser/get differs; one definition at Laser.idsl:1:43; the other one at Laser.idsl:1:44
        "#]],
    );
    connect(
        &[
            (
                "a",
                "subscribesTo Pub { reliability reliable; durability transient_local; };",
            ),
            ("b", "publishes Pub { reliability best_effort; };"),
        ],
        "",
        &expect![[r#"
            n.ddsl:3:11: error[qos-mismatch]: `a.Pub` asks for reliability reliable, `b.Pub` offers best_effort
            n.ddsl:3:11: error[qos-mismatch]: `a.Pub` asks for durability transient_local, `b.Pub` offers volatile
        "#]],
    );
    connect(
        &[("a", "requires Laser(dds);"), ("b", "implements Laser;")],
        "bind a.Laser -> b.Laser;",
        &expect![[r#"
            n.ddsl:2:6: error[middleware-mismatch]: `a.Laser` and `b.Laser` use different middleware: dds and iceoryx2
        "#]],
    );
}

#[test]
fn circles_of_requires() {
    connect(
        &[
            ("a", "requires Laser as other; implements Laser;"),
            ("b", "requires Laser as other; implements Laser;"),
        ],
        "bind a.other -> b.Laser;\nbind b.other -> a.Laser;",
        &expect![[r#"
            n.ddsl:4:11: warning[requires-cycle]: these components require each other: a → b → a; calls that they make at the same moment time out
        "#]],
    );
}
